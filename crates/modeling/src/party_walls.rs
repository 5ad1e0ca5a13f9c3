//! Divides what hangs together into buildings.
//!
//! A connected mask is a row of houses, or two blocks with an alley between them that no mesh shows. Zhu 2018 models it
//! as one building. Here a step in the roof is taken for a party wall where it can be one: roofs that meet along a ridge, a
//! hip or a valley stay together, and so do the parts that no house could be, such as a lift head on a flat roof or the
//! strips of a saw-tooth hall. Houses of one height under one roof cannot be told apart.

use crate::partition::{Partition, Region};
use gable_geometry::{DVec2, DisjointSets, Plane};
use std::collections::BTreeMap;

/// Roofs belong together if they meet along at least this share of their common border.
const MEETS: f64 = 0.4;

/// What meets along less than this, against the square root of the smaller roof's area, is joined by a neck: by a crown
/// between two houses, or by an archway.
const NECK: f64 = 0.5;

/// A smaller part is an annexe of its neighbour, m².
const SMALLEST: f64 = 30.0;

/// A house is bounded by open air along at least this share of its outline.
const OUTSIDE: f64 = 0.1;

/// The longest party wall, against the square root of the smaller house's area: a house is at most five times as deep
/// as it is wide.
const LONGEST: f64 = 2.3;

/// The regions of each building, in the order of their first region. Roofs whose heights differ by less than `step`
/// metres meet. O(regions · borders · log).
pub(crate) fn buildings(partition: &Partition, planes: &[Plane], step: f64) -> Vec<Vec<Region>> {
    let borders = Borders::of(partition, planes, step);
    let areas = partition.areas();
    let mut sets = DisjointSets::new(partition.regions);
    while let Some((a, b)) = Parts::of(&borders, &areas, &mut sets).that_belong() {
        sets.join(a, b);
    }
    with_specks(partition, &areas, sets.sets())
}

/// Gives parts that touch nothing and are too small for a building to the nearest one that is not; if all are small, they
/// are one building together.
fn with_specks(partition: &Partition, areas: &[f64], parts: Vec<Vec<Region>>) -> Vec<Vec<Region>> {
    let area = |regions: &Vec<Region>| regions.iter().map(|&r| areas[r]).sum::<f64>();
    let (mut large, specks): (Vec<Vec<Region>>, Vec<_>) = parts.into_iter().partition(|p| area(p) >= SMALLEST);
    if large.is_empty() {
        return vec![(0..partition.regions).collect()];
    }
    let corners = |regions: &Vec<Region>| -> Vec<DVec2> {
        let own = partition.edges.iter().filter(|e| regions.contains(&e.region));
        own.map(|e| partition.vertices[e.from as usize]).collect()
    };
    let places: Vec<Vec<DVec2>> = large.iter().map(corners).collect();
    for speck in specks {
        let ends = corners(&speck);
        let distance = |place: &Vec<DVec2>| {
            let squared = |a: &DVec2| ends.iter().map(|b| a.distance_squared(*b)).fold(f64::INFINITY, f64::min);
            place.iter().map(squared).fold(f64::INFINITY, f64::min)
        };
        let nearest = (0..places.len()).min_by(|&i, &j| distance(&places[i]).total_cmp(&distance(&places[j])));
        large[nearest.unwrap_or(0)].extend(speck);
    }
    large.iter_mut().for_each(|regions| regions.sort_unstable());
    large.sort();
    large
}

/// A border between two regions, metres.
#[derive(Clone, Copy, Default)]
struct Border {
    length: f64,
    /// Of that, where the roofs meet.
    meeting: f64,
}

struct Borders {
    /// By the smaller and the larger region.
    between: BTreeMap<(Region, Region), Border>,
    /// Length of each region's border with the ground.
    outside: Vec<f64>,
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

/// A part of what hangs together, metres and m².
#[derive(Clone, Copy, Default)]
struct Part {
    area: f64,
    outside: f64,
    inside: f64,
}

impl Part {
    fn can_be_a_building(&self) -> bool {
        self.area >= SMALLEST && self.outside >= OUTSIDE * (self.outside + self.inside)
    }
}

/// The parts that have been joined so far, each by one of its regions.
struct Parts {
    parts: BTreeMap<Region, Part>,
    between: BTreeMap<(Region, Region), Border>,
}

impl Parts {
    fn of(borders: &Borders, areas: &[f64], sets: &mut DisjointSets) -> Self {
        let mut parts: BTreeMap<Region, Part> = BTreeMap::new();
        for (region, &area) in areas.iter().enumerate() {
            let part = parts.entry(sets.find(region)).or_default();
            part.area += area;
            part.outside += borders.outside[region];
        }
        let mut between: BTreeMap<(Region, Region), Border> = BTreeMap::new();
        for (&(a, b), border) in &borders.between {
            let (a, b) = (sets.find(a), sets.find(b));
            if a != b {
                let sum = between.entry((a.min(b), a.max(b))).or_default();
                sum.length += border.length;
                sum.meeting += border.meeting;
                for part in [a, b] {
                    parts.entry(part).or_default().inside += border.length;
                }
            }
        }
        Self { parts, between }
    }

    /// The two parts that most need to be joined; `None` if each can be a building. First come those whose roofs meet
    /// along most of their width, then the smallest part that can be no building with the neighbour along most of its
    /// border, then the border that is longest for a party wall.
    fn that_belong(&self) -> Option<(Region, Region)> {
        let width = |(a, b): &(Region, Region)| self.parts[a].area.min(self.parts[b].area).sqrt();
        let most = |measure: &dyn Fn(&(Region, Region), &Border) -> f64| {
            let measured = self.between.iter().map(|(pair, border)| (*pair, measure(pair, border)));
            measured.max_by(|s, t| s.1.total_cmp(&t.1).then(t.0.cmp(&s.0)))
        };
        let meeting = |pair: &(Region, Region), border: &Border| {
            if border.meeting >= MEETS * border.length { border.meeting / width(pair) } else { 0.0 }
        };
        if let Some((pair, _)) = most(&meeting).filter(|m| m.1 >= NECK) {
            return Some(pair);
        }
        let annexe = self
            .parts
            .iter()
            .filter(|(_, p)| p.inside > 0.0 && !p.can_be_a_building())
            .min_by(|a, b| a.1.area.total_cmp(&b.1.area).then(a.0.cmp(b.0)));
        if let Some((&annexe, _)) = annexe {
            let own = |(a, b): &(Region, Region)| *a == annexe || *b == annexe;
            return most(&|pair, border| if own(pair) { border.length } else { -1.0 }).map(|(pair, _)| pair);
        }
        most(&|pair, border| border.length / width(pair)).filter(|m| m.1 > LONGEST).map(|(pair, _)| pair)
    }
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
