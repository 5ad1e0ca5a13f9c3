//! A tree of boxes: what is near a point or inside a box, among thousands to millions.

use gable_geometry::DVec3;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) low: DVec3,
    pub(crate) high: DVec3,
}

impl Bounds {
    pub(crate) fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        let mut b = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        for p in points {
            b.low = b.low.min(p);
            b.high = b.high.max(p);
        }
        b
    }

    fn joined(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        (p - p.clamp(self.low, self.high)).length_squared()
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// First item of a leaf, or the right child (the left one follows its parent).
    first: u32,
    /// Items of a leaf, 0 for an inner node.
    count: u32,
}

/// Boxes in a binary tree, split at the median of the longest axis. Built in O(n log n); a nearest question takes
/// O(log n) on surfaces. Halving keeps the depth under 32, and a search holds at most two boxes a level.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

const LEAF: usize = 4;

impl Tree {
    /// Items are numbered in the order of their boxes.
    pub(crate) fn new(boxes: &[Bounds]) -> Self {
        let mut tree = Self { nodes: Vec::new(), items: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            let centres: Vec<DVec3> = boxes.iter().map(|b| 0.5 * (b.low + b.high)).collect();
            let mut items = std::mem::take(&mut tree.items);
            tree.build(boxes, &centres, &mut items, 0);
            tree.items = items;
        }
        tree
    }

    fn build(&mut self, boxes: &[Bounds], centres: &[DVec3], items: &mut [u32], offset: usize) {
        let bounds = items.iter().map(|&i| boxes[i as usize]).reduce(Bounds::joined);
        let Some(bounds) = bounds else { return };
        let at = self.nodes.len();
        self.nodes.push(Node { bounds, first: offset as u32, count: items.len() as u32 });
        if items.len() <= LEAF {
            return;
        }
        let size = Bounds::of(items.iter().map(|&i| centres[i as usize]));
        let size = size.high - size.low;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        let half = items.len() / 2;
        // The index decides between equal centres, so that the tree is the same everywhere.
        items.select_nth_unstable_by(half, |&a, &b| {
            centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
        });
        let (left, right) = items.split_at_mut(half);
        self.build(boxes, centres, left, offset);
        self.nodes[at] = Node { bounds, first: self.nodes.len() as u32, count: 0 };
        self.build(boxes, centres, right, offset + half);
    }

    /// Calls `visit` for every item whose node's box overlaps `bounds`: a superset of the items that do.
    pub(crate) fn near(&self, bounds: &Bounds, mut visit: impl FnMut(usize)) {
        self.any(bounds, |i| {
            visit(i);
            false
        });
    }

    /// Whether `test` holds for an item that [`Tree::near`] visits; stops at the first.
    pub(crate) fn any(&self, bounds: &Bounds, mut test: impl FnMut(usize) -> bool) -> bool {
        // The left child follows its parent, so a stack as deep as the tree is enough.
        let mut stack = [0_u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let at = stack[depth];
            let node = &self.nodes[at as usize];
            if !node.bounds.overlaps(bounds) {
                continue;
            }
            if node.count > 0 {
                let items = &self.items[node.first as usize..][..node.count as usize];
                if items.iter().any(|&i| test(i as usize)) {
                    return true;
                }
            } else {
                stack[depth] = node.first;
                stack[depth + 1] = at + 1;
                depth += 2;
            }
        }
        false
    }

    /// The least of `distance_squared(item)`, which must not be below that of the item's box; `limit` (squared) if none
    /// is less.
    pub(crate) fn nearest_squared(&self, p: DVec3, limit: f64, distance_squared: impl Fn(usize) -> f64) -> f64 {
        let mut best = limit;
        let Some(root) = self.nodes.first() else { return best };
        let mut stack = [(0.0, 0_u32); 64];
        stack[0].0 = root.bounds.distance_squared(p);
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (from, at) = stack[depth];
            if from >= best {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for &item in &self.items[node.first as usize..][..node.count as usize] {
                    best = best.min(distance_squared(item as usize));
                }
                continue;
            }
            let (left, right) = (at + 1, node.first);
            let near = |n: u32| (self.nodes[n as usize].bounds.distance_squared(p), n);
            let (a, b) = (near(left), near(right));
            let (close, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            stack[depth] = far;
            stack[depth + 1] = close;
            depth += 2;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, dvec3};

    #[test]
    fn finds_what_a_search_through_all_finds() {
        let mut random = Counter::new(4);
        let mut point = |size: f64| dvec3(random.range(0., size), random.range(0., size), random.range(0., size));
        let boxes: Vec<Bounds> = (0..300)
            .map(|_| {
                let low = point(100.0);
                Bounds { low, high: low + point(6.0) }
            })
            .collect();
        let tree = Tree::new(&boxes);
        for _ in 0..200 {
            let p = point(110.0);
            let brute = boxes.iter().map(|b| b.distance_squared(p)).fold(f64::INFINITY, f64::min);
            assert_eq!(tree.nearest_squared(p, f64::INFINITY, |i| boxes[i].distance_squared(p)), brute);
            assert_eq!(tree.nearest_squared(p, 1.0, |i| boxes[i].distance_squared(p)), brute.min(1.0));
            let window = Bounds { low: p, high: p + 9.0 };
            let mut found = Vec::new();
            tree.near(&window, |i| found.push(i));
            found.retain(|&i| boxes[i].overlaps(&window));
            found.sort_unstable();
            let brute: Vec<usize> = (0..boxes.len()).filter(|&i| boxes[i].overlaps(&window)).collect();
            assert_eq!(found, brute);
        }
        assert_eq!(Tree::new(&[]).nearest_squared(DVec3::ZERO, 7.0, |_| 0.0), 7.0);
    }
}
