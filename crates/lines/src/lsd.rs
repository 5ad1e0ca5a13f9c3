//! The line segment detector LSD (von Gioi, Jakubowicz, Morel, Randall 2010) on rasters of real numbers.

mod gradient;
mod nfa;
mod rectangle;
mod region;
mod scale;

use crate::{LineSegment, Source};
use gable_raster::Raster;
use gradient::Gradient;
use region::Region;

/// The published scale.
const SCALE: f64 = 0.8;

/// Parameters of [`detect_segments`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LsdParams {
    /// The raster is blurred and sampled again at this many pixels per pixel, in (0, 1] (default 0.8: it removes the
    /// staircase of slanted edges).
    pub scale: f64,
    /// Weakest gradient that can belong to a segment: units of the raster per pixel of the blurred raster. Grey levels
    /// for images, metres of step for heights.
    pub min_gradient: f64,
    /// Largest angle between a pixel's level line and its segment, radians (default 22.5°).
    pub angle_tolerance: f64,
    /// Share of a segment's rectangle that has to be covered by its pixels (default 0.7).
    pub density: f64,
    /// log₁₀ of the number of rectangles that are tested (default 14.6: an image of 512 × 512 pixels). Fixed, because a
    /// number taken from the window would let the window decide what is a segment.
    pub log_tests: f64,
    /// A segment is kept if −log₁₀ of its expected number of false alarms exceeds this (default 0: one false alarm for
    /// a picture of noise).
    pub min_significance: f64,
    /// Shorter segments are dropped, metres (default 0: significance decides).
    pub min_length: f64,
}

impl LsdParams {
    /// For grey images of 0 to 255.
    #[must_use]
    pub fn image() -> Self {
        // The published quantisation error of 2 grey levels, over sin(22.5°).
        Self::with_gradient(5.23)
    }

    /// For height maps with pixels of `step` metres: only what is steeper than 60° is a step (a roof is not).
    #[must_use]
    pub fn height(step: f64) -> Self {
        Self::with_gradient(3f64.sqrt() * step / SCALE)
    }

    /// For maps of a normal's component along one direction, −1 to 1: creases of more than about 10° over two pixels.
    #[must_use]
    pub fn normal() -> Self {
        Self::with_gradient(0.08)
    }

    fn with_gradient(min_gradient: f64) -> Self {
        Self {
            scale: SCALE,
            min_gradient,
            angle_tolerance: 22.5f64.to_radians(),
            density: 0.7,
            log_tests: 14.6,
            min_significance: 0.0,
            min_length: 0.0,
        }
    }
}

/// A segment with what the detector knows about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The segment, larger values to its left; its weight is the supported length in metres.
    pub segment: LineSegment,
    /// Width of the transition, metres.
    pub width: f64,
    /// Difference of the raster from one side to the other, in its own units (metres of step for heights).
    pub contrast: f64,
    /// −log₁₀ of the expected number of false alarms.
    pub significance: f64,
}

/// Finds line segments: straight bands in which the level lines agree in direction more than chance would have it.
///
/// 1. Gaussian blur (σ = 0.6 / scale) and sampling on a lattice that hangs on the local origin ([`LsdParams::scale`]).
/// 2. Gradient over 2 × 2 pixels, level-line direction; weak gradients and those beside NaN are left out.
/// 3. From the strongest gradient down (ties by position), regions grow over pixels that agree with the region's mean
///    direction.
/// 4. A rectangle is fitted by the region's moments; regions that fill theirs badly are grown again with a narrower
///    tolerance, then cut.
/// 5. The rectangle is varied (precision, width, sides) to lower its number of false alarms, a binomial tail; it is
///    kept if the number is small enough.
///
/// Departures from the publication: real values with a threshold in their units instead of 8-bit quantisation, missing
/// values, exact order instead of 1024 buckets, and a fixed number of tests. Segments come in the order of detection,
/// the strongest seeds first. Cost: O(pixels + strong pixels · log).
#[must_use]
pub fn detect_segments(raster: &Raster<f32>, source: Source, params: &LsdParams) -> Vec<Detection> {
    let scaled = scale::resample(raster, params.scale);
    let Some(mut gradient) = Gradient::new(&scaled.values, params.min_gradient) else {
        return Vec::new();
    };
    let precision = params.angle_tolerance / std::f64::consts::PI;
    let fewest = (params.log_tests / -precision.log10()).ceil() as usize;
    let mut region = Region::default();
    let mut found = Vec::new();
    for seed in gradient.seeds() {
        if gradient.is_used(seed) {
            continue;
        }
        region.grow(&mut gradient, seed, params.angle_tolerance);
        if region.len() < fewest.max(2) {
            continue;
        }
        let Some(rectangle) = region.fit_densely(&mut gradient, params.angle_tolerance, params.density) else {
            continue;
        };
        let (rectangle, significance) = rectangle.improved(&gradient, params.log_tests);
        if significance <= params.min_significance {
            continue;
        }
        let [a, b] = rectangle.ends().map(|p| scaled.to_local(p));
        let length = a.distance(b);
        if length < params.min_length {
            continue;
        }
        let contrast = region.contrast(&gradient, &rectangle);
        found.push(Detection {
            segment: LineSegment { a, b, weight: length, source },
            width: rectangle.width() * scaled.pixel,
            contrast,
            significance,
        });
    }
    found
}

/// Luma of an sRGB image (Rec. 601), 0 to 255; NaN where `covered` says that there is no surface.
#[must_use]
pub fn grey(colour: &Raster<[u8; 3]>, covered: impl Fn(usize) -> bool) -> Raster<f32> {
    let values = colour.values().iter().enumerate().map(|(i, c)| {
        let [r, g, b] = c.map(f32::from);
        if covered(i) { 0.299 * r + 0.587 * g + 0.114 * b } else { f32::NAN }
    });
    Raster::new(colour.window(), values.collect())
}

#[cfg(test)]
mod tests;
