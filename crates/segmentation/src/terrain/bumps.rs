//! Small things that stand on the ground and are too low to be told from it cell by cell (cars, shrubs, piles), and spikes of the mesh
//! below it.

use super::cells::{Cells, Side};
use gable_raster::{box_max, box_mean, box_min, fill_missing};

/// Half the side of the window that a bump does not fill, metres: what is narrower than the window is looked at.
const NARROW: f64 = 4.0;

/// Half the side of the windows over which the lie of the land is taken, metres.
const LAND: f64 = 15.0;

/// Height of a bump over what is left when it is shaved off, metres.
const HIGH: f32 = 0.2;

/// Area up to which it is a thing on the ground and no dam, and up to which a dent is a spike of the mesh and no ramp, m².
const BUMP_AREA: f64 = 80.0;
const DENT_AREA: f64 = 16.0;

/// Share of its border with ground from which it has to fall, and by how much, metres.
const FALLING: f64 = 0.8;
const FALL: f32 = 0.05;

/// Sweeps of the continuation under objects.
const SWEEPS: usize = 10;

/// Takes the heights of bumps and dents out of those of the ground, NaN where there is none. O(cells).
pub(super) fn leave_out(cells: &Cells, heights: &mut [f32]) {
    let (width, height) = (cells.window.width, cells.window.height);
    let mut land = heights.to_vec();
    fill_missing(&mut land, width, height, SWEEPS);
    for _ in 0..2 {
        land = box_mean(&land, width, height, cells_in(LAND, cells));
    }
    // Over the lie of the land, so that a hillside has no bumps.
    let over: Vec<f32> = heights.iter().zip(&land).map(|(z, land)| z - land).collect();
    let under: Vec<f32> = over.iter().map(|over| -over).collect();
    for speck in [bumps(cells, &over, BUMP_AREA), bumps(cells, &under, DENT_AREA)] {
        for (z, _) in heights.iter_mut().zip(speck).filter(|(_, speck)| *speck) {
            *z = f32::NAN;
        }
    }
}

/// What an opening by a square shaves off, if it is small and falls on nearly all sides.
fn bumps(cells: &Cells, over: &[f32], most: f64) -> Vec<bool> {
    let shaved = opening(over, cells.window.width, cells.window.height, cells_in(NARROW, cells));
    let stands_over: Vec<bool> = over.iter().zip(&shaved).map(|(over, shaved)| over - shaved > HIGH).collect();
    let parts = cells.surfaces(&stands_over, f32::INFINITY);
    let mut border = vec![0_usize; parts.sizes.len()];
    let mut falling = vec![0_usize; parts.sizes.len()];
    for (i, number) in parts.number.iter().enumerate() {
        let Some(n) = number.map(|n| n as usize) else { continue };
        for (j, _) in Side::ALL.into_iter().filter_map(|side| cells.beside(i, side)) {
            if parts.number[j] != *number && !over[j].is_nan() {
                border[n] += 1;
                falling[n] += usize::from(over[i] - over[j] >= FALL);
            }
        }
    }
    let is_bump = |n: usize| cells.area(parts.sizes[n]) <= most && falling[n] as f64 >= FALLING * border[n] as f64;
    parts.number.iter().map(|number| number.is_some_and(|n| is_bump(n as usize))).collect()
}

fn cells_in(metres: f64, cells: &Cells) -> usize {
    (metres / cells.window.step).round().max(1.0) as usize
}

/// The highest of the lowest over squares that hold a cell; what has no height counts for nothing.
fn opening(values: &[f32], width: usize, height: usize, radius: usize) -> Vec<f32> {
    let or_infinite = |value: f32| if value.is_nan() { f32::INFINITY } else { value };
    let lowest = box_min(&values.iter().map(|v| or_infinite(*v)).collect::<Vec<_>>(), width, height, radius);
    let or_lowest = |value: f32| if value == f32::INFINITY { f32::NEG_INFINITY } else { value };
    box_max(&lowest.into_iter().map(or_lowest).collect::<Vec<_>>(), width, height, radius)
}
