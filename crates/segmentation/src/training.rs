//! Training of the tree classifier from labelled rasters.

use gable_geometry::Counter;
use gable_ortho::{GridWindow, Raster};

use crate::boosting::{Boosting, Samples, boost, calibrate};
use crate::features::{FeatureSet, for_each_feature};
use crate::roughness::box_mean;
use crate::stumps::Model;
use crate::{Error, Orthograph};

/// Value of a mask where nothing is known.
pub const UNKNOWN: u8 = 255;

/// A raster whose trees are marked.
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
    /// 0: no tree, [`UNKNOWN`]: not looked at, else: tree.
    pub mask: Raster<u8>,
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
    /// Copies of each raster under another light: gain, contrast, colour cast and blur are drawn at random.
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

/// How well trees are found in rasters, by pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TreeScore {
    /// Tree pixels found.
    pub hits: u64,
    /// Other pixels called tree.
    pub false_alarms: u64,
    /// Tree pixels missed.
    pub misses: u64,
    /// Other pixels called so.
    pub rejections: u64,
}

impl TreeScore {
    /// Intersection over union of the trees.
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
}

/// What training says about the model.
#[derive(Clone, Debug)]
pub struct TrainReport {
    /// For each source, the score of a model that was trained on the other sources.
    pub held_out: Vec<(String, TreeScore)>,
    /// Score of the final model on what it was trained on.
    pub fit: TreeScore,
    /// Samples of the final training.
    pub samples: usize,
}

/// Trains and calibrates a classifier.
///
/// Each source is held out once: the model of the others is scored on it, and its scores there give Platt's scale and
/// offset, so that probabilities stay honest on a city that was never seen. With one source the rasters take the place
/// of sources; with one raster the calibration is made on the training samples. Deterministic for a seed.
///
/// # Errors
/// If the rasters lack what the features need, lie on different windows, or hold one class only.
pub fn train(rasters: &[LabelledRaster], options: &TrainOptions) -> Result<(Model, TrainReport), Error> {
    let groups = groups(rasters);
    let mut sets = Vec::with_capacity(rasters.len());
    for (index, raster) in rasters.iter().enumerate() {
        sets.push(samples_of(raster, index, options)?);
    }
    let all = gather(&sets, &groups, |_| true);
    let names: Vec<&str> = groups.iter().map(|g| g.0.as_str()).collect();
    let stumps = boost(&all, options.rounds, options.boosting)?;
    let mut model = Model::new(options.features, stumps, names.join(", "));
    let mut held_out = Vec::new();
    let (mut scores, mut positive, mut weight) = (Vec::new(), Vec::new(), Vec::new());
    let mut calibrate_on = |model: &Model, samples: &Samples| {
        for i in 0..samples.len() {
            let score = |s: &crate::Stump| if samples.features[s.feature][i] > s.threshold { s.above } else { s.below };
            scores.push(model.stumps.iter().map(score).sum::<f32>());
        }
        positive.extend_from_slice(&samples.positive);
        weight.extend_from_slice(&samples.weight);
    };
    if groups.len() > 1 {
        for (g, (name, members)) in groups.iter().enumerate() {
            let others = gather(&sets, &groups, |other| other != g);
            let Ok(stumps) = boost(&others, options.rounds, options.boosting) else { continue };
            let partial = Model::new(options.features, stumps, String::new());
            calibrate_on(&partial, &gather(&sets, &groups, |other| other == g));
            let members: Vec<&LabelledRaster> = members.iter().map(|&m| &rasters[m]).collect();
            held_out.push((name.clone(), evaluate(&partial, &members)?));
        }
    }
    if held_out.is_empty() {
        calibrate_on(&model, &all);
    }
    (model.scale, model.offset) = calibrate(&scores, &positive, &weight);
    let fit = evaluate(&model, &rasters.iter().collect::<Vec<_>>())?;
    Ok((model, TrainReport { held_out, fit, samples: all.len() }))
}

/// Scores a model on labelled rasters; a pixel is a tree if its probability exceeds one half.
///
/// # Errors
/// If the rasters lack what the features need or lie on different windows.
pub fn evaluate(model: &Model, rasters: &[&LabelledRaster]) -> Result<TreeScore, Error> {
    let mut score = TreeScore::default();
    for raster in rasters {
        let (height, normal) = geometry(raster, model.features)?;
        let input = Orthograph { colour: raster.colour.as_ref(), height: &height, normal: &normal };
        input.check()?;
        let probability = model.probability(&input)?;
        for (p, mask) in probability.values().iter().zip(raster.mask.values()) {
            match (*mask, *p > 0.5) {
                (UNKNOWN, _) => {}
                (0, false) => score.rejections += 1,
                (0, true) => score.false_alarms += 1,
                (_, true) => score.hits += 1,
                (_, false) => score.misses += 1,
            }
        }
    }
    Ok(score)
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

// The samples of some groups; every group has the same total weight, and so have its classes.
fn gather(sets: &[Samples], groups: &[(String, Vec<usize>)], take: impl Fn(usize) -> bool) -> Samples {
    let mut out =
        Samples { features: vec![Vec::new(); sets.first().map_or(0, |s| s.features.len())], ..Samples::default() };
    for (_, (_, members)) in groups.iter().enumerate().filter(|(g, _)| take(*g)) {
        let count = |class: bool| -> usize {
            members.iter().map(|&m| sets[m].positive.iter().filter(|p| **p == class).count()).sum()
        };
        let weights = [count(false), count(true)].map(|n| 1000.0 / n.max(1) as f32);
        for set in members.iter().map(|&m| &sets[m]) {
            for (out, feature) in out.features.iter_mut().zip(&set.features) {
                out.extend_from_slice(feature);
            }
            out.positive.extend_from_slice(&set.positive);
            out.weight.extend(set.positive.iter().map(|p| weights[usize::from(*p)]));
        }
    }
    out
}

fn geometry(raster: &LabelledRaster, set: FeatureSet) -> Result<(Raster<f32>, Raster<[f32; 3]>), Error> {
    match &raster.geometry {
        Some(maps) => Ok(maps.clone()),
        None if set.needs_geometry() => Err(Error::HeightMissing { set: set.name(), source_name: raster.name.clone() }),
        None => {
            let window = raster.mask.window();
            Ok((Raster::filled(window, 0.0), Raster::filled(window, [0.0, 0.0, 1.0])))
        }
    }
}

fn samples_of(raster: &LabelledRaster, index: usize, options: &TrainOptions) -> Result<Samples, Error> {
    let (height, normal) = geometry(raster, options.features)?;
    if raster.mask.window() != height.window() {
        return Err(Error::WindowMismatch { what: "mask" });
    }
    let classes: [Vec<usize>; 2] = [false, true].map(|tree| {
        let fits = |m: u8| m != UNKNOWN && (m != 0) == tree;
        (0..raster.mask.values().len()).filter(|&i| fits(raster.mask.values()[i])).collect()
    });
    let mut out = Samples { features: vec![Vec::new(); options.features.len()], ..Samples::default() };
    for copy in 0..options.copies.max(1) {
        let mut random = Counter::keyed(options.seed, &[index as i64, copy as i64]);
        // The first copy is the raster as it is.
        let light = (copy > 0).then(|| Light::drawn(&mut random));
        let colour = raster.colour.as_ref().map(|c| light.as_ref().map_or_else(|| c.clone(), |l| l.shine(c)));
        let mut picked = Vec::new();
        for (class, pixels) in classes.iter().enumerate() {
            for _ in 0..options.samples.min(pixels.len()) {
                picked.push(pixels[random.index(pixels.len())]);
                out.positive.push(class == 1);
                out.weight.push(1.0);
            }
        }
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
    blur: usize,
}

impl Light {
    fn drawn(random: &mut Counter) -> Self {
        let gain = random.range(0.65, 1.4);
        Self {
            gain: [0; 3].map(|_| (gain * random.range(0.92, 1.08)) as f32),
            gamma: random.range(0.75, 1.3) as f32,
            blur: random.index(3),
        }
    }

    fn shine(&self, colour: &Raster<[u8; 3]>) -> Raster<[u8; 3]> {
        let (width, height) = (colour.width(), colour.height());
        let channels = [0, 1, 2].map(|c: usize| {
            let values: Vec<f32> = colour
                .values()
                .iter()
                .map(|v| self.gain[c] * (f32::from(v[c]) / 255.0).powf(self.gamma) * 255.0)
                .collect();
            if self.blur == 0 { values } else { box_mean(&values, width, height, self.blur) }
        });
        let pixel = |i: usize| [0, 1, 2].map(|c: usize| channels[c][i].round().clamp(0.0, 255.0) as u8);
        Raster::new(colour.window(), (0..width * height).map(pixel).collect())
    }
}

/// A labelled raster from an image and a mask of the same size, given row by row **from the top**, as pictures are.
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
    let mask = mask.chunks_exact(width.max(1)).rev().flatten().copied().collect();
    Ok(LabelledRaster {
        name: name.to_owned(),
        source: source.to_owned(),
        colour: Some(Raster::new(window, colour)),
        geometry: None,
        mask: Raster::new(window, mask),
    })
}
