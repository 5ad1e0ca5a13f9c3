//! Makes a partition coarser in one place, where the solid over it is not valid.
//!
//! What fails is nearly always a sliver: a corner that comes to lie on a wall beside it once heights are welded and
//! vertices are rounded. One sliver must not cost a hall of a hundred roofs its roof shape, nor all its short edges.

use crate::collapse::short_edges_where;
use crate::partition::{Partition, Region};
use gable_geometry::{DVec2, Plane};
use std::collections::{BTreeMap, BTreeSet};

/// Edges shorter than these are collapsed in turn, metres.
const SHORTEST: [f64; 2] = [0.3, 0.8];

/// What lies nearer than this to the outline of the face that failed may be to blame, metres.
const NEAR: f64 = 0.3;

/// The largest region that may go, m².
const LARGEST: f64 = 20.0;

/// The partition with less detail along `outline`, the ring of a face that failed: without the short edges there, or, if
/// there are none, with the smallest region there given to the neighbour that shares most of its border. `None` if
/// nothing is left to be given up. O(edges²) at worst.
pub(crate) fn mend(partition: &Partition, planes: &[Plane], outline: &[DVec2]) -> Option<(Partition, Vec<Plane>)> {
    if outline.is_empty() {
        return None;
    }
    let near = |p: DVec2| distance(p, outline) < NEAR;
    for shortest in SHORTEST {
        let next = short_edges_where(partition, shortest, |a, b| near(a) || near(b));
        if next.edges.len() < partition.edges.len() {
            return Some((next, planes.to_vec()));
        }
    }
    let touched: BTreeSet<Region> = partition
        .edges
        .iter()
        .filter(|e| near(partition.vertices[e.from as usize]) || near(partition.vertices[e.to as usize]))
        .map(|e| e.region)
        .collect();
    let areas = partition.areas();
    let smallest = touched.into_iter().min_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(a.cmp(&b)))?;
    if areas[smallest] > LARGEST || partition.regions < 2 {
        return None;
    }
    let heir = heir(partition, smallest)?;
    let number = |r: Region| if r > smallest { r - 1 } else { r };
    let group: Vec<Option<Region>> =
        (0..partition.regions).map(|r| Some(number(if r == smallest { heir } else { r }))).collect();
    let planes = planes.iter().enumerate().filter(|(r, _)| *r != smallest).map(|(_, plane)| *plane).collect();
    Some((partition.joined(&group), planes))
}

/// The region that shares the longest border with another one.
fn heir(partition: &Partition, region: Region) -> Option<Region> {
    let index = partition.index();
    let mut shared: BTreeMap<Region, f64> = BTreeMap::new();
    for e in partition.edges.iter().filter(|e| e.region == region) {
        if let Some(&twin) = index.get(&(e.to, e.from)) {
            let length = partition.vertices[e.from as usize].distance(partition.vertices[e.to as usize]);
            *shared.entry(partition.edges[twin].region).or_default() += length;
        }
    }
    shared.remove(&region);
    shared.into_iter().rev().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(heir, _)| heir)
}

/// Distance of a point to a closed ring.
fn distance(p: DVec2, ring: &[DVec2]) -> f64 {
    let to = |(a, b): (DVec2, DVec2)| {
        let along = b - a;
        let t = ((p - a).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
        p.distance(a + along * t)
    };
    let ends = ring.iter().cycle().skip(1).take(ring.len());
    ring.iter().copied().zip(ends.copied()).map(to).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::tests::pair;
    use gable_geometry::dvec2;

    #[test]
    fn only_what_is_near_gives_way() {
        // Two houses in a row, each with a corner cut by 0.2 m.
        let vertices =
            [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.14, 4.0), (0.0, 3.86), (9.0, 0.0), (9.0, 3.86), (8.86, 4.0)];
        let vertices = vertices.map(|(x, y)| dvec2(x, y)).to_vec();
        let part = Partition::from_rings(vertices, &[(0, vec![0, 1, 2, 3, 4]), (1, vec![1, 5, 6, 7, 2])]);
        let planes = [3.0, 5.0].map(Plane::horizontal);
        let (next, kept) = mend(&part, &planes, &[dvec2(0.0, 3.0), dvec2(0.0, 4.0)]).unwrap();
        assert_eq!((next.edges.len(), kept.len()), (9, 2));
        assert!(next.vertices.contains(&dvec2(8.86, 4.0)), "the far corner stays cut");
    }

    #[test]
    fn then_the_smallest_region_goes() {
        let planes = [3.0, 5.0].map(Plane::horizontal);
        let (next, kept) = mend(&pair(), &planes, &[dvec2(4.0, 0.0), dvec2(4.0, 4.0)]).unwrap();
        assert_eq!((next.regions, next.areas()), (1, vec![32.0]));
        assert_eq!(kept, [planes[1]]);
        assert!(mend(&next, &kept, &[dvec2(4.0, 0.0)]).is_none());
        assert!(mend(&pair(), &planes, &[]).is_none());
    }
}
