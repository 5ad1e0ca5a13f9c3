//! Bridges: closed in by steps up on two sides, as buildings are, and yet no building.
//!
//! A deck is long, smooth, and goes over into the ground without a step at both of its ends, or at one if the scene ends at the other; no
//! roof does.

use super::cells::{Cells, Side};
use super::enclosure::STEP;

/// Relief of a cell of a deck, metres; railings and crowns have more.
const SMOOTH: f32 = 1.1;

/// Least length, metres, and least ratio of length to width.
const LONG: f64 = 16.0;
const SLENDER: f64 = 2.5;

/// Share of the length at either end in which it has to go over into ground.
const END: f64 = 0.2;

/// Share of the width over which it does so.
const OPEN: f64 = 0.3;

/// Least length of what the rim of the scene cuts off, metres.
const LONG_AT_RIM: f64 = 40.0;

/// Difference to the ground beside it that is no step, metres.
const LEVEL: f32 = 0.6;

/// Makes bridges ground. O(cells).
pub(super) fn join(cells: &Cells, objects: &[bool], ground: &mut [bool]) {
    let smooth: Vec<bool> =
        objects.iter().zip(&cells.relief).map(|(object, relief)| *object && *relief < SMOOTH).collect();
    let parts = cells.surfaces(&smooth, STEP);
    let mut members = vec![Vec::new(); parts.sizes.len()];
    for (i, number) in parts.number.iter().enumerate() {
        if let Some(n) = number {
            members[*n as usize].push(i);
        }
    }
    let before = ground.to_vec();
    for part in members.iter().filter(|part| is_bridge(cells, part, &before)) {
        for &i in part {
            ground[i] = true;
        }
    }
}

fn is_bridge(cells: &Cells, part: &[usize], ground: &[bool]) -> bool {
    let step = cells.window.step;
    let area = cells.area(part.len());
    if area < LONG * LONG / 16.0 {
        return false;
    }
    let along = positions_along(cells, part);
    let (first, last) = along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
    let length = last - first + step;
    let width = area / length;
    if length < LONG || length < SLENDER * width {
        return false;
    }
    // At either end: cells beside level ground, and at the rim.
    let mut level = [0_usize; 2];
    let mut rim = [0_usize; 2];
    for (&i, position) in part.iter().zip(&along) {
        let at_end = [position - first <= END * length, last - position <= END * length];
        for end in (0..2).filter(|&end| at_end[end]) {
            level[end] += usize::from(Side::ALL.into_iter().any(|side| goes_over(cells, i, side, ground)));
            rim[end] += usize::from(Side::ALL.into_iter().any(|side| cells.beside(i, side).is_none()));
        }
    }
    let enough = |count: usize| count as f64 * step >= OPEN * width;
    let is_cut = |end: usize| length >= LONG_AT_RIM && enough(rim[end]) && enough(level[1 - end]);
    (enough(level[0]) && enough(level[1])) || is_cut(0) || is_cut(1)
}

fn goes_over(cells: &Cells, i: usize, side: Side, ground: &[bool]) -> bool {
    cells.beside(i, side).is_some_and(|(j, rise)| {
        ground[j] && rise.abs() < 0.5 * STEP && (cells.middle[j] - cells.middle[i]).abs() < LEVEL
    })
}

/// Where each cell lies along the longer axis of the part, metres.
fn positions_along(cells: &Cells, part: &[usize]) -> Vec<f64> {
    let step = cells.window.step;
    let place = |i: usize| [(i % cells.window.width) as f64 * step, (i / cells.window.width) as f64 * step];
    let count = part.len() as f64;
    let mut mean = [0.0; 2];
    for &i in part {
        let [x, y] = place(i);
        mean = [mean[0] + x / count, mean[1] + y / count];
    }
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for &i in part {
        let [x, y] = place(i);
        let (dx, dy) = (x - mean[0], y - mean[1]);
        (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
    }
    let turn = 0.5 * (2.0 * xy).atan2(xx - yy);
    part.iter().map(|&i| place(i)).map(|[x, y]| (x - mean[0]) * turn.cos() + (y - mean[1]) * turn.sin()).collect()
}
