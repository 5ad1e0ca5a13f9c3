//! Labelling of the orthograph: data terms, smoothness and the graph cut (Zhu 2018, §4.2).

use gable_graph_cut::{GridProblem, Options, expand_grid};
use gable_raster::Raster;
use serde::{Deserialize, Serialize};

use crate::cleanup::{CleanupParams, clean_buildings};
use crate::features::FeatureSet;
use crate::fill::fill_missing;
use crate::flatness::flat_and_high;
use crate::slots::slots;
use crate::stumps::{Model, Plants};
use crate::{Error, Label, Orthograph};

/// Pixel for which the paper gives its weight of smoothness, metres.
const PAPER_STEP: f64 = 0.2;

/// Rounds of the published estimate of the ground height ("typically converges after 3 iterations").
const GROUND_ROUNDS: usize = 3;

/// Cost of any class but ground where there is no surface: holes inside a region go with it, the outside is ground.
const NO_DATA_COST: f32 = 0.25;

/// Which data term is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The published one: products of normalised height and tree probability (Eq. 4), one ground height for the raster
    /// (Eq. 3), found in three rounds from its lowest point. The terrain is not looked at.
    Zhu2018,
    /// Negative logarithms of the likelihoods of height over the terrain and of tree probability.
    ///
    /// With the published products the margin between ground and building is t·(2h − 1): it vanishes where the
    /// classifier is sure that a pixel is no tree. Logarithms of independent likelihoods add instead.
    Likelihood,
}

/// Parameters of the labelling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentParams {
    /// The data term.
    pub method: Method,
    /// Height over ground at which high and low classes are equally likely, metres (the paper's h_trunc: 3).
    pub height: f64,
    /// Steepness of the logistic function of height, 1/m (the paper's: 2).
    pub steepness: f64,
    /// Weight of the tree probability against that of height, for [`Method::Likelihood`].
    pub tree_weight: f64,
    /// Share of plants in the scene, for [`Method::Likelihood`]. The classifier is calibrated for halves.
    pub tree_share: f64,
    /// Least likelihood of anything, so that no single measurement decides alone, for [`Method::Likelihood`].
    pub doubt: f64,
    /// Weight μ of the smoothness at a step of 0.2 m; it is scaled to other steps, as a border's pixels grow with its
    /// length and a region's with its area.
    pub smoothness: f64,
    /// Share of the smoothness that is left across height steps of a metre and more (the paper's: 0).
    pub step_smoothness: f64,
    /// Noise of the mesh as a multiple of the usual, see [`crate::noise()`]; what is flat is told by it.
    pub noise: f64,
    /// Cleaning of the building label.
    pub cleanup: CleanupParams,
}

impl Default for SegmentParams {
    fn default() -> Self {
        Self {
            method: Method::Likelihood,
            height: 2.0,
            steepness: 3.0,
            tree_weight: 0.6,
            tree_share: 0.3,
            doubt: 0.02,
            smoothness: 2.0,
            step_smoothness: 0.1,
            noise: 1.0,
            cleanup: CleanupParams::default(),
        }
    }
}

impl SegmentParams {
    /// The published rule with its figures.
    #[must_use]
    pub fn zhu2018() -> Self {
        Self {
            method: Method::Zhu2018,
            height: 3.0,
            steepness: 2.0,
            tree_weight: 1.0,
            tree_share: 0.5,
            doubt: 0.0,
            smoothness: 1.0,
            step_smoothness: 0.0,
            noise: 1.0,
            cleanup: CleanupParams::zhu2018(),
        }
    }
}

/// The labels of a raster, and what they were made from.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// [`Label`] of each pixel, as its number.
    pub labels: Raster<u8>,
    /// Probabilities of plants at each pixel.
    pub plants: Plants,
    /// What the classifier alone says of trees, before shape corrected it.
    pub classified: Raster<f32>,
    /// Height over the ground, metres; NaN without data.
    pub above: Raster<f32>,
    /// The features that the classifier looked at.
    pub features: FeatureSet,
    /// Energy of the labelling before cleaning.
    pub energy: f64,
}

/// Labels every pixel ground, grass, tree or building.
///
/// `terrain` is the ground height in local metres on the window of the maps ([`crate::Terrain::raster`]); `model` the tree
/// classifier. Steps: tree probability; height over ground; one cost for each class and pixel; smoothness
/// `μ·max(1 − |Δh|, floor)` between the four neighbours (Eq. 5, made symmetric); α-expansion from the best class of each
/// pixel; cleaning of the building label. [`Method::Likelihood`] lets shape correct both inputs of the costs first: what is
/// flat over metres or stands higher than trees grow is no crown, and narrow, deep gaps lead down to the ground. Pixels without height get the class of the region that encloses them, else
/// ground.
///
/// # Errors
/// If the maps lie on different windows, or the model needs colour and there is none.
pub fn segment(
    input: &Orthograph<'_>,
    terrain: &Raster<f32>,
    model: &Model,
    params: &SegmentParams,
) -> Result<Segmentation, Error> {
    input.check()?;
    let window = input.height.window();
    if terrain.window() != window {
        return Err(Error::WindowMismatch { what: "terrain" });
    }
    let mut plants = model.probability(input)?;
    let features = model.features;
    let classified = plants.tree.clone();
    let mut above = input.height.clone();
    if window.is_empty() {
        let labels = Raster::new(window, Vec::new());
        return Ok(Segmentation { labels, plants, classified, above, features, energy: 0.0 });
    }
    let (right, up) = smoothness(input.height, params);
    let mut labels = Vec::new();
    let mut energy = 0.0;
    let mut constant = lowest(input.height);
    let rounds = if params.method == Method::Zhu2018 { GROUND_ROUNDS } else { 1 };
    for _ in 0..rounds {
        for (i, above) in above.values_mut().iter_mut().enumerate() {
            let ground = if params.method == Method::Zhu2018 { constant } else { terrain.values()[i] };
            *above = (input.height.values()[i] - ground).max(0.0) + 0.0 * input.height.values()[i];
        }
        if params.method == Method::Likelihood {
            correct_by_shape(input, terrain, params.noise, &mut above, &mut plants);
        }
        let unary = data_term(&above, &plants, features.needs_colour(), params);
        (labels, energy) = cut(window.width, window.height, &unary, &right, &up)?;
        constant = mean_ground(input.height, &labels).unwrap_or(constant);
    }
    let mut labels = Raster::new(window, labels);
    clean_buildings(&mut labels, &above, &plants, &params.cleanup);
    Ok(Segmentation { labels, plants, classified, above, features, energy })
}

/// Tree probability of what is too flat for a crown, at most.
const FLAT_TREE: f32 = 0.15;

/// What stands higher over the ground is no tree, metres: in towns even the oldest planes and poplars end below.
const TALLEST_TREE: f32 = 50.0;

/// What shape alone decides: flat surfaces and what stands higher than trees grow are no crowns, and narrow, deep gaps lead
/// down to the ground.
fn correct_by_shape(
    input: &Orthograph<'_>,
    terrain: &Raster<f32>,
    noise: f64,
    above: &mut Raster<f32>,
    plants: &mut Plants,
) {
    let mut heights = input.height.clone();
    let (width, rows) = (heights.width(), heights.height());
    fill_missing(heights.values_mut(), width, rows, 4);
    if heights.values()[0].is_nan() {
        return;
    }
    let over: Vec<f32> =
        heights.values().iter().zip(terrain.values()).map(|(z, ground)| (z - ground).max(0.0)).collect();
    let found = flat_and_high(&heights, &over, input.normal, noise);
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

/// Costs of the four classes, pixel by pixel.
fn data_term(above: &Raster<f32>, plants: &Plants, has_colour: bool, params: &SegmentParams) -> Vec<f32> {
    let mut unary = Vec::with_capacity(4 * above.values().len());
    let (middle, steepness) = (params.height as f32, params.steepness as f32);
    let (weight, doubt, share) = (params.tree_weight as f32, params.doubt as f32, params.tree_share as f32);
    let both = plants.tree.values().iter().zip(plants.grass().values());
    for (&above, (&t, &g)) in above.values().iter().zip(both) {
        if above.is_nan() {
            unary.extend([0.0, NO_DATA_COST, NO_DATA_COST, NO_DATA_COST]);
            continue;
        }
        let high = 1.0 / (1.0 + (-steepness * (above - middle)).exp());
        let costs = match params.method {
            // Eq. 4.
            Method::Zhu2018 => [high * g, high * (1.0 - g), (1.0 - high) * (1.0 - t), (1.0 - high) * t],
            Method::Likelihood => {
                let cost = |p: f32| -(doubt + (1.0 - 2.0 * doubt) * p).ln();
                let (is_low, is_high) = (cost(1.0 - high), cost(high));
                let prior = |p: f32| p * share / (p * share + (1.0 - p) * (1.0 - share));
                // Without colour nothing tells grass from other ground.
                let (t, g) = (prior(t), if has_colour { prior(g) } else { 0.0 });
                let (leafy, bare) = (weight * cost(t), weight * cost(1.0 - t));
                let (grass, ground) = (weight * cost(g), weight * cost(1.0 - g));
                [is_low + ground, is_low + grass, is_high + leafy, is_high + bare]
            }
        };
        unary.extend(costs);
    }
    unary
}

/// Weights between each pixel and its eastern and northern neighbour.
fn smoothness(height: &Raster<f32>, params: &SegmentParams) -> (Vec<f32>, Vec<f32>) {
    let (width, rows) = (height.width(), height.height());
    let weight = (params.smoothness * PAPER_STEP / height.window().step) as f32;
    let floor = params.step_smoothness as f32;
    let between = |a: f32, b: f32| {
        let step = (a - b).abs();
        // Where there is no height, the border between classes may lie anywhere.
        weight * if step.is_nan() { 0.5 } else { (1.0 - step).max(floor) }
    };
    let mut right = vec![0.0; width * rows];
    let mut up = vec![0.0; width * rows];
    for y in 0..rows {
        let row = height.row(y);
        for (out, pair) in right[y * width..].iter_mut().zip(row.windows(2)) {
            *out = between(pair[0], pair[1]);
        }
        if y + 1 < rows {
            for ((out, a), b) in up[y * width..][..width].iter_mut().zip(row).zip(height.row(y + 1)) {
                *out = between(*a, *b);
            }
        }
    }
    (right, up)
}

fn cut(width: usize, height: usize, unary: &[f32], right: &[f32], up: &[f32]) -> Result<(Vec<u8>, f64), Error> {
    let labels = Label::ALL.len();
    let best = |costs: &[f32]| (0..labels).fold(0, |best, l| if costs[l] < costs[best] { l } else { best }) as u8;
    let start: Vec<u8> = unary.chunks_exact(labels).map(best).collect();
    let problem = GridProblem { width, height, labels, unary, right, up };
    let (labels, report) =
        expand_grid(problem, start, &Options::default()).map_err(|e| Error::GraphCut(e.to_string()))?;
    Ok((labels, report.energy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stumps::Stump;
    use gable_geometry::Counter;
    use gable_raster::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.25, x0: -40, y0: 12, width: 240, height: 200 };

    // Green is a tree: one stump on a*.
    fn green() -> Model {
        let stump = Stump { feature: 1, threshold: -10.0, below: 3.0, above: -3.0 };
        Model::new(FeatureSet::Zhu27, vec![stump], None, String::new())
    }

    struct Scene {
        colour: Raster<[u8; 3]>,
        height: Raster<f32>,
        normal: Raster<[f32; 3]>,
        ground: Raster<f32>,
        truth: Raster<u8>,
    }

    // A slope with a house that a tree touches, a lawn, a car and a hole in the data on the roof.
    fn scene(slope: f32) -> Scene {
        let mut random = Counter::new(5);
        let truth_at = |x: usize, y: usize| match (x, y) {
            (40..=120, 50..=130) => Label::Building,
            (121..=150, 70..=100) => Label::Tree,
            (20..=100, 150..=185) => Label::Grass,
            _ => Label::Ground,
        };
        let mut scene = Scene {
            colour: Raster::filled(WINDOW, [150, 145, 140]),
            height: Raster::filled(WINDOW, 0.0),
            normal: Raster::filled(WINDOW, [0.0, 0.0, 1.0]),
            ground: Raster::filled(WINDOW, 0.0),
            truth: Raster::filled(WINDOW, 0),
        };
        for y in 0..WINDOW.height {
            for x in 0..WINDOW.width {
                let at = (x, y);
                let label = truth_at(x, y);
                let car = (180..196).contains(&x) && (40..48).contains(&y);
                scene.ground[at] = 100.0 + slope * x as f32 * 0.25;
                let above = match label {
                    Label::Building => 6.0,
                    Label::Tree => 5.0,
                    _ if car => 1.6,
                    _ => 0.0,
                };
                scene.height[at] = scene.ground[at] + above + random.range(-0.1, 0.1) as f32;
                if matches!(label, Label::Tree | Label::Grass) {
                    scene.colour[at] = [60, 110, 50];
                }
                // Noise of the classifier: single green pixels anywhere.
                if random.unit() < 0.05 {
                    scene.colour[at] = [60, 110, 50];
                }
                if (60..66).contains(&x) && (80..86).contains(&y) {
                    scene.height[at] = f32::NAN;
                }
                scene.truth[at] = label as u8;
            }
        }
        scene
    }

    fn right(scene: &Scene, params: &SegmentParams) -> f64 {
        let input = Orthograph { colour: Some(&scene.colour), height: &scene.height, normal: &scene.normal };
        let found = segment(&input, &scene.ground, &green(), params).unwrap();
        let same = found.labels.values().iter().zip(scene.truth.values()).filter(|(a, b)| a == b).count();
        same as f64 / scene.truth.values().len() as f64
    }

    #[test]
    fn labels_a_small_scene() {
        for slope in [0.0, 0.15] {
            let share = right(&scene(slope), &SegmentParams::default());
            assert!(share > 0.995, "slope {slope}: {share}");
        }
    }

    #[test]
    fn the_published_rule_works_on_flat_ground_and_fails_on_a_slope() {
        let flat = right(&scene(0.0), &SegmentParams::zhu2018());
        assert!(flat > 0.92, "{flat}");
        let slope = right(&scene(0.15), &SegmentParams::zhu2018());
        assert!(slope < flat - 0.02, "{slope} {flat}");
    }

    #[test]
    fn nothing_as_high_as_a_tower_block_is_a_tree() {
        // A green roof garden, too rough to be flat, 6 m and 60 m over the ground.
        for (rise, expected) in [(0.0, Label::Tree), (54.0, Label::Building)] {
            let mut scene = scene(0.0);
            let mut random = Counter::new(8);
            for y in 50..=130 {
                for x in 40..=120 {
                    let rough = 2.0 * random.unit() as f32;
                    scene.height[(x, y)] = 106.0 + rise + rough;
                    scene.colour[(x, y)] = [60, 110, 50];
                }
            }
            let input = Orthograph { colour: Some(&scene.colour), height: &scene.height, normal: &scene.normal };
            let found = segment(&input, &scene.ground, &green(), &SegmentParams::default()).unwrap();
            assert_eq!(found.labels[(100, 110)], expected as u8, "{rise}");
        }
    }

    #[test]
    fn equation_4_by_hand() {
        let window = GridWindow { width: 1, height: 1, ..WINDOW };
        let above = Raster::filled(window, 3.5_f32);
        let plants = Plants { tree: Raster::filled(window, 0.2_f32), low: None };
        let h = 1.0 / (1.0 + (-1.0_f32).exp());
        let expected = [h * 0.2, h * 0.8, (1.0 - h) * 0.8, (1.0 - h) * 0.2];
        let found = data_term(&above, &plants, true, &SegmentParams::zhu2018());
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-6, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn windows_have_to_agree() {
        let scene = scene(0.0);
        let other = Raster::filled(WINDOW.grown(1), 0.0);
        let input = Orthograph { colour: None, height: &scene.height, normal: &scene.normal };
        let error = segment(&input, &other, &green(), &SegmentParams::default()).unwrap_err();
        assert!(matches!(error, Error::WindowMismatch { what: "terrain" }));
        let error = segment(&input, &scene.ground, &green(), &SegmentParams::default()).unwrap_err();
        assert!(matches!(error, Error::ColourMissing { .. }));
    }
}
