//! Streets between a quay and a row of houses, and banks between two waters: closed in by steps up, and cut off from other ground.
//!
//! A strip lies level with the ground beyond the houses or the water; a roof stands over it. Where a strip goes over into ground or reaches the rim of
//! the scene, a part of it that sees that ground is enough.

use super::cells::{Cells, Side, Surfaces};
use super::enclosure::STEP;
use super::land::Land;

/// Relief of a cell of a strip, metres.
const SMOOTH: f32 = 0.8;

/// How far one looks across the houses, metres.
const REACH: f64 = 40.0;

/// Difference to the ground there that counts as level, metres, when the slope of the land is taken off.
const LEVEL: f32 = 0.7;

/// Slope of the land up to which a place may be level all the same.
const GENTLE: f32 = 0.12;

/// Share of a strip from which level ground has to be seen, if it goes over into ground, and if trees cut it off on all sides.
const SEEING: f64 = 0.4;
const SEEING_CUT_OFF: f64 = 0.85;

/// Area from which a strip may be a bank between two waters, m².
const BANK: f64 = 300.0;

/// Cells that have to go over into ground.
const CONTACTS: usize = 2;

/// Rounds: what joins the ground may be what the next piece goes over into.
const ROUNDS: usize = 4;

/// Makes strips ground. O(cells · reach).
pub(super) fn join(cells: &Cells, land: &Land, objects: &[bool], ground: &mut [bool]) {
    let smooth: Vec<bool> = (0..objects.len()).map(|i| objects[i] && !ground[i] && cells.relief[i] < SMOOTH).collect();
    let parts = cells.surfaces(&smooth, STEP);
    let mut beyond_objects = vec![0_usize; parts.sizes.len()];
    let mut beyond_low_ground = vec![0_usize; parts.sizes.len()];
    for (i, number) in parts.number.iter().enumerate() {
        if let Some(n) = number.map(|n| n as usize) {
            beyond_objects[n] += usize::from(sees_level_ground(cells, land, ground, i, Beyond::Objects));
            beyond_low_ground[n] += usize::from(sees_level_ground(cells, land, ground, i, Beyond::LowGround));
        }
    }
    let enough = |seeing: usize, n: usize, share: f64| seeing as f64 >= share * parts.sizes[n] as f64;
    let is_bank =
        |n: usize| cells.area(parts.sizes[n]) >= BANK && enough(beyond_low_ground[n].max(beyond_objects[n]), n, SEEING);
    let mut joined: Vec<bool> = (0..parts.sizes.len()).map(|n| enough(beyond_objects[n], n, SEEING_CUT_OFF)).collect();
    let may_join: Vec<bool> =
        (0..parts.sizes.len()).map(|n| enough(beyond_objects[n], n, SEEING) || is_bank(n)).collect();
    add(&parts, &joined, ground);
    for _ in 0..ROUNDS {
        let mut contacts = vec![0_usize; parts.sizes.len()];
        for (i, number) in parts.number.iter().enumerate() {
            if let Some(n) = number.map(|n| n as usize).filter(|&n| !joined[n] && may_join[n]) {
                contacts[n] += usize::from(Side::ALL.into_iter().any(|side| goes_over(cells, i, side, ground)));
            }
        }
        for (joined, contacts) in joined.iter_mut().zip(contacts) {
            *joined |= contacts >= CONTACTS;
        }
        add(&parts, &joined, ground);
    }
}

fn add(parts: &Surfaces, joined: &[bool], ground: &mut [bool]) {
    for (ground, number) in ground.iter_mut().zip(&parts.number) {
        *ground |= number.is_some_and(|n| joined[n as usize]);
    }
}

/// Whether the cell on a side is ground without a step, or lies outside of the scene.
fn goes_over(cells: &Cells, i: usize, side: Side, ground: &[bool]) -> bool {
    cells.beside(i, side).is_none_or(|(j, rise)| ground[j] && rise.abs() < 0.5 * STEP)
}

/// What lies between a strip and the ground that it is level with.
#[derive(Clone, Copy, PartialEq)]
enum Beyond {
    Objects,
    LowGround,
}

/// Whether along a row or a column, beyond objects that stand higher or ground that lies lower, ground lies as high as the cell.
fn sees_level_ground(cells: &Cells, land: &Land, ground: &[bool], i: usize, beyond: Beyond) -> bool {
    // Beside a quay the land at large tilts towards the water, and the street does not: then both count.
    let may_be_level = land.slope(i) < GENTLE;
    Side::ALL.into_iter().any(|side| {
        let [dx, dy] = side.direction();
        let [sx, sy] = land.gradient[i];
        let most = (REACH / cells.window.step) as usize;
        let mut at = i;
        let mut has_crossed = false;
        for distance in 1..=most {
            let Some((next, _)) = cells.beside(at, side) else { return false };
            at = next;
            let metres = distance as f32 * cells.window.step as f32;
            let rise = cells.middle[at] - cells.middle[i];
            let tilted = rise - (sx * dx + sy * dy) * metres;
            if ground[at] && (tilted.abs() < LEVEL || (may_be_level && rise.abs() < LEVEL)) {
                return has_crossed;
            }
            let is_low_ground = ground[at] && tilted < -STEP;
            if ground[at] && !(is_low_ground && beyond == Beyond::LowGround) {
                return false;
            }
            has_crossed |= is_low_ground || (beyond == Beyond::Objects && tilted > STEP);
        }
        false
    })
}
