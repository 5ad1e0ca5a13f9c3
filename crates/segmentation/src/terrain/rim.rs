//! What hangs down at the rim of a mesh.
//!
//! Where a mesh ends, photogrammetry often closes it with stretched faces that fall far below the ground. Taken for ground, they make
//! a building of the whole scene: it is closed in by a step all around.

use super::cells::{Cells, Side};
use super::enclosure::STEP;
use super::land::Land;
use gable_raster::{around, box_min, square};

/// How far from the rim such faces are looked for, metres.
const REACH: f64 = 8.0;

/// Half the side of the window whose median height a place is compared with, metres.
const AROUND: f64 = 10.0;

/// Depth under that median from which a place at the rim hangs, metres, on level land; on a slope as much more as it falls over
/// [`AROUND`].
const DEEP: f32 = 3.0;

/// Relief of a cell that is level, metres, and the area from which a place of such cells is wide, m².
const LEVEL: f32 = 1.0;
const LEVEL_AREA: f64 = 100.0;

/// How far such places are looked for, metres, and how far under them a face hangs at least, metres.
const LEVEL_REACH: f64 = 60.0;
const UNDER: f32 = 1.5;

/// What is left of a face that hangs, further up: its slope (rise over run) within a cell.
const STEEP: f32 = 1.1;

/// By how much a neighbour stands higher than a cell of such a face, metres.
const BELOW_NEIGHBOUR: f32 = 1.0;

/// The cells that hang down at the rim: from the rim inwards, first what lies deep below its surroundings, then the steep faces above
/// that. At most [`REACH`] deep. O(cells · window).
pub(super) fn hanging(cells: &Cells, land: &Land) -> Vec<bool> {
    let step = cells.window.step;
    let rounds = (REACH / step).round().max(1.0) as usize;
    let radius = (AROUND / step).round().max(1.0) as usize;
    let lowest_level = lowest_level_around(cells);
    let mut hanging = vec![false; cells.seen.len()];
    // Cells beside what is not there or hangs, and whether they touch something that hangs.
    let mut front: Vec<usize> = (0..cells.seen.len()).filter(|&i| cells.seen[i] && at_rim(cells, i)).collect();
    for _ in 0..rounds {
        let mut fallen = Vec::new();
        for &i in &front {
            let below_hangs =
                around(i, cells.window.width, cells.window.height).any(|j| hanging[j] && shares_side(cells, i, j));
            if (is_deep(cells, i, radius, DEEP + land.slope(i) * AROUND as f32) && is_under(cells, i, lowest_level[i]))
                || (below_hangs && is_steep(cells, i))
            {
                fallen.push(i);
            }
        }
        if fallen.is_empty() {
            break;
        }
        for &i in &fallen {
            hanging[i] = true;
        }
        let mut next = Vec::new();
        for &i in &fallen {
            for j in around(i, cells.window.width, cells.window.height) {
                if cells.seen[j] && !hanging[j] && shares_side(cells, i, j) {
                    next.push(j);
                }
            }
        }
        next.extend(front.iter().copied().filter(|&i| !hanging[i]));
        next.sort_unstable();
        next.dedup();
        front = next;
    }
    hanging
}

/// The height of the lowest wide level place around each cell; infinite where there is none.
fn lowest_level_around(cells: &Cells) -> Vec<f32> {
    let (width, height) = (cells.window.width, cells.window.height);
    let part: Vec<bool> = cells.seen.iter().zip(&cells.relief).map(|(seen, relief)| *seen && *relief < LEVEL).collect();
    let surfaces = cells.surfaces(&part, STEP);
    let mut heights = vec![f32::INFINITY; part.len()];
    for (i, number) in surfaces.number.iter().enumerate() {
        if number.is_some_and(|n| cells.area(surfaces.sizes[n as usize]) > LEVEL_AREA) {
            heights[i] = cells.middle[i];
        }
    }
    box_min(&heights, width, height, (LEVEL_REACH / cells.window.step) as usize)
}

/// Whether a cell lies under every wide level place around: a court between roofs at the rim is as low as the street elsewhere.
fn is_under(cells: &Cells, i: usize, lowest_level: f32) -> bool {
    cells.middle[i] < lowest_level - UNDER
}

fn at_rim(cells: &Cells, i: usize) -> bool {
    Side::ALL.into_iter().any(|side| cells.beside(i, side).is_none())
}

fn is_deep(cells: &Cells, i: usize, radius: usize, deep: f32) -> bool {
    let mut heights: Vec<f32> = square(i, cells.window.width, cells.window.height, radius)
        .filter(|&j| cells.seen[j])
        .map(|j| cells.middle[j])
        .collect();
    if heights.is_empty() {
        return false;
    }
    let middle = heights.len() / 2;
    *heights.select_nth_unstable_by(middle, f32::total_cmp).1 - cells.middle[i] > deep
}

fn is_steep(cells: &Cells, i: usize) -> bool {
    let highest = around(i, cells.window.width, cells.window.height)
        .filter(|&j| cells.seen[j])
        .map(|j| cells.middle[j])
        .fold(f32::MIN, f32::max);
    cells.relief[i] > STEEP * cells.window.step as f32 && highest - cells.middle[i] > BELOW_NEIGHBOUR
}

fn shares_side(cells: &Cells, i: usize, j: usize) -> bool {
    let distance = i.abs_diff(j);
    distance == 1 || distance == cells.window.width
}
