//! Eaves of one height.
//!
//! The eaves of a house are nearly always level with each other, and the hips then run into the corners of the walls. A
//! plane is known to a few centimetres, a wall to one or two decimetres, so that eaves which ought to be equal come out
//! at heights that differ by the wall's error times the slope. Here the walls give way, not the planes.

use crate::creases::borders;
use crate::surface::NONE;
use gable_geometry::{DVec2, Plane};
use gable_lines::LineSegment;
use gable_raster::Raster;
use std::collections::{BTreeMap, BTreeSet};

/// Eaves whose heights differ by less than this become equal, metres.
const TOLERANCE: f64 = 0.3;

/// No wall moves farther than this, metres.
const FARTHEST: f64 = 0.35;

/// An eave runs across the slope to within this angle, radians (6°).
const ACROSS: f64 = 0.1;

/// Gentler slopes have no eave that could be told by its height (tangent).
const GENTLEST: f64 = 0.15;

/// A wall that carries an eave.
struct Eave {
    wall: usize,
    plane: u16,
    height: f64,
    length: f64,
    slope: f64,
}

/// Moves walls (metres, the roof to their left) across themselves so that the eaves of planes that touch each other in
/// the labelling become level with each other, the most nearly equal first. O(walls · pixels along them),
/// and O(pairs · log) for pairs of eaves of planes that touch.
pub(crate) fn level(walls: &mut [LineSegment], surface: &Raster<u16>, planes: &[Plane]) {
    let eaves: Vec<Eave> = (0..walls.len()).filter_map(|w| eave(w, &walls[w], surface, planes)).collect();
    let mut on_plane: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
    for (k, eave) in eaves.iter().enumerate() {
        on_plane.entry(eave.plane).or_default().push(k);
    }
    let on = |plane: u16| on_plane.get(&plane).map_or(&[][..], Vec::as_slice);
    let mut pairs = Vec::new();
    let mut add = |i: usize, j: usize| {
        let apart = (eaves[i].height - eaves[j].height).abs();
        if apart < TOLERANCE {
            pairs.push((apart, i.min(j), i.max(j)));
        }
    };
    for own in on_plane.values() {
        own.iter().enumerate().for_each(|(n, &i)| own[n + 1..].iter().for_each(|&j| add(i, j)));
    }
    for [p, q] in borders(surface).into_keys() {
        on(p).iter().for_each(|&i| on(q).iter().for_each(|&j| add(i, j)));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mean = |members: &[usize]| {
        let (sum, length) =
            members.iter().fold((0.0, 0.0), |(s, l), &k| (s + eaves[k].height * eaves[k].length, l + eaves[k].length));
        sum / length
    };
    // The eaves of each set, ascending, under the smallest; and the set of each eave.
    let mut sets: Vec<Vec<usize>> = (0..eaves.len()).map(|k| vec![k]).collect();
    let mut set: Vec<usize> = (0..eaves.len()).collect();
    // Sets that did not fit together, with their sizes: they do not as long as neither grows.
    let mut refused: BTreeSet<[(usize, usize); 2]> = BTreeSet::new();
    for (_, i, j) in pairs {
        let (p, q) = (set[i].min(set[j]), set[i].max(set[j]));
        let both = [(p, sets[p].len()), (q, sets[q].len())];
        if p == q || refused.contains(&both) {
            continue;
        }
        let mut members = [sets[p].as_slice(), &sets[q]].concat();
        members.sort_unstable();
        let height = mean(&members);
        let moves = |k: usize| (height - eaves[k].height).abs();
        if members.iter().all(|&k| moves(k) < 0.5 * TOLERANCE && moves(k) < FARTHEST * eaves[k].slope) {
            members.iter().for_each(|&k| set[k] = p);
            sets[q].clear();
            sets[p] = members;
        } else {
            refused.insert(both);
        }
    }
    for members in sets.into_iter().filter(|members| !members.is_empty()) {
        let height = mean(&members);
        for eave in members.iter().map(|&k| &eaves[k]) {
            let wall = &mut walls[eave.wall];
            let left = wall.vector().normalize_or_zero().perp() * ((height - eave.height) / eave.slope);
            wall.a += left;
            wall.b += left;
        }
    }
}

/// The eave on a wall: the plane above most of it, if that falls towards the wall and nothing but the ground is beyond.
fn eave(wall: usize, segment: &LineSegment, surface: &Raster<u16>, planes: &[Plane]) -> Option<Eave> {
    let along = segment.vector();
    let left = along.try_normalize()?.perp();
    let pixel = surface.window().step;
    let count = ((along.length() / pixel) as usize).max(2);
    let mut seen: BTreeMap<u16, usize> = Default::default();
    for i in 0..count {
        let at = segment.a + along * ((i as f64 + 0.5) / count as f64);
        let label = |side: f64| surface.at(at + left * side * 0.6).copied().unwrap_or(NONE);
        if label(1.0) != NONE && label(-1.0) == NONE {
            *seen.entry(label(1.0)).or_default() += 1;
        }
    }
    let (&plane, &most) = seen.iter().rev().max_by_key(|(_, n)| **n)?;
    let gradient = DVec2::new(planes[plane as usize].a, planes[plane as usize].b);
    let slope = gradient.length();
    let upward = slope > GENTLEST && gradient.dot(left) > slope * ACROSS.cos();
    (2 * most > count && upward).then(|| Eave {
        wall,
        plane,
        height: planes[plane as usize].height(segment.middle()),
        length: along.length(),
        slope,
    })
}
