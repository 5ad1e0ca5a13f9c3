//! Training of the plant classifiers from labelled rasters.

use gable_geometry::Counter;
use gable_raster::{GridWindow, Raster, box_mean};

use crate::boosting::{Boosting, Samples, boost, calibrate};
use crate::features::{FeatureSet, for_each_feature};
use crate::stumps::{Classifier, Model, Stump};
use crate::{Error, Label, Orthograph};

/// Label where nothing is known.
pub const UNKNOWN: u8 = 255;

/// A raster whose classes are known.
#[derive(Clone, Debug)]
pub struct LabelledRaster {
    /// Name, for messages.
    pub name: String,
    /// Where it comes from: a city, a flight. Figures and calibration are made across sources.
    pub source: String,
    /// Orthophoto, 8-bit sRGB.
    pub colour: Option<Raster<[u8; 3]>>,
    /// Height and normal maps on the same window.
    pub geometry: Option<(Raster<f32>, Raster<[f32; 3]>)>,
    /// [`Label`] of each pixel as its number, or [`UNKNOWN`].
    pub labels: Raster<u8>,
}

/// How a classifier is trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainOptions {
    /// The features.
    pub features: FeatureSet,
    /// Stumps (the paper's T: 200).
    pub rounds: usize,
    /// The kind of boosting.
    pub boosting: Boosting,
    /// Copies of each raster under another light: gain, contrast, saturation, colour cast and blur are drawn at random.
    pub copies: usize,
    /// Samples of each class from each copy.
    pub samples: usize,
    /// Seed of all that is drawn.
    pub seed: u64,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self {
            features: FeatureSet::Full,
            rounds: 200,
            boosting: Boosting::Discrete,
            copies: 3,
            samples: 4000,
            seed: 1,
        }
    }
}

/// How well one class of plants is told from what it is told from, by pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Plant pixels found.
    pub hits: u64,
    /// Other pixels called plant.
    pub false_alarms: u64,
    /// Plant pixels missed.
    pub misses: u64,
    /// Other pixels called so.
    pub rejections: u64,
}

impl Score {
    /// Intersection over union of the plants.
    #[must_use]
    pub fn iou(&self) -> f64 {
        self.hits as f64 / (self.hits + self.false_alarms + self.misses) as f64
    }

    /// Share of pixels that are right.
    #[must_use]
    pub fn accuracy(&self) -> f64 {
        let right = self.hits + self.rejections;
        right as f64 / (right + self.false_alarms + self.misses) as f64
    }

    /// Pixels that were looked at.
    #[must_use]
    pub fn pixels(&self) -> u64 {
        self.hits + self.false_alarms + self.misses + self.rejections
    }

    fn count(&mut self, task: Task, probability: &Raster<f32>, labels: &Raster<u8>) {
        for (p, label) in probability.values().iter().zip(labels.values()) {
            match (task.wants(*label), *p > 0.5) {
                (None, _) => {}
                (Some(false), false) => self.rejections += 1,
                (Some(false), true) => self.false_alarms += 1,
                (Some(true), true) => self.hits += 1,
                (Some(true), false) => self.misses += 1,
            }
        }
    }
}

/// Scores of both classifiers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlantScores {
    /// Trees among trees and buildings; with [`FeatureSet::Zhu27`] plants among everything.
    pub tree: Score,
    /// Grass among grass and ground; empty with [`FeatureSet::Zhu27`].
    pub grass: Score,
}

/// What training says about the model.
#[derive(Clone, Debug)]
pub struct TrainReport {
    /// For each source, the scores of a model that was trained on the other sources.
    pub held_out: Vec<(String, PlantScores)>,
    /// Scores of the final model on what it was trained on.
    pub fit: PlantScores,
    /// Samples of the final training.
    pub samples: usize,
}

/// What a classifier is to find, and among what.
#[derive(Clone, Copy)]
struct Task {
    plants: &'static [Label],
    others: &'static [Label],
}

impl Task {
    const PLANTS: Self = Self { plants: &[Label::Grass, Label::Tree], others: &[Label::Ground, Label::Building] };
    const TREES: Self = Self { plants: &[Label::Tree], others: &[Label::Building] };
    const GRASS: Self = Self { plants: &[Label::Grass], others: &[Label::Ground] };

    /// The tasks of the two classifiers of a set of features.
    fn of(set: FeatureSet) -> (Self, Option<Self>) {
        match set {
            FeatureSet::Zhu27 => (Self::PLANTS, None),
            FeatureSet::Full => (Self::TREES, Some(Self::GRASS)),
            FeatureSet::Geometric => (Self::TREES, None),
        }
    }

    /// Whether a label is to be found; `None` if it is not looked at.
    fn wants(self, label: u8) -> Option<bool> {
        let label = Label::from_u8(label)?;
        if self.plants.contains(&label) { Some(true) } else { self.others.contains(&label).then_some(false) }
    }
}

/// Trains and calibrates the classifiers.
///
/// Each source is held out once: the model of the others is scored on it, and its scores there give Platt's scale and
/// offset, so that probabilities stay honest on a city that was never seen. With one source the rasters take the place
/// of sources; with one raster the calibration is made on the training samples. Where no raster holds both grass and
/// ground, there is no classifier of grass. Deterministic for a seed.
///
/// # Errors
/// If the rasters lack what the features need, lie on different windows, or hold no tree or nothing else.
pub fn train(rasters: &[LabelledRaster], options: &TrainOptions) -> Result<(Model, TrainReport), Error> {
    let groups = groups(rasters);
    let mut sets = Vec::with_capacity(rasters.len());
    for (index, raster) in rasters.iter().enumerate() {
        sets.push(samples_of(raster, index, options)?);
    }
    let (trees, grass) = Task::of(options.features);
    let learn = |task: Task, take: &dyn Fn(usize) -> bool| {
        boost(&gather(&sets, &groups, task, take), options.rounds, options.boosting)
    };
    let names: Vec<&str> = groups.iter().map(|g| g.0.as_str()).collect();
    let low = grass.and_then(|task| learn(task, &|_| true).ok());
    let mut model = Model::new(options.features, learn(trees, &|_| true)?, low, names.join(", "));
    let mut held_out = Vec::new();
    let mut tree_scores = Scored::default();
    let mut low_scores = Scored::default();
    if groups.len() > 1 {
        for (g, (name, members)) in groups.iter().enumerate() {
            let Ok(stumps) = learn(trees, &|other| other != g) else { continue };
            let low = grass.and_then(|task| learn(task, &|other| other != g).ok());
            let partial = Model::new(options.features, stumps, low, String::new());
            tree_scores.add(&partial.tree.stumps, &gather(&sets, &groups, trees, &|other| other == g));
            if let (Some(task), Some(low)) = (grass, &partial.grass) {
                low_scores.add(&low.stumps, &gather(&sets, &groups, task, &|other| other == g));
            }
            let members: Vec<&LabelledRaster> = members.iter().map(|&m| &rasters[m]).collect();
            held_out.push((name.clone(), evaluate(&partial, &members)?));
        }
    }
    if tree_scores.scores.is_empty() {
        tree_scores.add(&model.tree.stumps, &gather(&sets, &groups, trees, &|_| true));
    }
    tree_scores.calibrate(&mut model.tree);
    if let (Some(task), Some(low)) = (grass, &mut model.grass) {
        if low_scores.scores.is_empty() {
            low_scores.add(&low.stumps, &gather(&sets, &groups, task, &|_| true));
        }
        low_scores.calibrate(low);
    }
    let fit = evaluate(&model, &rasters.iter().collect::<Vec<_>>())?;
    let samples = sets.iter().map(|s| s.labels.len()).sum();
    Ok((model, TrainReport { held_out, fit, samples }))
}

/// Scores of samples, to calibrate by.
#[derive(Default)]
struct Scored {
    scores: Vec<f32>,
    positive: Vec<bool>,
    weight: Vec<f32>,
}

impl Scored {
    fn add(&mut self, stumps: &[Stump], samples: &Samples) {
        for i in 0..samples.len() {
            let score = |s: &Stump| if samples.features[s.feature][i] > s.threshold { s.above } else { s.below };
            self.scores.push(stumps.iter().map(score).sum::<f32>());
        }
        self.positive.extend_from_slice(&samples.positive);
        self.weight.extend_from_slice(&samples.weight);
    }

    fn calibrate(&self, classifier: &mut Classifier) {
        (classifier.scale, classifier.offset) = calibrate(&self.scores, &self.positive, &self.weight);
    }
}

/// Scores a model on labelled rasters; a pixel is a plant if its probability exceeds one half.
///
/// # Errors
/// If the rasters lack what the features need or lie on different windows.
pub fn evaluate(model: &Model, rasters: &[&LabelledRaster]) -> Result<PlantScores, Error> {
    let mut scores = PlantScores::default();
    let (trees, grass) = Task::of(model.features);
    for raster in rasters {
        let (height, normal) = geometry(raster, model.features)?;
        let input = Orthograph { colour: raster.colour.as_ref(), height: &height, normal: &normal };
        input.check()?;
        let found = model.probability(&input)?;
        scores.tree.count(trees, &found.tree, &raster.labels);
        if let (Some(task), Some(low)) = (grass, &found.low) {
            scores.grass.count(task, low, &raster.labels);
        }
    }
    Ok(scores)
}

// Sources and the rasters of each, in the order of first appearance.
fn groups(rasters: &[LabelledRaster]) -> Vec<(String, Vec<usize>)> {
    let by = |name: fn(&LabelledRaster) -> &String| {
        let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
        for (i, raster) in rasters.iter().enumerate() {
            match groups.iter_mut().find(|g| g.0 == *name(raster)) {
                Some(group) => group.1.push(i),
                None => groups.push((name(raster).clone(), vec![i])),
            }
        }
        groups
    };
    let sources = by(|r| &r.source);
    if sources.len() > 1 { sources } else { by(|r| &r.name) }
}

/// Samples of one raster, of any class.
struct LabelSamples {
    /// `features[f][i]`: feature f of sample i.
    features: Vec<Vec<f32>>,
    labels: Vec<u8>,
}

// The samples of some groups for a task; every group has the same total weight, and so have its classes.
fn gather(sets: &[LabelSamples], groups: &[(String, Vec<usize>)], task: Task, take: &dyn Fn(usize) -> bool) -> Samples {
    let mut out =
        Samples { features: vec![Vec::new(); sets.first().map_or(0, |s| s.features.len())], ..Samples::default() };
    for (_, (_, members)) in groups.iter().enumerate().filter(|(g, _)| take(*g)) {
        let all = || members.iter().flat_map(|&m| &sets[m].labels);
        let count = |class: bool| all().filter(|l| task.wants(**l) == Some(class)).count();
        let weights = [count(false), count(true)].map(|n| 1000.0 / n.max(1) as f32);
        for set in members.iter().map(|&m| &sets[m]) {
            let wanted: Vec<(usize, bool)> =
                set.labels.iter().enumerate().filter_map(|(i, l)| Some((i, task.wants(*l)?))).collect();
            for (out, feature) in out.features.iter_mut().zip(&set.features) {
                out.extend(wanted.iter().map(|w| feature[w.0]));
            }
            out.positive.extend(wanted.iter().map(|w| w.1));
            out.weight.extend(wanted.iter().map(|w| weights[usize::from(w.1)]));
        }
    }
    out
}

fn geometry(raster: &LabelledRaster, set: FeatureSet) -> Result<(Raster<f32>, Raster<[f32; 3]>), Error> {
    match &raster.geometry {
        Some(maps) => Ok(maps.clone()),
        None if set.needs_geometry() => Err(Error::HeightMissing { set: set.name(), source_name: raster.name.clone() }),
        None => {
            let window = raster.labels.window();
            Ok((Raster::filled(window, 0.0), Raster::filled(window, [0.0, 0.0, 1.0])))
        }
    }
}

fn samples_of(raster: &LabelledRaster, index: usize, options: &TrainOptions) -> Result<LabelSamples, Error> {
    let (height, normal) = geometry(raster, options.features)?;
    if raster.labels.window() != height.window() {
        return Err(Error::WindowMismatch { what: "labels" });
    }
    let labels = raster.labels.values();
    let (trees, grass) = Task::of(options.features);
    let classes: Vec<Vec<usize>> = [Some(trees), grass]
        .into_iter()
        .flatten()
        .flat_map(|task| [false, true].map(|plant| (task, plant)))
        .map(|(task, plant)| (0..labels.len()).filter(|&i| task.wants(labels[i]) == Some(plant)).collect())
        .collect();
    let mut out = LabelSamples { features: vec![Vec::new(); options.features.len()], labels: Vec::new() };
    for copy in 0..options.copies.max(1) {
        let mut random = Counter::keyed(options.seed, &[index as i64, copy as i64]);
        // The first copy is the raster as it is.
        let light = (copy > 0).then(|| Light::drawn(&mut random));
        let colour = raster.colour.as_ref().map(|c| light.as_ref().map_or_else(|| c.clone(), |l| l.shine(c)));
        let mut picked = Vec::new();
        for pixels in &classes {
            for _ in 0..options.samples.min(pixels.len()) {
                picked.push(pixels[random.index(pixels.len())]);
            }
        }
        out.labels.extend(picked.iter().map(|&i| labels[i]));
        let input = Orthograph { colour: colour.as_ref(), height: &height, normal: &normal };
        input.check()?;
        for_each_feature(&input, options.features, |f, values| {
            out.features[f].extend(picked.iter().map(|&i| values[i]));
        })?;
    }
    Ok(out)
}

/// Another light on the same scene.
struct Light {
    gain: [f32; 3],
    gamma: f32,
    saturation: f32,
    blur: usize,
}

impl Light {
    fn drawn(random: &mut Counter) -> Self {
        let gain = random.range(0.65, 1.4);
        Self {
            gain: [0; 3].map(|_| (gain * random.range(0.92, 1.08)) as f32),
            gamma: random.range(0.75, 1.3) as f32,
            saturation: random.range(0.6, 1.3) as f32,
            blur: random.index(3),
        }
    }

    fn shine(&self, colour: &Raster<[u8; 3]>) -> Raster<[u8; 3]> {
        let (width, height) = (colour.width(), colour.height());
        let channels = [0, 1, 2].map(|c: usize| {
            let values: Vec<f32> = colour
                .values()
                .iter()
                .map(|v| {
                    let [r, g, b] = v.map(f32::from);
                    let grey = 0.3 * r + 0.6 * g + 0.1 * b;
                    let value = (grey + self.saturation * (f32::from(v[c]) - grey)).max(0.0);
                    self.gain[c] * (value / 255.0).powf(self.gamma) * 255.0
                })
                .collect();
            if self.blur == 0 { values } else { box_mean(&values, width, height, self.blur) }
        });
        let pixel = |i: usize| [0, 1, 2].map(|c: usize| channels[c][i].round().clamp(0.0, 255.0) as u8);
        Raster::new(colour.window(), (0..width * height).map(pixel).collect())
    }
}

/// A labelled raster from an image and a mask of trees of the same size (0: something else, [`UNKNOWN`]: not looked at), given row by row **from the top**, as pictures are.
///
/// # Errors
/// If there are not as many values as pixels.
pub fn labelled_image(
    name: &str,
    source: &str,
    width: usize,
    height: usize,
    step: f64,
    rgb: &[[u8; 3]],
    mask: &[u8],
) -> Result<LabelledRaster, Error> {
    if rgb.len() != width * height || mask.len() != width * height {
        return Err(Error::Image { path: name.into(), reason: "image and mask must be of the same size".to_owned() });
    }
    let window = GridWindow { step, x0: 0, y0: 0, width, height };
    let colour = rgb.chunks_exact(width.max(1)).rev().flatten().copied().collect();
    let label = |m: &u8| match *m {
        0 => Label::Ground as u8,
        UNKNOWN => UNKNOWN,
        _ => Label::Tree as u8,
    };
    let labels = mask.chunks_exact(width.max(1)).rev().flatten().map(label).collect();
    Ok(LabelledRaster {
        name: name.to_owned(),
        source: source.to_owned(),
        colour: Some(Raster::new(window, colour)),
        geometry: None,
        labels: Raster::new(window, labels),
    })
}
