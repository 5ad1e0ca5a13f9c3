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

/// How far from a deck another may run, metres, how level with it, metres, and along which share of its length.
const BESIDE: f64 = 6.0;
const LEVEL_WITH_DECK: f32 = 1.5;
const ALONG: f64 = 0.6;

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
    let mut is_deck = vec![false; ground.len()];
    let before = ground.to_vec();
    let (decks, others): (Vec<_>, Vec<_>) = members.iter().partition(|part| is_bridge(cells, part, &before));
    for &i in decks.iter().copied().flatten() {
        is_deck[i] = true;
    }
    let first = is_deck.clone();
    for &i in others.into_iter().filter(|part| runs_beside(cells, part, &first)).flatten() {
        is_deck[i] = true;
    }
    for (ground, is_deck) in ground.iter_mut().zip(is_deck) {
        *ground |= is_deck;
    }
}

/// Whether a part that is as long and slender as a deck runs along one, level with it: the other track of a bridge.
fn runs_beside(cells: &Cells, part: &[usize], decks: &[bool]) -> bool {
    let Some(shape) = Slender::of(cells, part) else { return false };
    let (width, height) = (cells.window.width as i64, cells.window.height as i64);
    let reach = (BESIDE / cells.window.step).round() as i64;
    let is_beside = |i: usize| {
        let (x, y) = (i as i64 % width, i as i64 / width);
        let rows = (y - reach).max(0)..(y + reach + 1).min(height);
        rows.flat_map(|v| ((x - reach).max(0)..(x + reach + 1).min(width)).map(move |u| (v * width + u) as usize))
            .any(|j| decks[j] && (cells.middle[j] - cells.middle[i]).abs() < LEVEL_WITH_DECK)
    };
    let mut beside = vec![false; (shape.length / cells.window.step).ceil() as usize + 1];
    for (&i, position) in part.iter().zip(&shape.along) {
        beside[((position - shape.first) / cells.window.step) as usize] |= is_beside(i);
    }
    beside.iter().filter(|beside| **beside).count() as f64 > ALONG * beside.len() as f64
}

/// A part that is long and slender.
struct Slender {
    /// Position of each of its cells along its longer axis, metres, and the least of them.
    along: Vec<f64>,
    first: f64,
    length: f64,
    width: f64,
}

impl Slender {
    fn of(cells: &Cells, part: &[usize]) -> Option<Self> {
        let step = cells.window.step;
        let along = positions_along(cells, part);
        let (first, last) = along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
        let length = last - first + step;
        let width = cells.area(part.len()) / length;
        (length >= LONG && length >= SLENDER * width).then_some(Self { along, first, length, width })
    }
}

fn is_bridge(cells: &Cells, part: &[usize], ground: &[bool]) -> bool {
    let step = cells.window.step;
    let Some(Slender { along, first, length, width }) = Slender::of(cells, part) else { return false };
    let last = first + length - step;
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
