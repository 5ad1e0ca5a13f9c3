//! Roof planes, and which plane of the truth stands for which of the result.

use crate::city::{City, Object, groups};
use crate::statistics::ratio;
use gable_geometry::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Neighbouring faces are one plane up to this angle, degrees …
const SAME_ANGLE_DEG: f64 = 1.0;
/// … and up to this distance of the one's centre from the other's plane, metres.
const SAME_OFFSET: f64 = 0.05;
/// Planes with less area in plan are not counted, m².
const LEAST_AREA: f64 = 1.0;
/// Two planes are partners if they share at least this much of the smaller one, seen from above.
const SHARED: f64 = 0.5;

/// A roof plane: roof faces of one building that share edges and lie in one plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoofPlane {
    /// Building that it belongs to.
    pub(crate) object: usize,
    /// Unit normal.
    pub(crate) normal: DVec3,
    /// Area in plan, m².
    pub(crate) plan_area: f64,
}

/// All roof planes of a city.
#[derive(Debug, Default)]
pub(crate) struct RoofPlanes {
    pub(crate) planes: Vec<RoofPlane>,
    /// For each object, the plane of each of its facets ([`crate::height_raster::NONE`] for walls and ground).
    pub(crate) of_facet: Vec<Vec<u32>>,
}

impl RoofPlanes {
    pub(crate) fn new(city: &City<'_>) -> Self {
        let parts: Vec<(Vec<RoofPlane>, Vec<u32>)> = city.objects.par_iter().enumerate().map(object_planes).collect();
        let mut out = Self::default();
        for (planes, mut of_facet) in parts {
            let first = out.planes.len() as u32;
            of_facet.iter_mut().filter(|p| **p != crate::height_raster::NONE).for_each(|p| *p += first);
            out.planes.extend(planes);
            out.of_facet.push(of_facet);
        }
        out
    }
}

fn object_planes((index, object): (usize, &Object<'_>)) -> (Vec<RoofPlane>, Vec<u32>) {
    let mut face_of: BTreeMap<u32, usize> = BTreeMap::new();
    // Twice the vector area of each face, and the sum of centres weighted by area.
    let mut faces: Vec<(DVec3, DVec3, f64)> = Vec::new();
    let mut edges: BTreeMap<[[i64; 3]; 2], usize> = BTreeMap::new();
    let mut links = Vec::new();
    for facet in object.roof() {
        let face = *face_of.entry(facet.face).or_insert_with(|| {
            faces.push((DVec3::ZERO, DVec3::ZERO, 0.0));
            faces.len() - 1
        });
        let [a, b, c] = facet.corners;
        let cross = (b - a).cross(c - a);
        let sums = &mut faces[face];
        sums.0 += cross;
        sums.1 += cross.length() * (a + b + c) / 3.0;
        sums.2 += cross.length();
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let key = |p: DVec3| [p.x, p.y, p.z].map(|v| (v * 1000.0).round() as i64);
            let (p, q) = (key(p), key(q));
            let other = *edges.entry([p.min(q), p.max(q)]).or_insert(face);
            if other != face {
                links.push((other, face));
            }
        }
    }
    let plane = |f: usize| (faces[f].0.normalize_or_zero(), faces[f].1 / faces[f].2.max(f64::MIN_POSITIVE));
    links.retain(|&(f, g)| {
        let ((n, p), (m, q)) = (plane(f), plane(g));
        n.dot(m) >= SAME_ANGLE_DEG.to_radians().cos()
            && n.dot(q - p).abs() <= SAME_OFFSET
            && m.dot(q - p).abs() <= SAME_OFFSET
    });
    let groups = groups(faces.len(), links);
    let mut plane_of = vec![0; faces.len()];
    let mut planes = Vec::new();
    for group in groups {
        let sum: DVec3 = group.iter().map(|&f| faces[f].0).sum();
        group.iter().for_each(|&f| plane_of[f] = planes.len() as u32);
        planes.push(RoofPlane { object: index, normal: sum.normalize_or_zero(), plan_area: 0.5 * sum.z.abs() });
    }
    let of_facet = object.facets.iter().map(|facet| {
        let is_roof = facet.semantic == gable_city_model::Semantic::RoofSurface;
        if is_roof { plane_of[face_of[&facet.face]] } else { crate::height_raster::NONE }
    });
    (planes, of_facet.collect())
}

/// How roof planes of the truth are represented. Planes are partners if, seen from above, they share at least half of the
/// smaller one; planes of which less than 1 m² is seen are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaneMatches {
    /// Planes of the truth.
    pub truth: usize,
    /// Planes of the result that lie over roofs of the truth.
    pub result: usize,
    /// Planes of the truth with one partner that has no other.
    pub one_to_one: usize,
    /// Planes of the truth that several of the result stand for.
    pub one_to_many: usize,
    /// Planes of the truth that share one plane of the result.
    pub many_to_one: usize,
    /// Planes of the truth in other groups.
    pub many_to_many: usize,
    /// Planes of the truth without a partner.
    pub missed: usize,
    /// Planes of the result without a partner.
    pub invented: usize,
    /// Share of the truth's roof area, in plan, whose planes are matched one to one.
    pub one_to_one_area: f64,
}

/// Which planes are large enough to count, with the area that is seen, and which of them are partners.
pub(crate) struct Partners {
    truth: BTreeMap<u32, f64>,
    result: BTreeMap<u32, f64>,
    /// Pairs (truth, result).
    pub(crate) pairs: BTreeSet<(u32, u32)>,
}

/// Planes are those of truth and result; `seen` is the area of the truth's planes that is not under another roof and
/// `shared` the area that pairs of planes (truth, result) share, in plan, m².
pub(crate) fn partners(
    [truth, result]: [&RoofPlanes; 2],
    seen: &BTreeMap<u32, f64>,
    shared: &BTreeMap<(u32, u32), f64>,
) -> Partners {
    let large = |planes: &RoofPlanes, p: u32, seen: f64| {
        seen >= LEAST_AREA && planes.planes[p as usize].plan_area >= LEAST_AREA
    };
    let ours: BTreeMap<u32, f64> = seen.iter().map(|(&p, &a)| (p, a)).filter(|&(p, a)| large(truth, p, a)).collect();
    let mut theirs: BTreeMap<u32, f64> = BTreeMap::new();
    for (&(_, r), area) in shared {
        *theirs.entry(r).or_default() += area;
    }
    theirs.retain(|&r, &mut area| large(result, r, area));
    let pairs = shared.iter().filter_map(|(&(t, r), &area)| {
        let smaller = ours.get(&t)?.min(result.planes[r as usize].plan_area);
        (theirs.contains_key(&r) && area >= SHARED * smaller).then_some((t, r))
    });
    Partners { pairs: pairs.collect(), truth: ours, result: theirs }
}

/// How the planes of the truth are represented.
pub(crate) fn match_planes([truth, result]: [&RoofPlanes; 2], partners: &Partners) -> PlaneMatches {
    let n = truth.planes.len();
    let Partners { truth: ours, result: theirs, pairs } = partners;
    let links = pairs.iter().map(|&(t, r)| (t as usize, n + r as usize));
    let mut out = PlaneMatches { truth: ours.len(), result: theirs.len(), ..PlaneMatches::default() };
    let mut single = 0.0;
    for group in groups(n + result.planes.len(), links) {
        let of_truth: Vec<f64> =
            group.iter().filter(|&&i| i < n).filter_map(|&i| ours.get(&(i as u32))).copied().collect();
        let t = of_truth.len();
        let r = group.iter().filter(|&&i| i >= n && theirs.contains_key(&((i - n) as u32))).count();
        match (t, r) {
            (0, _) => out.invented += r,
            (_, 0) => out.missed += t,
            (1, 1) => {
                out.one_to_one += 1;
                single += of_truth[0];
            }
            (1, _) => out.one_to_many += 1,
            (_, 1) => out.many_to_one += t,
            _ => out.many_to_many += t,
        }
    }
    out.one_to_one_area = ratio(single, ours.values().sum());
    out
}
