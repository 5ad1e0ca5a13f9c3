//! The features of a pixel, one plane at a time.

use std::f64::consts::PI;

use gable_raster::{Raster, box_mean, box_min, fill_missing, plane_residual};
use serde::{Deserialize, Serialize};

use crate::colour::colour_features;
use crate::entropy::local_entropy;
use crate::gaussian_derivatives::SecondDerivatives;
use crate::{Error, Orthograph};

/// Pixel for which the paper gives its scales and windows, metres.
const PAPER_STEP: f64 = 0.2;

/// Scales of the Gaussian derivatives, in pixels of [`PAPER_STEP`].
const SIGMAS: [f64; 3] = [1.0, std::f64::consts::SQRT_2, 2.0];

/// Directions of the derivatives, uniform in [0, π).
const DIRECTIONS: usize = 6;

/// Sides of the entropy windows, in pixels of [`PAPER_STEP`].
const ENTROPY_WINDOWS: [f64; 3] = [5.0, 9.0, 17.0];

/// Sides of the windows of the geometric features, metres: below, at and above the size of a branch cluster, and that of
/// a crown. On coarse meshes only the last sees that a crown bulges.
const GEOMETRY_WINDOWS: [f64; 4] = [1.0, 2.6, 5.0, 10.0];

/// Sides of the windows in which what is steep is counted, metres.
const STEEP_WINDOWS: [f64; 2] = [5.0, 10.0];

/// Slopes (rise over run) of the sides of crowns on coarse meshes: most roofs are gentler, walls are steeper.
const STEEP: [f32; 2] = [0.8, 5.0];

/// Height over the lowest place of a window from which a pixel counts as high, and side of that window, metres.
const HIGH: f32 = 2.0;
const HIGH_WINDOW: f64 = 14.0;

/// What the share of the steep is taken of is at least this share of the window, so that a few pixels say little.
const LEAST_HIGH: f32 = 1e-3;

/// Side of the window of the mean colour, metres.
const MEAN_WINDOW: f64 = 2.6;

const COLOUR_COUNT: usize = 6 + 3 * DIRECTIONS + 3;
const MEAN_COUNT: usize = 3;
const GEOMETRY_COUNT: usize = 5 * GEOMETRY_WINDOWS.len() - 1;

/// Which features a classifier looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FeatureSet {
    /// The 27 published ones: L\*a\*b\* (3), illumination-invariant colour (3), second Gaussian derivatives of L\* at 3
    /// scales and 6 directions (18), entropy of L\* in 3 windows (3) (Zhu 2018, §4.1).
    Zhu27,
    /// The 27, the mean colour around, and the geometric ones.
    Full,
    /// Of the height and normal maps only: distance to a local plane and dispersion of the normals, both also as the
    /// least over the windows that hold the pixel, convexity, and the share of what is high that is steep and no wall. For
    /// input without texture.
    Geometric,
}

impl FeatureSet {
    /// Number of features.
    #[must_use]
    pub fn len(self) -> usize {
        match self {
            Self::Zhu27 => COLOUR_COUNT,
            Self::Full => COLOUR_COUNT + MEAN_COUNT + GEOMETRY_COUNT,
            Self::Geometric => GEOMETRY_COUNT + STEEP_WINDOWS.len(),
        }
    }

    /// Never: every set has features.
    #[must_use]
    pub fn is_empty(self) -> bool {
        false
    }

    /// Name in files and messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Zhu27 => "zhu27",
            Self::Full => "full",
            Self::Geometric => "geometric",
        }
    }

    /// Whether the set looks at colour.
    #[must_use]
    pub fn needs_colour(self) -> bool {
        self != Self::Geometric
    }

    /// Whether the set looks at heights and normals.
    #[must_use]
    pub fn needs_geometry(self) -> bool {
        self != Self::Zhu27
    }

    /// Names of the features, in their order.
    #[must_use]
    pub fn names(self) -> Vec<String> {
        let mut names = Vec::with_capacity(self.len());
        if self.needs_colour() {
            names.extend(["l", "a", "b", "invariant 1", "invariant 2", "invariant 3"].map(String::from));
            for sigma in SIGMAS {
                for k in 0..DIRECTIONS {
                    let degrees = k * 180 / DIRECTIONS;
                    names.push(format!("second derivative, sigma {:.2} m, {degrees} deg", sigma * PAPER_STEP));
                }
            }
            names.extend(ENTROPY_WINDOWS.map(|w| format!("entropy of l, {:.1} m", w * PAPER_STEP)));
        }
        if self == Self::Full {
            names.extend(["l", "a", "b"].map(|c| format!("mean {c}, {MEAN_WINDOW} m")));
        }
        if self.needs_geometry() {
            names.extend(GEOMETRY_WINDOWS.map(|w| format!("plane residual, {w} m")));
            names.extend(GEOMETRY_WINDOWS.map(|w| format!("least plane residual around, {w} m")));
            names.extend(GEOMETRY_WINDOWS.map(|w| format!("normal dispersion, {w} m")));
            names.extend(GEOMETRY_WINDOWS.map(|w| format!("least normal dispersion around, {w} m")));
            names.extend(GEOMETRY_WINDOWS[1..].iter().map(|w| format!("convexity, {w} m")));
        }
        if self == Self::Geometric {
            names.extend(STEEP_WINDOWS.map(|w| format!("steep share of what is high, {w} m")));
        }
        names
    }
}

/// Computes the features of every pixel and hands them on one plane at a time.
///
/// `visit(feature, values)` gets the planes in the order of [`FeatureSet::names`], values row by row as in the height
/// raster. One plane and its makings are held at a time, so memory does not grow with the number of features. Scales and
/// windows are constant in metres: the paper's, at its 0.2 m; a window never gets smaller than 3 pixels, a scale not
/// below half a pixel. Pixels without height take a smooth continuation of what is around them.
///
/// # Errors
/// If the set needs colour and there is none.
pub fn for_each_feature(
    input: &Orthograph<'_>,
    set: FeatureSet,
    mut visit: impl FnMut(usize, &[f32]),
) -> Result<(), Error> {
    let window = input.height.window();
    let (width, height) = (window.width, window.height);
    if width == 0 || height == 0 {
        return Ok(());
    }
    let mut index = 0;
    let mut emit = |plane: &[f32]| {
        visit(index, plane);
        index += 1;
    };
    if set.needs_colour() {
        let colour = input.colour.ok_or(Error::ColourMissing { set: set.name() })?;
        colour_planes(colour, set == FeatureSet::Full, &mut emit);
    }
    if set.needs_geometry() {
        let heights = without_gaps(input.height);
        geometry_planes(input, &heights, &mut emit);
        if set == FeatureSet::Geometric {
            steep_planes(input, &heights, &mut emit);
        }
    }
    Ok(())
}

fn colour_planes(colour: &Raster<[u8; 3]>, with_means: bool, emit: &mut impl FnMut(&[f32])) {
    let (width, height, step) = (colour.width(), colour.height(), colour.window().step);
    let mut planes: [Vec<f32>; 6] = std::array::from_fn(|_| Vec::with_capacity(width * height));
    // Neighbours often share a colour; looking it up again would cost three logarithms and three cube roots.
    let mut last = ([0; 3], colour_features([0; 3]));
    for &rgb in colour.values() {
        if rgb != last.0 {
            last = (rgb, colour_features(rgb));
        }
        for (plane, value) in planes.iter_mut().zip(last.1) {
            plane.push(value);
        }
    }
    planes.iter().for_each(|plane| emit(plane));
    let means = if with_means { 3 } else { 0 };
    let means: Vec<Vec<f32>> =
        planes[..means].iter().map(|plane| box_mean(plane, width, height, radius(MEAN_WINDOW, step))).collect();
    let [lightness, ..] = planes;
    let mut response = Vec::with_capacity(width * height);
    for sigma in SIGMAS {
        let derivatives = SecondDerivatives::new(&lightness, width, height, (sigma * PAPER_STEP / step).max(0.5));
        for k in 0..DIRECTIONS {
            derivatives.along(PI * k as f64 / DIRECTIONS as f64, &mut response);
            emit(&response);
        }
    }
    for side in ENTROPY_WINDOWS {
        emit(&local_entropy(&lightness, width, height, radius(side * PAPER_STEP, step)));
    }
    means.iter().for_each(|plane| emit(plane));
}

/// The heights row by row, those of gaps continued from what is around them.
fn without_gaps(height: &Raster<f32>) -> Vec<f32> {
    let mut heights = height.values().to_vec();
    fill_missing(&mut heights, height.width(), height.height(), 4);
    if heights[0].is_nan() {
        heights.fill(0.0);
    }
    heights
}

fn geometry_planes(input: &Orthograph<'_>, heights: &[f32], emit: &mut impl FnMut(&[f32])) {
    let Orthograph { height, normal, .. } = input;
    let (w, h) = (height.width(), height.height());
    let radii = GEOMETRY_WINDOWS.map(|side| radius(side, height.window().step));
    let residuals = radii.map(|r| plane_residual(heights, w, h, r));
    residuals.iter().for_each(|plane| emit(plane));
    for (plane, r) in residuals.iter().zip(radii) {
        emit(&box_min(plane, w, h, r));
    }
    drop(residuals);
    let axis = |a: usize| -> Vec<f32> {
        let values = normal.values().iter().zip(height.values());
        values.map(|(n, z)| if z.is_nan() || n[a].is_nan() { [0.0, 0.0, 1.0][a] } else { n[a] }).collect()
    };
    let axes = [axis(0), axis(1), axis(2)];
    let dispersions = radii.map(|r| {
        let [x, y, z] = [0, 1, 2].map(|a: usize| box_mean(&axes[a], w, h, r));
        let length = |((x, y), z): ((&f32, &f32), &f32)| (x * x + y * y + z * z).sqrt();
        x.iter().zip(&y).zip(&z).map(|n| 1.0 - length(n)).collect::<Vec<f32>>()
    });
    dispersions.iter().for_each(|plane| emit(plane));
    for (plane, r) in dispersions.iter().zip(radii) {
        emit(&box_min(plane, w, h, r));
    }
    for r in &radii[1..] {
        let mut convexity = box_mean(heights, w, h, *r);
        convexity.iter_mut().zip(heights).for_each(|(mean, z)| *mean = z - *mean);
        emit(&convexity);
    }
}

/// A crown on a coarse mesh is a cone of a few facets: each is flat, but hardly any is as gentle as a roof or as steep as a wall.
fn steep_planes(input: &Orthograph<'_>, heights: &[f32], emit: &mut impl FnMut(&[f32])) {
    let (w, h, step) = (input.height.width(), input.height.height(), input.height.window().step);
    let lowest = box_min(heights, w, h, radius(HIGH_WINDOW, step));
    let is_high: Vec<bool> = heights.iter().zip(&lowest).map(|(z, lowest)| z - lowest > HIGH).collect();
    let share = |counts: bool| if counts { 1.0 } else { 0.0 };
    let high: Vec<f32> = is_high.iter().map(|is_high| share(*is_high)).collect();
    let normals = input.normal.values().iter().zip(&is_high);
    let steep: Vec<f32> = normals.map(|(normal, is_high)| share(*is_high && is_steep(*normal))).collect();
    for side in STEEP_WINDOWS {
        let high = box_mean(&high, w, h, radius(side, step));
        let mut steep = box_mean(&steep, w, h, radius(side, step));
        steep.iter_mut().zip(&high).for_each(|(steep, high)| *steep /= high + LEAST_HIGH);
        emit(&steep);
    }
}

/// Whether a surface with this normal is as steep as the side of a crown; a gap is not.
fn is_steep([x, y, z]: [f32; 3]) -> bool {
    let run = z.abs();
    let rise = x.hypot(y);
    rise > STEEP[0] * run && rise < STEEP[1] * run
}

/// Radius in pixels of a window whose side is given in metres, at least 1.
fn radius(side: f64, step: f64) -> usize {
    ((side / step - 1.0) / 2.0).round().max(1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;
    use gable_raster::GridWindow;

    #[test]
    fn sets_hand_on_as_many_planes_as_they_name() {
        let window = GridWindow { step: 0.25, x0: 3, y0: -4, width: 33, height: 21 };
        let mut random = Counter::new(5);
        let colour = Raster::filled(window, ()).map(|()| [random.index(256) as u8, random.index(256) as u8, 90]);
        let mut height = Raster::filled(window, 12.0_f32);
        height.values_mut()[40] = f32::NAN;
        let normal = Raster::filled(window, [0.0, 0.6, 0.8]);
        let input = Orthograph { colour: Some(&colour), height: &height, normal: &normal };
        for set in [FeatureSet::Zhu27, FeatureSet::Full, FeatureSet::Geometric] {
            let mut seen = Vec::new();
            for_each_feature(&input, set, |i, plane| {
                assert_eq!(plane.len(), window.len());
                assert!(plane.iter().all(|v| v.is_finite()), "{}", set.names()[i]);
                seen.push(i);
            })
            .unwrap();
            assert_eq!(seen, (0..set.len()).collect::<Vec<_>>());
            assert_eq!(set.names().len(), set.len());
        }
        assert_eq!(FeatureSet::Zhu27.len(), 27);
        let bare = Orthograph { colour: None, ..input };
        assert!(matches!(for_each_feature(&bare, FeatureSet::Full, |_, _| ()), Err(Error::ColourMissing { .. })));
    }

    #[test]
    fn a_crown_of_a_few_facets_is_steep_and_a_house_is_not() {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 150, height: 150 };
        let normal_of = |slope: [f32; 2]| {
            let length = (slope[0].powi(2) + slope[1].powi(2) + 1.0).sqrt();
            [-slope[0] / length, -slope[1] / length, 1.0 / length]
        };
        // A pyramid of 10 m with sides of 50 degrees, and a gabled house of 10 m with a roof of 35 degrees and upright walls.
        let share = |is_crown: bool| {
            let mut height = Raster::filled(window, 0.0_f32);
            let mut normal = Raster::filled(window, [0.0, 0.0, 1.0]);
            for row in 50..100 {
                for column in 50..100 {
                    let from_middle = [column, row].map(|at| (at as f32 - 74.5) * 0.2);
                    let [x, y] = from_middle;
                    let (rise, slope) = match is_crown {
                        true if x.abs() > y.abs() => (1.2 * (5.0 - x.abs()), [-1.2 * x.signum(), 0.0]),
                        true => (1.2 * (5.0 - y.abs()), [0.0, -1.2 * y.signum()]),
                        false => (5.0 + 0.7 * (5.0 - x.abs()), [-0.7 * x.signum(), 0.0]),
                    };
                    height[(column, row)] = rise;
                    normal[(column, row)] = normal_of(slope);
                }
            }
            let input = Orthograph { colour: None, height: &height, normal: &normal };
            let mut found = Vec::new();
            for_each_feature(&input, FeatureSet::Geometric, |feature, plane| {
                if feature >= GEOMETRY_COUNT {
                    found.push(plane[75 * window.width + 75]);
                }
            })
            .unwrap();
            found
        };
        assert!(share(true).iter().all(|share| *share > 0.9), "{:?}", share(true));
        assert!(share(false).iter().all(|share| *share < 0.01), "{:?}", share(false));
    }

    #[test]
    fn windows_are_constant_in_metres() {
        assert_eq!([5.0, 9.0, 17.0].map(|side| radius(side * PAPER_STEP, 0.2)), [2, 4, 8]);
        assert_eq!([5.0, 9.0, 17.0].map(|side| radius(side * PAPER_STEP, 0.1)), [5, 9, 17]);
        assert_eq!(radius(1.0, 0.5), 1);
    }
}
