//! The ground surface of a city, from the low heights of coarse cells.
//!
//! The paper takes one height for a block (Zhu 2018, Eq. 3), which fails on slopes and is ruined by one spike below ground
//! (that rule is kept in [`crate::segment`] as the baseline). Here the ground is a surface:
//!
//! 1. `cells`: heights and roughness of each cell, and what rises steeply between it and the next. A difference counts as steep from a
//!    slope of 45° on, so that hillsides, banks and ramps do not count and walls do.
//! 2. `land`: how steep the land is at large, for on a hillside walls in the ground are common, and how low its low places are.
//! 3. `rim`: what hangs down at the rim of the mesh is left out.
//! 4. `enclosure`: smooth surfaces, and which of them encloses which.
//! 5. `cut`: ground or object for all cells at once, by a minimum cut. An object is what is closed in by steps up from the ground.
//! 6. `doubt`: what was taken for ground and stands high over the ground around it is put to the cut again.
//! 7. `bridges`, `strips`: decks and quays are closed in as buildings are, and yet level with the ground.
//! 8. `pits`, `bumps`: small hollows in the ground are bridged, what is small and stands on it is left out.
//! 9. Between ground cells the surface is a smooth continuation (Laplace's equation), under buildings and trees too.
//!
//! All of it works on the cells of the absolute lattice, for the city as a whole: nothing depends on blocks. No window needs a scene
//! of a least size, and one low place decides nothing but itself.

use gable_geometry::DVec2;
use gable_raster::{GridWindow, Raster, bilinear, fill_missing};

use crate::Error;
use crate::coarse_heights::CoarseHeights;

mod bridges;
mod bumps;
mod cells;
mod cut;
mod doubt;
mod enclosure;
mod land;
mod pits;
mod rim;
mod strips;
#[cfg(test)]
mod tests;

/// Rounds of the cut: the later ones know the ground that the one before found.
const ROUNDS: usize = 4;

/// A cell's quartile is nearer to the ground's middle than its low statistic; where they differ by more than this, metres, the cell
/// is not all ground.
const MIXED: f32 = 0.5;

/// Sweeps of the continuation under objects, on each level.
const SWEEPS: usize = 40;

/// Slope between the centres of cells from which ground has a step there (a retaining wall, a quay).
const STEP_SLOPE: f64 = 1.1;

/// How far over the upper side of a step a surface still belongs to it, metres.
const OVER_STEP: f32 = 1.0;

/// A ground surface: heights at the centres of cells, bilinear between them.
#[derive(Clone, Debug)]
pub struct Terrain {
    heights: Raster<f32>,
    ground: Raster<bool>,
}

impl Terrain {
    /// The ground under the gathered heights; without any, a plane at height 0.
    ///
    /// Cost: O(cells log cells).
    ///
    /// # Errors
    /// If the minimum cut refuses its input, which no heights lead to.
    pub fn from_coarse(coarse: &CoarseHeights) -> Result<Self, Error> {
        let window = coarse.window();
        if window.is_empty() {
            let window = GridWindow { width: 1, height: 1, ..window };
            return Ok(Self { heights: Raster::filled(window, 0.0), ground: Raster::filled(window, false) });
        }
        let cells = cells::Cells::of(coarse);
        let land = land::Land::of(&cells);
        let hanging = rim::hanging(&cells, &land);
        let usable: Vec<bool> = cells.seen.iter().zip(&hanging).map(|(seen, hangs)| *seen && !hangs).collect();
        let enclosures = enclosure::Enclosures::of(&cells, &usable);
        let mut against_ground = vec![0.0; usable.len()];
        let mut round = 1;
        let mut ground: Vec<bool> = loop {
            let objects = cut::objects(&cells, &usable, &enclosures, &land, &against_ground)?;
            let mut ground: Vec<bool> =
                usable.iter().zip(&objects).map(|(usable, object)| *usable && !object).collect();
            if round == ROUNDS {
                bridges::join(&cells, &objects, &mut ground);
                strips::join(&cells, &land, &objects, &mut ground);
                break ground;
            }
            against_ground = doubt::against_ground(&cells, &land, &ground);
            round += 1;
        };
        pits::leave_out(&cells, &mut ground);
        let mut surface = vec![f32::NAN; ground.len()];
        for i in (0..ground.len()).filter(|&i| ground[i]) {
            surface[i] = if cells.quartile[i] - cells.low[i] < MIXED { cells.quartile[i] } else { cells.low[i] };
        }
        bumps::leave_out(&cells, &mut surface);
        if !ground.contains(&true) {
            // A roof that fills the scene: its lowest place is all that is known of the ground.
            let lowest = cells.low.iter().copied().fold(f32::INFINITY, |a, b| if b < a { b } else { a });
            surface.fill(if lowest.is_finite() { lowest } else { 0.0 });
        }
        fill_missing(&mut surface, window.width, window.height, SWEEPS);
        Ok(Self { heights: Raster::new(window, surface), ground: Raster::new(window, ground) })
    }

    /// A surface from heights at the centres of cells; NaN where nobody will ask for the surface.
    #[must_use]
    pub fn from_heights(heights: Raster<f32>) -> Self {
        let ground = heights.map(|_| true);
        Self { heights, ground }
    }

    /// The same height everywhere: the block constant of the paper.
    #[must_use]
    pub fn constant(height: f32) -> Self {
        let window = GridWindow { step: CoarseHeights::CELL, x0: 0, y0: 0, width: 1, height: 1 };
        Self::from_heights(Raster::filled(window, height))
    }

    /// Heights at the centres of the cells.
    #[must_use]
    pub fn heights(&self) -> &Raster<f32> {
        &self.heights
    }

    /// Cells where ground was seen; elsewhere the surface is a continuation.
    #[must_use]
    pub fn ground(&self) -> &Raster<bool> {
        &self.ground
    }

    /// Height of the ground at a place, local metres; continued flat beyond the border.
    #[must_use]
    pub fn height(&self, p: DVec2) -> f64 {
        let window = self.heights.window();
        let x = p.x / window.step - window.x0 as f64 - 0.5;
        let y = p.y / window.step - window.y0 as f64 - 0.5;
        f64::from(bilinear(self.heights.values(), window.width, window.height, x as f32, y as f32))
    }

    /// Heights of the ground under a surface, at the centres of its pixels.
    ///
    /// Beside a step in the ground (a retaining wall, a quay) cells are too coarse to tell on which side of it a pixel lies; its own
    /// height tells: what lies between the two sides is the wall, what lies at the upper side is upper ground.
    #[must_use]
    pub fn under(&self, surface: &Raster<f32>) -> Raster<f32> {
        let mut ground = self.raster(surface.window());
        let window = surface.window();
        for row in 0..window.height {
            for column in 0..window.width {
                let z = surface[(column, row)];
                if let Some((lower, upper)) = self.step_at(window.centre(column, row))
                    && z >= lower
                    && z <= upper + OVER_STEP
                {
                    ground[(column, row)] = z.min(upper);
                }
            }
        }
        ground
    }

    /// The lowest and the highest of the four cells around a place, if the ground has a step there.
    fn step_at(&self, p: DVec2) -> Option<(f32, f32)> {
        let window = self.heights.window();
        let cell =
            |at: f64, first: i64, count: usize| ((at / window.step - 0.5).floor() as i64 - first, count as i64 - 1);
        let (x, last_x) = cell(p.x, window.x0, window.width);
        let (y, last_y) = cell(p.y, window.y0, window.height);
        let (mut lower, mut upper) = (f32::INFINITY, f32::NEG_INFINITY);
        for (u, v) in [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)] {
            let z = self.heights[(u.clamp(0, last_x) as usize, v.clamp(0, last_y) as usize)];
            (lower, upper) = (lower.min(z), upper.max(z));
        }
        (f64::from(upper - lower) > STEP_SLOPE * window.step).then_some((lower, upper))
    }

    /// Heights of the ground at the centres of a window's pixels.
    #[must_use]
    pub fn raster(&self, window: GridWindow) -> Raster<f32> {
        let mut values = Vec::with_capacity(window.len());
        for row in 0..window.height {
            values.extend((0..window.width).map(|column| self.height(window.centre(column, row)) as f32));
        }
        Raster::new(window, values)
    }
}
