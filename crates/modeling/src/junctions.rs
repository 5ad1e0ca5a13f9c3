//! Splits non-manifold junctions of a partition before it is extruded.
//!
//! Around a vertex, the regions stand at different heights. Above any height the solid fills some of the
//! sectors around the vertex; if those are not one run, four or more walls meet in the vertical line
//! through the vertex and the solid is not a manifold (two houses that touch at a corner, a chequerboard of high
//! and low roofs). The tip of one sector is cut off and given to a neighbour, which parts
//! the walls by the length of the cut.

use crate::partition::{Edge, Partition, Region};
use gable_geometry::Plane;
use std::collections::BTreeMap;

/// One sector around a vertex: the region to the left of the edge towards `neighbour`.
#[derive(Clone, Copy, Debug)]
struct Sector {
    neighbour: u32,
    region: Option<Region>,
    height: f64,
}

/// Cuts tips by `cut` metres (at most a quarter of the edge) until each vertex carries a manifold; heights that
/// differ by less than `weld` metres count as equal. Returns the number of cuts. O(edges · log).
pub(crate) fn split(partition: &mut Partition, planes: &[Plane], weld: f64, cut: f64) -> usize {
    let areas = partition.areas();
    let mut cuts = 0;
    let mut links = Links::of(partition);
    let mut vertex = 0;
    // Cuts add vertices of three sectors at most, which are manifolds: no vertex is visited without end.
    while vertex < partition.vertices.len() {
        for _ in 0..MOST_CUTS {
            let Some((sector, next, beyond)) = find(partition, &links, planes, &areas, weld, vertex as u32) else {
                break;
            };
            if !cut_tip(partition, &mut links, vertex as u32, sector, next, beyond, cut) {
                break;
            }
            cuts += 1;
        }
        vertex += 1;
    }
    cuts
}

/// Most cuts at one vertex: more than any number of sectors needs.
const MOST_CUTS: usize = 16;

/// How edges hang together, kept up to date while tips are cut.
struct Links {
    /// Edge index by (from, to).
    index: BTreeMap<(u32, u32), usize>,
    /// The edge before each edge in its ring.
    previous: Vec<usize>,
}

impl Links {
    fn of(partition: &Partition) -> Self {
        let mut previous = vec![usize::MAX; partition.edges.len()];
        for (i, e) in partition.edges.iter().enumerate() {
            previous[e.next] = i;
        }
        Self { index: partition.index(), previous }
    }

    fn find(&self, from: u32, to: u32) -> Option<usize> {
        self.index.get(&(from, to)).copied()
    }

    /// Moves the start of an edge.
    fn set_from(&mut self, partition: &mut Partition, edge: usize, from: u32) {
        let e = &mut partition.edges[edge];
        self.index.remove(&(e.from, e.to));
        e.from = from;
        self.index.insert((e.from, e.to), edge);
    }

    /// Moves the end of an edge.
    fn set_to(&mut self, partition: &mut Partition, edge: usize, to: u32) {
        let e = &mut partition.edges[edge];
        self.index.remove(&(e.from, e.to));
        e.to = to;
        self.index.insert((e.from, e.to), edge);
    }

    /// Makes `next` follow `edge`.
    fn follow(&mut self, partition: &mut Partition, edge: usize, next: usize) {
        partition.edges[edge].next = next;
        self.previous[next] = edge;
    }

    /// Adds an edge after `before` in its ring.
    fn insert_after(&mut self, partition: &mut Partition, before: usize, from: u32, to: u32) -> usize {
        let Edge { region, next, .. } = partition.edges[before];
        let edge = partition.edges.len();
        partition.edges.push(Edge { from, to, region, next });
        self.previous.push(before);
        self.index.insert((from, to), edge);
        self.follow(partition, before, edge);
        self.previous[next] = edge;
        edge
    }

    /// Edges that leave a vertex, as (neighbour, edge).
    fn leaving(&self, v: u32) -> impl Iterator<Item = (u32, usize)> + '_ {
        self.index.range((v, 0)..=(v, u32::MAX)).map(|(&(_, n), &e)| (n, e))
    }
}

/// The sectors around a vertex, counter-clockwise.
fn sectors(partition: &Partition, links: &Links, planes: &[Plane], v: u32) -> Vec<Sector> {
    let at = partition.vertices[v as usize];
    let index = &links.index;
    // The edge into `v` before each leaving one comes from a neighbour too, also where ground lies behind it.
    let mut neighbours: Vec<u32> =
        links.leaving(v).flat_map(|(n, e)| [n, partition.edges[links.previous[e]].from]).collect();
    neighbours.sort_unstable();
    neighbours.dedup();
    let angle = |n: &u32| (partition.vertices[*n as usize] - at).to_angle();
    neighbours.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    let region = |n: u32| index.get(&(v, n)).map(|&e| partition.edges[e].region);
    neighbours
        .into_iter()
        .map(|neighbour| {
            let region = region(neighbour);
            Sector { neighbour, region, height: region.map_or(f64::NEG_INFINITY, |r| planes[r].height(at)) }
        })
        .collect()
}

/// The sector to cut at a vertex, the one after it (counter-clockwise), and whether the tip goes to that one (or
/// to the one before it); `None` if the vertex carries a manifold.
fn find(
    partition: &Partition,
    links: &Links,
    planes: &[Plane],
    areas: &[f64],
    weld: f64,
    v: u32,
) -> Option<(Sector, Sector, Option<Sector>)> {
    // Three sectors or fewer are one run at any height.
    if links.leaving(v).count() < 2 {
        return None;
    }
    let around = sectors(partition, links, planes, v);
    let n = around.len();
    if n < 4 {
        return None;
    }
    let mut levels: Vec<f64> = around.iter().map(|s| s.height).collect();
    levels.sort_by(f64::total_cmp);
    // Heights become one as when the solid is raised: from the lowest of each level on.
    let mut from = levels[0];
    for &level in &levels[1..] {
        if level - from <= weld {
            continue;
        }
        from = level;
        let inside = |i: usize| around[i % n].height >= level;
        let changes = (0..n).filter(|&i| inside(i) != inside(i + 1)).count();
        if changes <= 2 {
            continue;
        }
        let alone = |i: usize| inside(i) != inside(i + n - 1) && inside(i) != inside(i + 1);
        let area = |i: usize| around[i].region.map_or(f64::INFINITY, |r| areas.get(r).copied().unwrap_or(0.0));
        let i = (0..n)
            .filter(|&i| alone(i))
            .min_by(|&i, &j| inside(j).cmp(&inside(i)).then(area(i).total_cmp(&area(j))))?;
        let (after, before) = (around[(i + 1) % n], around[(i + n - 1) % n]);
        let to_after = if inside(i) { after.height <= before.height } else { after.height >= before.height };
        return Some((around[i], after, (!to_after).then_some(before)));
    }
    None
}

/// Cuts the tip at `v` of the sector between the edges towards `sector.neighbour` and `next.neighbour` and gives
/// it to `next`'s region, or to that of `before`, the sector on the other side, if it is given. Nothing is cut, and
/// `false` returned, where a ring does not follow the sector's border (two rings cross at the vertex).
fn cut_tip(
    partition: &mut Partition,
    links: &mut Links,
    v: u32,
    sector: Sector,
    next: Sector,
    before: Option<Sector>,
    cut: f64,
) -> bool {
    let (a, b) = (sector.neighbour, next.neighbour);
    // The edges along both sides of the sector: its own ring comes from `b` and leaves to `a`.
    let (from_b, to_a) = (links.find(b, v), links.find(v, a));
    let (to_b, from_a) = (links.find(v, b), links.find(a, v));
    if let (Some(into), Some(out)) = (from_b, to_a)
        && partition.edges[into].next != out
    {
        return false;
    }
    let at = partition.vertices[v as usize];
    let mut point = |towards: u32| {
        let d = partition.vertices[towards as usize] - at;
        let length = d.length();
        partition.vertices.push(at + d * (cut.min(0.25 * length) / length));
        partition.vertices.len() as u32 - 1
    };
    let (a1, b1) = (point(a), point(b));
    // The sector's own ring: b → v → a becomes b → b1 → a1 → a.
    if let (Some(into), Some(out)) = (from_b, to_a) {
        links.set_to(partition, into, b1);
        links.set_from(partition, out, a1);
        links.insert_after(partition, into, b1, a1);
    }
    // Beyond the edge to `b`: v → b.
    if let Some(out) = to_b {
        let into = links.previous[out];
        links.set_from(partition, out, b1);
        if before.is_some() {
            links.insert_after(partition, into, v, b1);
        } else {
            let tip = links.insert_after(partition, into, v, a1);
            links.insert_after(partition, tip, a1, b1);
        }
    }
    // Beyond the edge to `a`: a → v.
    if let Some(into) = from_a {
        links.set_to(partition, into, a1);
        if before.is_some() {
            let tip = links.insert_after(partition, into, a1, b1);
            links.insert_after(partition, tip, b1, v);
        } else {
            links.insert_after(partition, into, a1, v);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    /// Two squares that touch at (4, 4) and ground in the other two quarters.
    fn corner() -> Partition {
        let vertices = vec![
            dvec2(0.0, 0.0),
            dvec2(4.0, 0.0),
            dvec2(4.0, 4.0),
            dvec2(0.0, 4.0),
            dvec2(8.0, 4.0),
            dvec2(8.0, 8.0),
            dvec2(4.0, 8.0),
        ];
        Partition::from_rings(vertices, &[(0, vec![0, 1, 2, 3]), (1, vec![2, 4, 5, 6])])
    }

    #[test]
    fn houses_that_touch_at_a_corner_are_parted() {
        let mut p = corner();
        let cuts = split(&mut p, &[Plane::horizontal(5.0), Plane::horizontal(6.0)], 0.01, 0.05);
        assert_eq!(cuts, 1);
        let total: f64 = p.areas().iter().sum();
        assert!((total - (32.0 - 0.5 * 0.05 * 0.05)).abs() < 1e-9);
    }

    #[test]
    fn a_chequerboard_of_roofs_keeps_its_area() {
        let mut vertices = Vec::new();
        for y in 0..3 {
            for x in 0..3 {
                vertices.push(dvec2(f64::from(x) * 4.0, f64::from(y) * 4.0));
            }
        }
        let rings = [(0, vec![0, 1, 4, 3]), (1, vec![1, 2, 5, 4]), (2, vec![3, 4, 7, 6]), (3, vec![4, 5, 8, 7])];
        let heights = [5.0, 3.0, 3.5, 6.0].map(Plane::horizontal);
        let mut p = Partition::from_rings(vertices.clone(), &rings);
        assert_eq!(split(&mut p, &heights, 0.01, 0.05), 1);
        assert!((p.areas().iter().sum::<f64>() - 64.0).abs() < 1e-9);
        let index = p.index();
        assert_eq!(index.len(), p.edges.len(), "each directed edge occurs once");
        // Two runs are a manifold and stay as they are.
        let mut p = Partition::from_rings(vertices, &rings);
        assert_eq!(split(&mut p, &[5.0, 5.0, 3.0, 3.0].map(Plane::horizontal), 0.01, 0.05), 0);
    }
}
