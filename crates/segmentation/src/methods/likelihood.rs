//! The default method, `likelihood`: negative logarithms of the likelihoods of height over the terrain and of plants.
//!
//! Zhu 2018, §4.2, with these departures:
//!
//! 1. the ground is a surface for the whole city and not one height (Eq. 3);
//! 2. with the published products (Eq. 4) the margin between ground and building is t·(2h − 1): it vanishes where the classifier is
//!    sure that a pixel is no tree. Logarithms of independent likelihoods add instead;
//! 3. shape corrects both inputs of the costs first: what is flat over metres or stands higher than trees grow is no crown, and
//!    narrow, deep gaps lead down to the ground;
//! 4. the smoothness has a floor, so that a step alone makes no border;
//! 5. holes, plants on roofs, cars and walls are cleaned too, and whole regions are judged ([`RegionParams`]).

use super::{LabelInput, Labeller, Segmentation, probability_of_high};
use crate::cleanup::{CleanupParams, clean_buildings};
use crate::energy::{NO_DATA, Smoothness, least_energy};
use crate::evidence::RegionParams;
use crate::features::FeatureSet;
use crate::flatness::flat_and_high;
use crate::slots::slots;
use crate::stumps::Plants;
use crate::{Error, Orthograph};
use gable_parameters::{Declaration, Parameters as _, Settings, parameters, within};
use gable_raster::{Raster, fill_missing};

/// The default method.
#[derive(Debug)]
pub struct Likelihood;

parameters! {
    /// Parameters of the default method.
    pub(crate) struct LikelihoodParams {
        /// Weight of smoothness against data (Zhu 2018, Eq. 6).
        mu: f64 = 2.0, "", within(0.0, 100.0);
        /// Share of the smoothness that is left across steps of a metre and more.
        step_smoothness: f64 = 0.1, "", within(0.0, 1.0);
        /// Height above ground at which a pixel is as likely low as high (Zhu 2018, Eq. 3).
        h_trunc: f64 = 2.0, "m", within(0.5, 20.0);
        /// Steepness of the logistic function of height (Zhu 2018, Eq. 3).
        steepness: f64 = 3.0, "1/m", within(0.1, 20.0);
        /// Weight of the tree probability against that of height.
        tree_weight: f64 = 0.6, "", within(0.0, 10.0);
        /// Share of plants in the scene; the classifier is calibrated for halves.
        tree_share: f64 = 0.3, "", within(0.01, 0.99);
        /// Least likelihood of anything, so that no single measurement decides alone.
        doubt: f64 = 0.02, "", within(0.0, 0.5);
        /// Radius of the opening that removes specks and spikes of buildings.
        opening: f64 = CleanupParams::default().opening, "m", within(0.0, 10.0);
        /// Radius of the closing that fills gaps in buildings.
        closing: f64 = CleanupParams::default().closing, "m", within(0.0, 10.0);
        /// Holes in a building up to this area become building.
        hole_area: f64 = CleanupParams::default().hole_area, "m²", within(0.0, 1000.0);
        /// Trees up to this area that a building encloses on most sides become building.
        roof_tree_area: f64 = CleanupParams::default().roof_tree_area, "m²", within(0.0, 1000.0);
        /// Buildings within one patch whose mean tree probability exceeds this are trees.
        building_tree_share: f64 = CleanupParams::default().building_tree_share, "", within(0.0, 1.0);
        /// Buildings whose mean drop at the border to open ground is a smaller share of their mean height than this are none.
        wall_share: f64 = RegionParams::default().wall_share, "", within(0.0, 1.0);
        /// Buildings of a smaller probability are trees: it falls with plants seen on them and trees around that they do not stand off.
        probability: f64 = RegionParams::default().probability, "", within(0.0, 1.0);
        /// Buildings of 29 m² and more are none if a smaller share of them is as wide as the least width: lorries, containers, walls.
        narrow_share: f64 = RegionParams::default().long_core_share, "", within(0.0, 1.0);
        /// Buildings that are hardly anywhere as wide as this are none.
        min_width: f64 = 2.0 * RegionParams::default().half_width, "m", within(0.0, 20.0);
    }
}

impl Labeller for Likelihood {
    fn name(&self) -> &'static str {
        "likelihood"
    }

    fn help(&self) -> &'static str {
        "likelihoods of height over the terrain and of plants, corrected by shape"
    }

    fn parameters(&self) -> &'static [Declaration] {
        LikelihoodParams::declarations()
    }

    fn features(&self) -> FeatureSet {
        FeatureSet::Full
    }

    fn regions(&self, settings: &Settings) -> Result<RegionParams, Error> {
        let given: LikelihoodParams = settings.typed().map_err(Error::Settings)?;
        Ok(RegionParams {
            half_width: given.min_width / 2.0,
            wall_share: given.wall_share,
            probability: given.probability,
            long_core_share: given.narrow_share,
            ..RegionParams::default()
        })
    }

    /// Steps: tree probability; height over ground; both corrected by shape; one cost for each class and pixel; smoothness; α-expansion
    /// from the best class of each pixel; cleaning of the building label. Pixels without height get the class of the region that
    /// encloses them, else ground. O(pixels), but for the cut.
    fn label(&self, input: &LabelInput<'_>, settings: &Settings) -> Result<Segmentation, Error> {
        input.check()?;
        let params: LikelihoodParams = settings.typed().map_err(Error::Settings)?;
        let (height, window) = (input.maps.height, input.maps.height.window());
        let mut plants = input.classifier.probability(&input.maps)?;
        let classified = plants.tree.clone();
        let mut above = height.clone();
        if window.is_empty() {
            let labels = Raster::new(window, Vec::new());
            return Ok(Segmentation { labels, plants, classified, above, energy: 0.0 });
        }
        for (above, ground) in above.values_mut().iter_mut().zip(input.terrain.values()) {
            // Where there is no surface, it stays so: max() alone would make it 0.
            *above = (*above - ground).max(0.0) + 0.0 * *above;
        }
        correct_by_shape(&input.maps, input.terrain, input.noise, &mut above, &mut plants);
        let costs = data_term(&above, &plants, input.classifier.features.needs_colour(), &params);
        let smoothness = Smoothness::of(height, params.mu, params.step_smoothness);
        let (labels, energy) = least_energy(window.width, window.height, &costs, &smoothness)?;
        let mut labels = Raster::new(window, labels);
        clean_buildings(&mut labels, &above, &plants, &cleanup(&params, input.min_area));
        Ok(Segmentation { labels, plants, classified, above, energy })
    }
}

fn cleanup(params: &LikelihoodParams, min_area: f64) -> CleanupParams {
    CleanupParams {
        opening: params.opening,
        closing: params.closing,
        hole_area: params.hole_area,
        building_area: min_area,
        roof_tree_area: params.roof_tree_area,
        building_tree_share: params.building_tree_share,
        ..CleanupParams::default()
    }
}

/// Tree probability of what is too flat for a crown, at most.
const FLAT_TREE: f32 = 0.15;

/// What stands higher over the ground is no tree, metres: in towns even the oldest planes and poplars end below.
const TALLEST_TREE: f32 = 50.0;

/// What shape alone decides: flat surfaces and what stands higher than trees grow are no crowns, and narrow, deep gaps lead
/// down to the ground.
fn correct_by_shape(
    maps: &Orthograph<'_>,
    terrain: &Raster<f32>,
    noise: f64,
    above: &mut Raster<f32>,
    plants: &mut Plants,
) {
    let mut heights = maps.height.clone();
    let (width, rows) = (heights.width(), heights.height());
    fill_missing(heights.values_mut(), width, rows, 4);
    if heights.values()[0].is_nan() {
        return;
    }
    let over: Vec<f32> =
        heights.values().iter().zip(terrain.values()).map(|(z, ground)| (z - ground).max(0.0)).collect();
    let found = flat_and_high(&heights, &over, maps.normal, noise);
    let shape = found.flat.iter().zip(&found.patches).zip(&over);
    for (tree, ((flat, patches), over)) in plants.tree.values_mut().iter_mut().zip(shape) {
        let odds = *tree * (-patches).exp();
        *tree = odds / (odds + 1.0 - *tree);
        if *flat || *over > TALLEST_TREE {
            *tree = tree.min(FLAT_TREE);
        }
    }
    for (above, slot) in above.values_mut().iter_mut().zip(slots(&heights, &over)) {
        if slot {
            *above *= 0.0;
        }
    }
}

/// Costs of the four classes, pixel by pixel.
fn data_term(above: &Raster<f32>, plants: &Plants, has_colour: bool, params: &LikelihoodParams) -> Vec<f32> {
    let mut costs = Vec::with_capacity(4 * above.values().len());
    let (weight, doubt, share) = (params.tree_weight as f32, params.doubt as f32, params.tree_share as f32);
    let cost = |p: f32| -(doubt + (1.0 - 2.0 * doubt) * p).ln();
    let prior = |p: f32| p * share / (p * share + (1.0 - p) * (1.0 - share));
    let both = plants.tree.values().iter().zip(plants.grass().values());
    for (&above, (&tree, &grass)) in above.values().iter().zip(both) {
        if above.is_nan() {
            costs.extend(NO_DATA);
            continue;
        }
        let high = probability_of_high(above, params.h_trunc, params.steepness);
        let (is_low, is_high) = (cost(1.0 - high), cost(high));
        // Without colour nothing tells grass from other ground.
        let (t, g) = (prior(tree), if has_colour { prior(grass) } else { 0.0 });
        let (leafy, bare) = (weight * cost(t), weight * cost(1.0 - t));
        let (green, ground) = (weight * cost(g), weight * cost(1.0 - g));
        costs.extend([is_low + ground, is_low + green, is_high + leafy, is_high + bare]);
    }
    costs
}
