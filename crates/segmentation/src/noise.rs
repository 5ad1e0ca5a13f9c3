//! How noisy the mesh of a city is.
//!
//! What is too flat for a crown can only be told by bounds that a roof keeps. Those in use suit meshes whose noise is that of the
//! real block which the synthetic meshes are calibrated on. On a mesh of twice that noise small roofs break them; bounds that
//! are twice as wide take crowns for roofs on a mesh of the usual noise. So the bounds follow the noise, which is measured once
//! for the whole city, where it is known what is ground.

use gable_geometry::dvec2;

use crate::cell_plane::CellPlane;
use crate::coarse_heights::CoarseHeights;
use crate::terrain::Terrain;

/// What lies lower over the ground belongs to it, metres.
const LOW: f64 = 0.3;

/// What stands at least so high is a roof or a crown, metres.
const HIGH: f64 = 2.5;

/// Steeper is no roof (rise over run).
const STEEPEST: f64 = 1.2;

/// Rms distance of the samples of a cell to their plane on a mesh of the usual noise, metres: the median of low cells, half of
/// which are pavement, lawns and yards, and the lower quartile of high ones, which are roofs even where more is under trees.
/// On synthetic tuning scenes of three districts the low ones give 0.94 to 1.07 times this, 1.49 with noise times 1.5, and 1.75
/// and 1.80 with twice the noise. Three real meshes lie at or below 1.05, two of them far below: they have coarse facets.
const USUAL_LOW: f64 = 0.036;
const USUAL_HIGH: f64 = 0.046;

/// Of fewer cells nothing is concluded.
const CELLS: usize = 100;

/// The factor is a multiple of this, so that a few streets flown anew change nothing in the rest of the city.
const GRAIN: f64 = 0.25;

/// The factor is at most this: on a mesh that is rougher a crown is as flat as a roof.
const MOST: f64 = 2.0;

/// The noise of a city's mesh as a multiple of the usual, from 1 to 2; 1 if too little was seen.
///
/// Shrubs and rubble make the ground rough, woods make what is high rough, but noise is in both: the smaller of the two
/// counts. It is taken from the samples of the coarse cells, which do not depend on how the city was cut. O(*n* log *n*).
#[must_use]
pub fn noise(heights: &CoarseHeights, terrain: &Terrain) -> f64 {
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for (column, row, samples) in heights.cells() {
        let Some(CellPlane { mean, slope, residual }) = CellPlane::of(samples) else { continue };
        let above = mean - terrain.height(dvec2(column as f64 + 0.5, row as f64 + 0.5) * heights.cell());
        if above < LOW {
            low.push(residual);
        } else if above >= HIGH && slope * 4.0 / heights.cell() <= STEEPEST {
            high.push(residual);
        }
    }
    let ratio = |of: &mut Vec<f64>, part: usize, usual: f64| {
        let at = of.len() / part;
        if of.len() < CELLS { 1.0 } else { *of.select_nth_unstable_by(at, f64::total_cmp).1 / usual }
    };
    let found = ratio(&mut low, 2, USUAL_LOW).min(ratio(&mut high, 4, USUAL_HIGH));
    ((found / GRAIN).floor() * GRAIN).clamp(1.0, MOST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;
    use gable_raster::{GridWindow, Raster};

    // A gently sloping town of 5 × 5 gabled roofs, its surface `noisy` and its ground and its crowns rough besides.
    fn found(noisy: f64, ground: f64, crowns: f64) -> f64 {
        let window = GridWindow { step: 0.25, x0: -77, y0: 31, width: 800, height: 800 };
        let mut random = Counter::new(4);
        let mut rough = |by: f64| by * (random.unit() + random.unit() + random.unit() - 1.5) * 2.0;
        let height = |p: usize| {
            let (x, y) = ((p % 800) as f64 * 0.25, (p / 800) as f64 * 0.25);
            let (u, v) = (x % 40.0 - 20.0, y % 40.0 - 20.0);
            let over = match (u.abs().max(v.abs()) < 8.0, u.abs() > 16.0) {
                (true, _) => 12.0 - 0.7 * u.abs() + rough(noisy),
                (false, true) => 6.0 + rough(noisy + crowns),
                (false, false) => rough(noisy + ground),
            };
            (0.03 * x + over) as f32
        };
        let mut heights = CoarseHeights::new(2.0);
        heights.accumulate(&Raster::new(window, (0..window.len()).map(height).collect()));
        noise(&heights, &Terrain::from_coarse(&heights).unwrap())
    }

    #[test]
    fn noise_is_what_all_surfaces_have() {
        assert_eq!(found(0.03, 0.0, 0.5), 1.0);
        assert_eq!(found(0.085, 0.0, 0.5), 1.75);
        assert_eq!(found(0.3, 0.0, 0.5), 2.0);
        // Rough on the ground alone, or on high.
        assert_eq!(found(0.03, 0.3, 0.5), 1.0);
        assert_eq!(noise(&CoarseHeights::new(2.0), &Terrain::constant(3.0)), 1.0);
    }
}
