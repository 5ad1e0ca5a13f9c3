//! The published method, `zhu2018`: Zhu et al. 2018, §4.2, with the figures of the paper.
//!
//! One ground height for the raster (Eq. 3), found in three rounds from its lowest point; the terrain is not looked at. Costs are
//! products of normalised height and plant probability (Eq. 4).

use super::{LabelInput, Labeller, Segmentation, probability_of_high};
use crate::cleanup::{CleanupParams, clean_buildings};
use crate::energy::{NO_DATA, Smoothness, least_energy};
use crate::evidence::RegionParams;
use crate::features::FeatureSet;
use crate::stumps::Plants;
use crate::{Error, Label};
use gable_parameters::{Declaration, Parameters as _, Settings, parameters, within};
use gable_raster::Raster;

/// Rounds of the estimate of the ground height ("typically converges after 3 iterations").
const GROUND_ROUNDS: usize = 3;

/// The published method.
#[derive(Debug)]
pub struct Zhu2018;

parameters! {
    /// Parameters of the published method.
    pub(crate) struct Zhu2018Params {
        /// Weight of smoothness against data (Zhu 2018, Eq. 6).
        mu: f64 = 1.0, "", within(0.0, 100.0);
        /// Share of the smoothness that is left across steps of a metre and more.
        step_smoothness: f64 = 0.0, "", within(0.0, 1.0);
        /// Height above ground at which a pixel is as likely low as high (Zhu 2018, Eq. 3).
        h_trunc: f64 = 3.0, "m", within(0.5, 20.0);
        /// Steepness of the logistic function of height (Zhu 2018, Eq. 3).
        steepness: f64 = 2.0, "1/m", within(0.1, 20.0);
        /// Radius of the opening that removes specks and spikes of buildings.
        opening: f64 = CleanupParams::zhu2018().opening, "m", within(0.0, 10.0);
        /// Radius of the closing that fills gaps in buildings.
        closing: f64 = CleanupParams::zhu2018().closing, "m", within(0.0, 10.0);
    }
}

impl Labeller for Zhu2018 {
    fn name(&self) -> &'static str {
        "zhu2018"
    }

    fn help(&self) -> &'static str {
        "the published rules of Zhu et al. 2018, §4, as a baseline"
    }

    fn parameters(&self) -> &'static [Declaration] {
        Zhu2018Params::declarations()
    }

    fn features(&self) -> FeatureSet {
        FeatureSet::Zhu27
    }

    // The paper judges no region.
    fn regions(&self, _settings: &Settings) -> Result<RegionParams, Error> {
        Ok(RegionParams::zhu2018())
    }

    fn label(&self, input: &LabelInput<'_>, settings: &Settings) -> Result<Segmentation, Error> {
        input.check()?;
        let params: Zhu2018Params = settings.typed().map_err(Error::Settings)?;
        let (height, window) = (input.maps.height, input.maps.height.window());
        let plants = input.classifier.probability(&input.maps)?;
        let classified = plants.tree.clone();
        let mut above = height.clone();
        if window.is_empty() {
            let labels = Raster::new(window, Vec::new());
            return Ok(Segmentation { labels, plants, classified, above, energy: 0.0 });
        }
        let smoothness = Smoothness::of(height, params.mu, params.step_smoothness);
        let mut ground = lowest(height);
        let (mut labels, mut energy) = (Vec::new(), 0.0);
        for _ in 0..GROUND_ROUNDS {
            for (above, z) in above.values_mut().iter_mut().zip(height.values()) {
                // Where there is no surface, it stays so: max() alone would make it 0.
                *above = (z - ground).max(0.0) + 0.0 * z;
            }
            let costs = data_term(&above, &plants, &params);
            (labels, energy) = least_energy(window.width, window.height, &costs, &smoothness)?;
            ground = mean_ground(height, &labels).unwrap_or(ground);
        }
        let mut labels = Raster::new(window, labels);
        let cleanup = CleanupParams { opening: params.opening, closing: params.closing, ..CleanupParams::zhu2018() };
        clean_buildings(&mut labels, &above, &plants, &cleanup);
        Ok(Segmentation { labels, plants, classified, above, energy })
    }
}

fn lowest(height: &Raster<f32>) -> f32 {
    let least = height.values().iter().copied().filter(|z| !z.is_nan()).fold(f32::INFINITY, f32::min);
    if least.is_finite() { least } else { 0.0 }
}

fn mean_ground(height: &Raster<f32>, labels: &[u8]) -> Option<f32> {
    let (mut sum, mut n) = (0.0, 0.0);
    for (z, label) in height.values().iter().zip(labels) {
        if *label == Label::Ground as u8 && !z.is_nan() {
            sum += f64::from(*z);
            n += 1.0;
        }
    }
    (n > 0.0).then(|| (sum / n) as f32)
}

/// Costs of the four classes (Eq. 4), pixel by pixel.
fn data_term(above: &Raster<f32>, plants: &Plants, params: &Zhu2018Params) -> Vec<f32> {
    let mut costs = Vec::with_capacity(4 * above.values().len());
    let both = plants.tree.values().iter().zip(plants.grass().values());
    for (&above, (&t, &g)) in above.values().iter().zip(both) {
        if above.is_nan() {
            costs.extend(NO_DATA);
            continue;
        }
        let high = probability_of_high(above, params.h_trunc, params.steepness);
        costs.extend([high * g, high * (1.0 - g), (1.0 - high) * (1.0 - t), (1.0 - high) * t]);
    }
    costs
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;

    #[test]
    fn equation_4_by_hand() {
        let window = GridWindow { step: 0.25, x0: 0, y0: 0, width: 1, height: 1 };
        let above = Raster::filled(window, 3.5_f32);
        let plants = Plants { tree: Raster::filled(window, 0.2_f32), low: None };
        let h = 1.0 / (1.0 + (-1.0_f32).exp());
        let expected = [h * 0.2, h * 0.8, (1.0 - h) * 0.8, (1.0 - h) * 0.2];
        let found = data_term(&above, &plants, &Zhu2018Params::default());
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-6, "{found:?} {expected:?}");
        }
    }
}
