//! How regular buildings are: axes, equal directions, exact planes, no crumbs.

use crate::statistics::ratio;
use gable_city_model::{Building, CityModel, Semantic, Shell};
use gable_geometry::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

/// A wall is aligned up to this angle, degrees.
const ALIGNED_DEG: f64 = 1.0;
/// Normals that differ by more are distinct, degrees.
const DISTINCT_DEG: f64 = 0.1;
/// Faces up to this angle and distance from each other are meant to be one plane, degrees and metres …
const NEAR_DEG: f64 = 2.0;
const NEAR: f64 = 0.1;
/// … and are exactly one if no corner is farther from the other's plane than this, metres.
const EXACT: f64 = 0.001;
/// Edges and faces smaller than these are crumbs, metres and m².
const SHORT: f64 = 0.3;
const SMALL: f64 = 0.5;

/// Regularity of LOD2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Regularity {
    /// Share of wall length, in plan, within 1° of the building's main axes: the two orthogonal directions that most of
    /// its wall length follows.
    pub aligned_walls: f64,
    /// Directions of faces that differ by more than 0.1°, for each building.
    pub distinct_normals: f64,
    /// Of the pairs of faces of a building that are nearly one plane (2°, 10 cm), the share that is one to 1 mm.
    pub exactly_coplanar: f64,
    /// Share of edges under 0.3 m.
    pub short_edges: f64,
    /// Share of faces under 0.5 m².
    pub small_faces: f64,
}

/// Sums over one building.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    walls: f64,
    aligned: f64,
    normals: usize,
    near_pairs: usize,
    exact_pairs: usize,
    edges: usize,
    short: usize,
    faces: usize,
    small: usize,
}

pub(crate) fn regularity(model: &CityModel) -> Regularity {
    let each: Vec<Sums> = model.buildings.par_iter().filter(|b| !b.lods.lod2.is_empty()).map(sums).collect();
    let float = |part: fn(&Sums) -> f64| each.iter().map(part).sum::<f64>();
    let count = |part: fn(&Sums) -> usize| each.iter().map(part).sum::<usize>() as f64;
    let near = count(|s| s.near_pairs);
    Regularity {
        aligned_walls: ratio(float(|s| s.aligned), float(|s| s.walls)),
        distinct_normals: ratio(count(|s| s.normals), each.len() as f64),
        exactly_coplanar: if near > 0.0 { count(|s| s.exact_pairs) / near } else { 1.0 },
        short_edges: ratio(count(|s| s.short), count(|s| s.edges)),
        small_faces: ratio(count(|s| s.small), count(|s| s.faces)),
    }
}

/// A face with what is asked of it.
struct Side {
    semantic: Semantic,
    normal: DVec3,
    area: f64,
    corners: Vec<DVec3>,
}

fn sums(building: &Building) -> Sums {
    let mut sides = Vec::new();
    let mut edges = BTreeSet::new();
    for shell in building.lods.lod2.iter().filter(|s| s.is_well_formed()) {
        collect(shell, &mut sides, &mut edges);
    }
    let mut out = Sums { edges: edges.len(), faces: sides.len(), ..Sums::default() };
    out.short = edges.iter().filter(|[p, q]| length(*p, *q) < SHORT).count();
    out.small = sides.iter().filter(|s| s.area < SMALL).count();
    out.normals = distinct(&sides);
    (out.near_pairs, out.exact_pairs) = coplanar(&sides);
    (out.walls, out.aligned) = aligned(&walls(&sides));
    out
}

type Key = [i64; 3];

fn length(p: Key, q: Key) -> f64 {
    (0..3).map(|k| ((p[k] - q[k]) as f64 * 1e-4).powi(2)).sum::<f64>().sqrt()
}

fn collect(shell: &Shell, sides: &mut Vec<Side>, edges: &mut BTreeSet<[Key; 2]>) {
    for face in &shell.faces {
        let vector = shell.vector_area(face);
        let corners: Vec<DVec3> = face.rings.iter().flatten().map(|&i| shell.vertices[i as usize]).collect();
        for ring in &face.rings {
            for k in 0..ring.len() {
                let key = |i: u32| shell.vertices[i as usize].to_array().map(|v| (v * 1e4).round() as i64);
                let (p, q) = (key(ring[k]), key(ring[(k + 1) % ring.len()]));
                edges.insert([p.min(q), p.max(q)]);
            }
        }
        let normal = vector.normalize_or_zero();
        sides.push(Side { semantic: face.semantic, normal, area: vector.length(), corners });
    }
}

fn distinct(sides: &[Side]) -> usize {
    // Sine of the angle: the cosine of a small angle has no digits left.
    let limit = DISTINCT_DEG.to_radians().sin();
    let mut found: Vec<DVec3> = Vec::new();
    for side in sides.iter().filter(|s| s.normal != DVec3::ZERO) {
        let same = |n: &DVec3| n.dot(side.normal) > 0.0 && n.cross(side.normal).length() <= limit;
        if !found.iter().any(same) {
            found.push(side.normal);
        }
    }
    found.len()
}

fn coplanar(sides: &[Side]) -> (usize, usize) {
    let limit = NEAR_DEG.to_radians().sin();
    let sides: Vec<&Side> = sides.iter().filter(|s| s.semantic != Semantic::GroundSurface && s.area >= SMALL).collect();
    let (mut near, mut exact) = (0, 0);
    for (k, a) in sides.iter().enumerate() {
        for b in &sides[k + 1..] {
            if a.normal.dot(b.normal) <= 0.0 || a.normal.cross(b.normal).length() > limit {
                continue;
            }
            let off = |n: DVec3, origin: DVec3, corners: &[DVec3]| {
                corners.iter().map(|c| n.dot(*c - origin).abs()).fold(0.0, f64::max)
            };
            let distance = off(a.normal, a.corners[0], &b.corners).max(off(b.normal, b.corners[0], &a.corners));
            near += usize::from(distance <= NEAR);
            exact += usize::from(distance <= EXACT);
        }
    }
    (near, exact)
}

/// Direction (radians, modulo a right angle) and length in plan of the vertical walls.
fn walls(sides: &[Side]) -> Vec<(f64, f64)> {
    let vertical = sides.iter().filter(|s| s.semantic == Semantic::WallSurface && s.normal.z.abs() < 0.1);
    let wall = |s: &Side| {
        let along = s.normal.truncate().perp().normalize_or_zero();
        let places = s.corners.iter().map(|c| c.truncate().dot(along));
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        (along.y.atan2(along.x).rem_euclid(FRAC_PI_2), high - low)
    };
    vertical.map(wall).collect()
}

/// All wall length, and how much of it follows the axes that most of it follows.
fn aligned(walls: &[(f64, f64)]) -> (f64, f64) {
    let limit = ALIGNED_DEG.to_radians();
    let apart = |a: f64, b: f64| {
        let d = (a - b).rem_euclid(FRAC_PI_2);
        if d > 0.5 * FRAC_PI_2 { d - FRAC_PI_2 } else { d }
    };
    let following = |axis: f64| walls.iter().filter(move |w| apart(w.0, axis).abs() <= limit + 1e-9);
    let total = |axis: f64| following(axis).map(|w| w.1).sum::<f64>();
    let mut best = 0.0_f64;
    for &(axis, _) in walls {
        let here = total(axis);
        let mean = axis + ratio(following(axis).map(|w| w.1 * apart(w.0, axis)).sum(), here);
        best = best.max(here).max(total(mean));
    }
    (walls.iter().map(|w| w.1).sum(), best)
}
