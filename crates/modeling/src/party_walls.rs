//! Divides what hangs together into buildings.
//!
//! A connected mask is a row of houses, or two blocks with an alley between them that no mesh shows. Zhu 2018 models it
//! as one building. Here a step in the roof is taken for a party wall where it can be one: roofs that meet along a ridge, a
//! hip or a valley stay together, and so do the parts that no house could be, such as a lift head on a flat roof or the
//! strips of a saw-tooth hall. Houses of one height under one roof cannot be told apart.

use crate::joining::Parts;
use crate::partition::{Partition, Region};
use gable_geometry::{Box2, BoxTree, DVec2, Plane};
use std::collections::BTreeMap;

/// A smaller part is an annexe of its neighbour, m².
pub(crate) const SMALLEST: f64 = 30.0;

/// The regions of each building, in the order of their first region. Roofs whose heights differ by less than `step`
/// metres meet. O(borders · log²), and the neighbours of each part that can be no building.
pub(crate) fn buildings(partition: &Partition, planes: &[Plane], step: f64) -> Vec<Vec<Region>> {
    let areas = partition.areas();
    let mut parts = Parts::of(&Borders::of(partition, planes, step), &areas);
    while let Some((a, b)) = parts.that_belong() {
        parts.join(a, b);
    }
    with_specks(partition, &areas, parts.into_sets())
}

/// Gives parts that touch nothing and are too small for a building to the nearest one that is not; if all are small, they
/// are one building together.
fn with_specks(partition: &Partition, areas: &[f64], parts: Vec<Vec<Region>>) -> Vec<Vec<Region>> {
    let area = |regions: &Vec<Region>| regions.iter().map(|&r| areas[r]).sum::<f64>();
    let (mut large, specks): (Vec<Vec<Region>>, Vec<_>) = parts.into_iter().partition(|p| area(p) >= SMALLEST);
    if large.is_empty() {
        return vec![(0..partition.regions).collect()];
    }
    if !specks.is_empty() {
        let mut corners: Vec<Vec<DVec2>> = vec![Vec::new(); partition.regions];
        for e in &partition.edges {
            corners[e.region].push(partition.vertices[e.from as usize]);
        }
        let places: Vec<(DVec2, usize)> = (0..large.len())
            .flat_map(|n| large[n].iter().flat_map(|&r| &corners[r]).map(move |&corner| (corner, n)))
            .collect();
        let tree = BoxTree::new(&places.iter().map(|(corner, _)| Box2::of([*corner])).collect::<Vec<_>>());
        for speck in specks {
            let ends: Vec<DVec2> = speck.iter().flat_map(|&r| corners[r].iter().copied()).collect();
            let nearest = nearest(&ends, &places, &tree);
            large[nearest].extend(speck);
        }
    }
    large.iter_mut().for_each(|regions| regions.sort_unstable());
    large.sort();
    large
}

/// The number of the place nearest to any of some points, the smaller of equals.
fn nearest(ends: &[DVec2], places: &[(DVec2, usize)], tree: &BoxTree) -> usize {
    let around = Box2::of(ends.iter().copied());
    let mut reach = 1.0;
    loop {
        let mut best = (f64::INFINITY, 0);
        let near = tree.near(&around.grown(reach));
        let all = near.len() == places.len();
        for (corner, place) in near.into_iter().map(|i| places[i]) {
            let squared = ends.iter().map(|end| corner.distance_squared(*end)).fold(f64::INFINITY, f64::min);
            if squared < best.0 || (squared == best.0 && place < best.1) {
                best = (squared, place);
            }
        }
        if all || best.0 <= reach * reach {
            return best.1;
        }
        reach *= 2.0;
    }
}

/// A border between two regions, metres.
#[derive(Clone, Copy, Default)]
pub(crate) struct Border {
    pub(crate) length: f64,
    /// Of that, where the roofs meet.
    pub(crate) meeting: f64,
}

pub(crate) struct Borders {
    /// By the smaller and the larger region.
    pub(crate) between: BTreeMap<(Region, Region), Border>,
    /// Length of each region's border with the ground.
    pub(crate) outside: Vec<f64>,
}

impl Borders {
    fn of(partition: &Partition, planes: &[Plane], step: f64) -> Self {
        let index = partition.index();
        let mut out = Self { between: BTreeMap::new(), outside: vec![0.0; partition.regions] };
        for (i, e) in partition.edges.iter().enumerate() {
            let (a, b) = (partition.vertices[e.from as usize], partition.vertices[e.to as usize]);
            let length = a.distance(b);
            let Some(&twin) = index.get(&(e.to, e.from)) else {
                out.outside[e.region] += length;
                continue;
            };
            let other = partition.edges[twin].region;
            if twin < i || other == e.region {
                continue;
            }
            let (p, q) = (planes[e.region], planes[other]);
            let border = out.between.entry((e.region.min(other), e.region.max(other))).or_default();
            border.length += length;
            border.meeting += length * share_below(p.height(a) - q.height(a), p.height(b) - q.height(b), step);
        }
        out
    }
}

/// The share of the way from `a` to `b` on which the absolute value is below `limit`.
fn share_below(a: f64, b: f64, limit: f64) -> f64 {
    if a == b {
        return if a.abs() < limit { 1.0 } else { 0.0 };
    }
    let (low, high) = (a.min(b), a.max(b));
    ((high.min(limit) - low.max(-limit)) / (high - low)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::tests::pair;
    use gable_geometry::dvec2;

    /// Rectangles side by side along x, each 10 m deep, as wide as given.
    fn row(widths: &[f64]) -> Partition {
        let mut x = 0.0;
        let mut vertices = vec![dvec2(0.0, 0.0), dvec2(0.0, 10.0)];
        let mut rings = Vec::new();
        for (i, width) in widths.iter().enumerate() {
            x += width;
            let n = vertices.len() as u32;
            vertices.extend([dvec2(x, 0.0), dvec2(x, 10.0)]);
            rings.push((i, vec![n - 2, n, n + 1, n - 1]));
        }
        Partition::from_rings(vertices, &rings)
    }

    fn flat(heights: &[f64]) -> Vec<Plane> {
        heights.iter().map(|&z| Plane::horizontal(z)).collect()
    }

    #[test]
    fn a_row_of_houses_is_divided_at_its_steps() {
        let p = row(&[6.0, 6.0, 6.0, 6.0]);
        assert_eq!(buildings(&p, &flat(&[5.0, 6.0, 6.2, 7.0]), 0.5), [vec![0], vec![1, 2], vec![3]]);
        assert_eq!(buildings(&p, &flat(&[5.0, 6.0, 6.2, 7.0]), 2.0), [vec![0, 1, 2, 3]]);
    }

    #[test]
    fn the_sides_of_a_roof_stay_together() {
        let planes = [Plane { a: 0.5, b: 0.0, c: 3.0 }, Plane { a: -0.5, b: 0.0, c: 7.0 }];
        assert_eq!(buildings(&pair(), &planes, 0.5), [vec![0, 1]]);
    }

    #[test]
    fn roofs_that_cross_at_the_wall_are_two() {
        // Along the wall between them, y from 0 to 10, the difference runs from −2 to 2.
        let planes = [Plane { a: 0.0, b: 0.4, c: 5.0 }, Plane { a: 0.0, b: 0.0, c: 7.0 }];
        assert_eq!(buildings(&row(&[6.0, 6.0]), &planes, 0.5), [vec![0], vec![1]]);
    }

    #[test]
    fn a_neck_joins_no_houses() {
        // Two squares of 10 m and between them a neck 2 m wide, all of one height.
        let xy = [
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 4.0],
            [12.0, 4.0],
            [12.0, 0.0],
            [22.0, 0.0],
            [22.0, 10.0],
            [12.0, 10.0],
            [12.0, 6.0],
            [10.0, 6.0],
            [10.0, 10.0],
            [0.0, 10.0],
        ];
        let vertices = xy.map(DVec2::from_array).to_vec();
        let rings = [(0, vec![0, 1, 2, 9, 10, 11]), (1, vec![2, 3, 8, 9]), (2, vec![3, 4, 5, 6, 7, 8])];
        let p = Partition::from_rings(vertices, &rings);
        assert_eq!(buildings(&p, &flat(&[5.0, 5.0, 5.0]), 0.5).len(), 2);
    }

    #[test]
    fn a_small_annexe_belongs_to_its_house() {
        assert_eq!(buildings(&row(&[8.0, 2.0]), &flat(&[6.0, 3.0]), 0.5), [vec![0, 1]]);
    }

    #[test]
    fn the_strips_of_a_hall_stay_together() {
        // 1.5 m wide and 10 m deep, forty times as large: the strips of a saw-tooth roof.
        let mut p = row(&[1.5; 6]);
        p.vertices.iter_mut().for_each(|v| *v *= 6.0);
        assert_eq!(buildings(&p, &flat(&[5.0, 7.0, 5.0, 7.0, 5.0, 7.0]), 0.5).len(), 1);
    }

    #[test]
    fn a_speck_belongs_to_the_nearest_house() {
        let square = |x: f64, size: f64| [dvec2(x, 0.0), dvec2(x + size, 0.0), dvec2(x + size, size), dvec2(x, size)];
        let vertices = [square(0.0, 8.0), square(30.0, 8.0), square(28.0, 0.5), square(10.0, 0.5)].concat();
        let rings = (0..4u32).map(|i| (i as usize, (4 * i..4 * i + 4).collect())).collect::<Vec<_>>();
        let p = Partition::from_rings(vertices, &rings);
        let heights = flat(&[5.0; 4]);
        assert_eq!(buildings(&p, &heights, 0.5), [vec![0, 3], vec![1, 2]]);
        let mut small = p.clone();
        small.vertices.iter_mut().for_each(|v| *v *= 0.5);
        assert_eq!(buildings(&small, &heights, 0.5), [vec![0, 1, 2, 3]]);
    }

    #[test]
    fn what_stands_on_a_roof_is_no_house() {
        let square = |lo: f64, hi: f64| [dvec2(lo, lo), dvec2(hi, lo), dvec2(hi, hi), dvec2(lo, hi)];
        let vertices = [square(0.0, 30.0), square(10.0, 20.0)].concat();
        let rings = [(0, vec![0, 1, 2, 3]), (0, vec![7, 6, 5, 4]), (1, vec![4, 5, 6, 7])];
        let p = Partition::from_rings(vertices, &rings);
        assert_eq!(buildings(&p, &flat(&[9.0, 13.0]), 0.5), [vec![0, 1]]);
    }
}
