//! Which smooth surface encloses which.
//!
//! A step tells that the surface above it stands on the ground only if it is part of the *outer* border: a yard is no building because a
//! court was dug into it. The court's step is an inner border of the yard: every way from the court to the rim of the scene leads over
//! the yard.

use super::cells::{Cells, Side};

/// Steep rise from which two cells do not belong to one surface, metres.
pub(super) const STEP: f32 = 1.0;

const NONE: u32 = u32::MAX;

/// Smooth surfaces and their enclosures.
pub(super) struct Enclosures {
    /// The number of the surface of each cell; meaningless where nothing was seen.
    surface: Vec<u32>,
    /// Times at which the search for ways to the rim entered and left a surface.
    entered: Vec<u32>,
    left: Vec<u32>,
    /// For each surface, in the order of entry, the surfaces whose whole branch of the search it cuts off from the rim: sorted triples
    /// (enclosing, entered, left).
    cut_off: Vec<(u32, u32, u32)>,
}

impl Enclosures {
    /// Surfaces are the cells that hang together without steep rises; ways lead from one to any that touches it, and to the rim
    /// from each that touches a cell without data. `usable` are the cells that count.
    ///
    /// A surface encloses what cannot reach the rim without it: an articulation point of the graph of surfaces (Tarjan 1972).
    /// O(cells log cells).
    pub(super) fn of(cells: &Cells, usable: &[bool]) -> Self {
        let found = cells.surfaces(usable, STEP);
        let surface: Vec<u32> = found.number.iter().map(|number| number.unwrap_or(NONE)).collect();
        let count = found.sizes.len() as u32;
        // The rim is one more node.
        let rim = count;
        let mut touching = Vec::new();
        for i in (0..usable.len()).filter(|&i| usable[i]) {
            for side in Side::ALL {
                match cells.beside(i, side).filter(|(j, _)| usable[*j]) {
                    Some((j, _)) if surface[j] != surface[i] => touching.push((surface[i], surface[j])),
                    Some(_) => {}
                    None => touching.extend([(surface[i], rim), (rim, surface[i])]),
                }
            }
        }
        touching.sort_unstable();
        touching.dedup();
        let (entered, left, cut_off) = articulations(&touching, count as usize + 1, rim);
        Self { surface, entered, left, cut_off }
    }

    /// Whether the surface of `outer` encloses that of `inner`. O(log surfaces).
    pub(super) fn encloses(&self, outer: usize, inner: usize) -> bool {
        let (outer, inner) = (self.surface[outer], self.surface[inner]);
        let (entered, left) = (self.entered[inner as usize], self.left[inner as usize]);
        let at = self.cut_off.partition_point(|&(by, from, _)| (by, from) <= (outer, entered));
        at > 0 && {
            let (by, from, to) = self.cut_off[at - 1];
            by == outer && from <= entered && left <= to
        }
    }
}

/// Depth-first search from `root` over sorted pairs of touching nodes: times of entry and leaving, and the branches that a node cuts
/// off from the root.
fn articulations(touching: &[(u32, u32)], nodes: usize, root: u32) -> (Vec<u32>, Vec<u32>, Vec<(u32, u32, u32)>) {
    let first: Vec<usize> = (0..=nodes as u32).map(|node| touching.partition_point(|pair| pair.0 < node)).collect();
    let mut entered = vec![NONE; nodes];
    let mut left = vec![0; nodes];
    // The earliest entry that a branch can reach without its root.
    let mut reaches = vec![NONE; nodes];
    let mut cut_off = Vec::new();
    let mut time = 0;
    // Node, the node before it, next pair to look at.
    let mut path = vec![(root, NONE, first[root as usize])];
    entered[root as usize] = time;
    reaches[root as usize] = time;
    time += 1;
    while let Some((node, before, next)) = path.last_mut() {
        let (node, before) = (*node, *before);
        if *next < first[node as usize + 1] {
            let other = touching[*next].1;
            *next += 1;
            if entered[other as usize] == NONE {
                entered[other as usize] = time;
                reaches[other as usize] = time;
                time += 1;
                path.push((other, node, first[other as usize]));
            } else if other != before {
                reaches[node as usize] = reaches[node as usize].min(entered[other as usize]);
            }
        } else {
            left[node as usize] = time;
            path.pop();
            if before != NONE {
                reaches[before as usize] = reaches[before as usize].min(reaches[node as usize]);
                if before != root && reaches[node as usize] >= entered[before as usize] {
                    cut_off.push((before, entered[node as usize], time));
                }
            }
        }
    }
    cut_off.sort_unstable();
    (entered, left, cut_off)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Whether removing `outer` keeps `inner` from the root, by brute force.
    fn separated(touching: &[(u32, u32)], root: u32, outer: u32, inner: u32) -> bool {
        let mut reached = vec![root];
        let mut next = 0;
        while next < reached.len() {
            for &(a, b) in touching {
                if a == reached[next] && b != outer && !reached.contains(&b) {
                    reached.push(b);
                }
            }
            next += 1;
        }
        !reached.contains(&inner)
    }

    #[test]
    fn enclosures_are_what_removal_separates() {
        let mut random = gable_geometry::Counter::new(4);
        for _ in 0..200 {
            let nodes = 3 + (random.unit() * 9.0) as u32;
            let root = nodes - 1;
            let mut touching = Vec::new();
            for a in 0..nodes {
                for b in 0..a {
                    if random.unit() < 0.3 {
                        touching.extend([(a, b), (b, a)]);
                    }
                }
            }
            touching.sort_unstable();
            let (entered, left, cut_off) = articulations(&touching, nodes as usize, root);
            let found = Enclosures { surface: (0..nodes).collect(), entered, left, cut_off };
            for outer in 0..root {
                for inner in 0..root {
                    // What the root does not reach at all does not occur: every surface has a way to the rim.
                    if outer != inner && found.entered[inner as usize] != NONE {
                        let expected = separated(&touching, root, outer, inner);
                        assert_eq!(
                            found.encloses(outer as usize, inner as usize),
                            expected,
                            "{touching:?} {outer} {inner}"
                        );
                    }
                }
            }
        }
    }
}
