//! The sums of evidence on the regions of one patch.

use gable_raster::{GridWindow, Raster, erode};

use super::{Evidence, FULL, RegionParams};
use crate::Label;
use crate::methods::Segmentation;

/// How far from the border, inwards and outwards, heights are compared to measure a drop, metres: walls of a mesh are rounded.
const WALL_REACH: f64 = 0.8;

/// Drops and heights beyond this say no more, metres: a tower need not have more wall than a house.
const TALL: f32 = 6.0;

fn centimetres(height: f32) -> u64 {
    // NaN gives 0.
    (height.clamp(0.0, TALL) * 100.0).round() as u64
}

impl Evidence {
    /// The evidence on the building regions that `marks` numbers from 1 to `count`.
    ///
    /// `labels`, `found`, and the surface's `heights` lie on a window that holds that of `marks`; what lies within
    /// [`RegionParams::half_width`] and 0.8 m of it is looked at. O(pixels).
    ///
    /// # Panics
    /// If `marks` has a number above `count` or reaches out of `labels`.
    #[must_use]
    pub fn gather(
        labels: &Raster<u8>,
        found: &Segmentation,
        heights: &Raster<f32>,
        marks: &Raster<u32>,
        count: usize,
        params: &RegionParams,
    ) -> Vec<Self> {
        let (window, inner) = (labels.window(), marks.window());
        let building = labels.map(|label| *label == Label::Building as u8);
        let radius = (params.half_width / window.step) as f32;
        let core = erode(building.values(), window.width, window.height, radius);
        let (dx, dy) = ((inner.x0 - window.x0) as usize, (inner.y0 - window.y0) as usize);
        let reach = (WALL_REACH / window.step).round().max(1.0) as i64;
        let mut out = vec![Self::default(); count];
        for y in 0..inner.height {
            for (x, mark) in marks.row(y).iter().enumerate().filter(|(_, mark)| **mark != 0) {
                let i = (y + dy) * window.width + x + dx;
                let evidence = &mut out[*mark as usize - 1];
                evidence.pixels += 1;
                evidence.core += u64::from(core[i]);
                evidence.tree += (f64::from(found.plants.tree.values()[i]) * FULL).round() as u64;
                evidence.classified += (f64::from(found.classified.values()[i]) * FULL).round() as u64;
                evidence.rise += centimetres(found.above.values()[i]);
                for towards in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                    let line = Line { window, from: (x + dx, y + dy), towards };
                    if let Some(outside) = line.pixel(1).filter(|&j| !building.values()[j]) {
                        evidence.unseen += u64::from(heights.values()[outside].is_nan());
                        let is_tree = labels.values()[outside] == Label::Tree as u8;
                        evidence.add_side(is_tree, line.drop(heights, reach));
                    }
                }
            }
        }
        out
    }

    // A side of a pixel beyond which another class lies; what it drops there, if a surface was seen on both sides.
    fn add_side(&mut self, is_tree: bool, drop: Option<f32>) {
        self.border += 1;
        self.leafy += u64::from(is_tree);
        let Some(drop) = drop else { return };
        if is_tree {
            self.tree_sides += 1;
            self.tree_steps += centimetres(drop.abs());
        } else {
            self.open += 1;
            self.drop += centimetres(drop);
        }
    }
}

/// The pixels from one on along a row or a column.
struct Line {
    window: GridWindow,
    from: (usize, usize),
    towards: (i64, i64),
}

impl Line {
    /// The pixel some steps on, or back; `None` outside of the window.
    fn pixel(&self, steps: i64) -> Option<usize> {
        let column = self.from.0.checked_add_signed((steps * self.towards.0) as isize)?;
        let row = self.from.1.checked_add_signed((steps * self.towards.1) as isize)?;
        (column < self.window.width && row < self.window.height).then(|| row * self.window.width + column)
    }

    /// What the surface drops between `reach` pixels inside of the border that follows this pixel and as many outside.
    fn drop(&self, heights: &Raster<f32>, reach: i64) -> Option<f32> {
        let drop = heights.values()[self.pixel(1 - reach)?] - heights.values()[self.pixel(reach)?];
        (!drop.is_nan()).then_some(drop)
    }
}
