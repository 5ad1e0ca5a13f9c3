//! What speaks against a place that the cut took for ground.
//!
//! A roof terrace between higher roofs, and a gap between crowns that does not reach the ground, are closed in by steps *down*, as a
//! court is. What lies around the roofs and the crowns tells them apart: there the ground is lower.

use super::cells::Cells;
use super::cut::wall_in_ground;
use super::enclosure::STEP;
use super::land::Land;
use gable_raster::{fill_missing, squared_distance};

/// How far one looks across an object, metres.
const REACH: f64 = 60.0;

/// Difference in height across an object that needs no reason, metres, and slope that needs none (rise over run): on level land, more
/// for each unit of the land's own slope, and at most.
const FREE_ACROSS: f32 = 1.0;
const SLOPE_ACROSS: Allowance = Allowance { level: 0.04, by_slope: 0.6, most: 0.25 };

/// Area from which a place of ground needs no other to agree with it, m². The largest place needs none, however small it is.
const LARGE: f64 = 3000.0;

/// Height of a small place over the continued ground that needs no reason, metres, and slope that needs none.
const FREE_SMALL: Allowance = Allowance { level: 1.2, by_slope: 3.0, most: 2.0 };
const SLOPE_SMALL: Allowance = Allowance { level: 0.05, by_slope: 1.2, most: 1.0 };

/// Weight of what such a place stands higher, against a step of that height.
const SMALL: f32 = 2.0;

/// Sweeps of the continuation.
const SWEEPS: usize = 20;

/// How far the ground may depart from a continuation without a reason: terraced hillsides do, streets do not.
struct Allowance {
    level: f32,
    by_slope: f32,
    most: f32,
}

impl Allowance {
    fn at(&self, slope: f32) -> f32 {
        (self.level + self.by_slope * slope).min(self.most)
    }
}

/// What it costs each cell to be ground, as in [`super::cut`], because ground around it is lower. O(cells).
pub(super) fn against_ground(cells: &Cells, land: &Land, ground: &[bool]) -> Vec<f32> {
    let mut cost = vec![0.0; ground.len()];
    across_objects(cells, land, ground, &mut cost);
    over_continued_ground(cells, land, ground, &mut cost);
    cost
}

/// Along rows and columns: ground that is higher than other ground beyond an object, by more than the slope of the land makes.
fn across_objects(cells: &Cells, land: &Land, ground: &[bool], cost: &mut [f32]) {
    let (width, height) = (cells.window.width, cells.window.height);
    for y in 0..height {
        along(cells, land, ground, 0, (0..width).map(|x| y * width + x), cost);
    }
    for x in 0..width {
        along(cells, land, ground, 1, (0..height).map(|y| y * width + x), cost);
    }
}

/// One row (axis 0) or column (axis 1).
fn along(
    cells: &Cells,
    land: &Land,
    ground: &[bool],
    axis: usize,
    line: impl Iterator<Item = usize>,
    cost: &mut [f32],
) {
    let step = cells.window.step as f32;
    let mut last: Option<(usize, usize)> = None;
    for (at, i) in line.enumerate().filter(|(_, i)| ground[*i]) {
        if let Some((before, j)) = last
            && at - before > 1
            && ((at - before) as f64) * cells.window.step <= REACH
        {
            let distance = (at - before) as f32 * step;
            let slope = 0.5 * (land.gradient[i][axis] + land.gradient[j][axis]);
            let rise = cells.middle[i] - cells.middle[j] - slope * distance;
            let excess = rise.abs() - FREE_ACROSS - SLOPE_ACROSS.at(land.slope(i)) * distance;
            if excess > 0.0 {
                cost[if rise > 0.0 { i } else { j }] += step * wall_in_ground(excess);
            }
        }
        last = Some((at, i));
    }
}

/// Small places of ground that lie high over what the large ones around them continue to.
fn over_continued_ground(cells: &Cells, land: &Land, ground: &[bool], cost: &mut [f32]) {
    let (width, height, step) = (cells.window.width, cells.window.height, cells.window.step as f32);
    let surfaces = cells.surfaces(ground, STEP);
    let Some(&largest) = surfaces.sizes.iter().max() else { return };
    let limit = cells.area(largest).min(LARGE);
    let is_large = |number: &Option<u32>| number.is_some_and(|n| cells.area(surfaces.sizes[n as usize]) >= limit);
    let large: Vec<bool> = surfaces.number.iter().map(is_large).collect();
    let continued = continued(cells, &large);
    let distance = squared_distance(&large, width, height, false);
    for i in (0..ground.len()).filter(|&i| ground[i] && !large[i]) {
        let free = FREE_SMALL.at(land.slope(i)) + SLOPE_SMALL.at(land.slope(i)) * step * distance[i].sqrt();
        let excess = cells.middle[i] - continued[i] - free;
        if excess > 0.0 {
            cost[i] += SMALL * step * wall_in_ground(excess);
        }
    }
}

/// The heights of a part of the cells, continued smoothly over all others.
fn continued(cells: &Cells, part: &[bool]) -> Vec<f32> {
    let heights = cells.middle.iter().zip(part);
    let mut heights: Vec<f32> = heights.map(|(z, part)| if *part { *z } else { f32::NAN }).collect();
    fill_missing(&mut heights, cells.window.width, cells.window.height, SWEEPS);
    heights
}
