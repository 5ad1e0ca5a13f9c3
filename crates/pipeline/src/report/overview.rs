//! Down-sampled rasters for the pictures, gathered block by block in bounded memory.

use gable_geometry::Box2;
use gable_raster::{GridWindow, Raster};
use gable_segmentation::Label;

/// What a pixel of the full resolution shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Colour of the topmost surface, sRGB.
    pub colour: [u8; 3],
    /// Height of the topmost surface, local metres.
    pub height: f32,
    /// Height of the ground below, local metres; NaN if not known.
    pub ground: f32,
    /// Class.
    pub label: Label,
}

/// Rasters of one extent, coarse enough to be held at once.
#[derive(Clone, Debug)]
pub struct Overview {
    /// Mean colour; black without data.
    pub colour: Raster<[u8; 3]>,
    /// Mean height of the topmost surface; NaN without data.
    pub height: Raster<f32>,
    /// Mean height of the ground; NaN without data.
    pub ground: Raster<f32>,
    /// The class that most pixels have; `None` without data.
    pub label: Raster<Option<Label>>,
}

impl Overview {
    /// A window over `bounds` whose pixels are not finer than `step` and at most `side` a side.
    #[must_use]
    pub fn window(bounds: Box2, step: f64, side: usize) -> GridWindow {
        if bounds.is_empty() {
            return GridWindow { step, x0: 0, y0: 0, width: 0, height: 0 };
        }
        // One pixel less than allowed, because the window's edges need not fall on the bounds.
        let coarse = bounds.size().max_element() / side.saturating_sub(1).max(1) as f64;
        GridWindow::covering(bounds, step.max(coarse))
    }

    /// The part on `window`, which has the same step.
    #[must_use]
    pub fn crop(&self, window: GridWindow) -> Self {
        Self {
            colour: self.colour.crop(window, [0; 3]),
            height: self.height.crop(window, f32::NAN),
            ground: self.ground.crop(window, f32::NAN),
            label: self.label.crop(window, None),
        }
    }
}

/// Sums of the fine pixels in one coarse pixel.
#[derive(Clone, Copy, Default)]
struct Sum {
    colour: [u32; 3],
    labels: [u32; Label::ALL.len()],
    height: f32,
    ground: f32,
    grounds: u32,
}

/// Gathers an [`Overview`] from pieces of any size, each pixel given once. Sums in f32 are exact enough for
/// pictures and nothing else; give pieces in a fixed order for equal bytes.
pub struct OverviewBuilder {
    sums: Raster<Sum>,
}

impl std::fmt::Debug for OverviewBuilder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OverviewBuilder").field("window", &self.sums.window()).finish_non_exhaustive()
    }
}

impl OverviewBuilder {
    /// Nothing gathered yet on `window`, as a rule one of [`Overview::window`].
    #[must_use]
    pub fn new(window: GridWindow) -> Self {
        Self { sums: Raster::filled(window, Sum::default()) }
    }

    /// Adds the pixels of `fine`; `pixel(column, row)` tells each, or `None` without data. What lies outside
    /// the overview is not asked for.
    pub fn add(&mut self, fine: GridWindow, pixel: impl Fn(usize, usize) -> Option<Pixel>) {
        for row in 0..fine.height {
            for column in 0..fine.width {
                let Some(at) = self.sums.window().pixel(fine.centre(column, row)) else { continue };
                let Some(p) = pixel(column, row) else { continue };
                let sum = &mut self.sums[at];
                (0..3).for_each(|c| sum.colour[c] += u32::from(p.colour[c]));
                sum.labels[p.label as usize] += 1;
                sum.height += p.height;
                if !p.ground.is_nan() {
                    sum.ground += p.ground;
                    sum.grounds += 1;
                }
            }
        }
    }

    /// The rasters.
    #[must_use]
    pub fn finish(self) -> Overview {
        let count = |s: &Sum| s.labels.iter().sum::<u32>();
        let mean = |sum: f32, n: u32| if n == 0 { f32::NAN } else { sum / n as f32 };
        Overview {
            colour: self.sums.map(|s| s.colour.map(|v| (v / count(s).max(1)) as u8)),
            height: self.sums.map(|s| mean(s.height, count(s))),
            ground: self.sums.map(|s| mean(s.ground, s.grounds)),
            // The first of equally frequent classes.
            label: self.sums.map(|s| {
                let most = s.labels.iter().max().copied().filter(|&m| m > 0)?;
                Label::ALL.into_iter().find(|&l| s.labels[l as usize] == most)
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    #[test]
    fn the_window_is_as_coarse_as_it_must_be() {
        let bounds = |side: f64| Box2 { min: dvec2(-3.3, 7.1), max: dvec2(-3.3 + side, 8.0) };
        assert_eq!(Overview::window(bounds(100.0), 0.2, 1000).step, 0.2);
        let large = Overview::window(bounds(4000.0), 0.2, 1000);
        assert!(large.width <= 1001 && large.step > 3.9);
        assert!(Overview::window(Box2::default(), 0.2, 1000).is_empty());
    }

    #[test]
    fn means_and_majorities() {
        let fine = GridWindow { step: 0.5, x0: 0, y0: 0, width: 4, height: 2 };
        let coarse = GridWindow { step: 1.0, x0: 0, y0: 0, width: 3, height: 1 };
        let mut builder = OverviewBuilder::new(coarse);
        builder.add(fine, |column, row| {
            let label = if column == 0 && row == 0 { Label::Tree } else { Label::Building };
            let pixel = Pixel { colour: [10 * column as u8, 0, 255], height: row as f32, ground: f32::NAN, label };
            (column < 3).then_some(pixel)
        });
        let overview = builder.finish();
        assert_eq!(overview.colour.values(), [[5, 0, 255], [20, 0, 255], [0, 0, 0]]);
        assert_eq!(&overview.height.values()[..2], [0.5, 0.5]);
        assert!(overview.height.values()[2].is_nan() && overview.ground.values()[0].is_nan());
        assert_eq!(overview.label.values(), [Some(Label::Building), Some(Label::Building), None]);
    }
}
