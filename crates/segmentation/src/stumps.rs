//! Boosted sums of decision stumps: the strong classifiers and their evaluation (Zhu 2018, Eq. 1–2).

use gable_raster::Raster;
use serde::{Deserialize, Serialize};

use crate::features::{FeatureSet, for_each_feature};
use crate::{Error, Orthograph};

/// Version of the weights file.
const VERSION: u32 = 2;

/// A decision stump: one value up to a threshold of one feature, another beyond it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stump {
    /// Index of the feature in its set.
    pub feature: usize,
    /// Threshold; a value equal to it counts as below.
    pub threshold: f32,
    /// Output up to the threshold (with AdaBoost's α in it).
    pub below: f32,
    /// Output beyond it.
    pub above: f32,
}

/// A trained classifier of two classes.
///
/// The score of a pixel is `F = Σ f_t` over the stumps, its probability `t = 1 / (1 + e^−(scale·F + offset))`. The
/// paper's Eq. 2 has scale 1 and offset 0; the trained values make t agree with the share of the class (Platt 1999).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Classifier {
    /// The stumps, in the order of training.
    pub stumps: Vec<Stump>,
    /// Platt's scale.
    pub scale: f32,
    /// Platt's offset.
    pub offset: f32,
}

impl Classifier {
    /// The probability of a score.
    #[must_use]
    pub fn calibrated(&self, score: f32) -> f32 {
        1.0 / (1.0 + (-(self.scale * score + self.offset)).exp())
    }
}

/// What tells plants from the rest.
///
/// What decides between tree and building is shape, and colour beside it; what decides between grass and ground is colour
/// alone, as both are flat. So each pair has a classifier of its own, over the same features. The published method has one
/// for plants of any height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Version of the file format.
    pub version: u32,
    /// The features that the stumps look at.
    pub features: FeatureSet,
    /// Tells trees from buildings; plants from the rest if there is no other.
    pub tree: Classifier,
    /// Tells grass from ground.
    pub grass: Option<Classifier>,
    /// What the model was trained on, in words.
    pub trained_on: String,
}

/// Probabilities of plants, pixel by pixel.
#[derive(Clone, Debug)]
pub struct Plants {
    /// That of tree against building, where something high stands.
    pub tree: Raster<f32>,
    /// That of grass against ground, where nothing does; as `tree` if absent.
    pub low: Option<Raster<f32>>,
}

impl Plants {
    /// That of grass against ground.
    #[must_use]
    pub fn grass(&self) -> &Raster<f32> {
        self.low.as_ref().unwrap_or(&self.tree)
    }
}

impl Model {
    pub(crate) fn new(features: FeatureSet, tree: Vec<Stump>, grass: Option<Vec<Stump>>, trained_on: String) -> Self {
        let raw = |stumps| Classifier { stumps, scale: 1.0, offset: 0.0 };
        Self { version: VERSION, features, tree: raw(tree), grass: grass.map(raw), trained_on }
    }

    /// Reads a weights file.
    ///
    /// # Errors
    /// If the text is no such file, of another version, or names features that the set does not have.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        #[derive(Deserialize)]
        struct Head {
            version: u32,
        }
        let wrong = |e: serde_json::Error| Error::Weights(e.to_string());
        let Head { version } = serde_json::from_str(text).map_err(wrong)?;
        if version != VERSION {
            return Err(Error::Weights(format!("version {version}, this program reads {VERSION}")));
        }
        let model: Self = serde_json::from_str(text).map_err(wrong)?;
        let mut stumps = model.tree.stumps.iter().chain(model.grass.iter().flat_map(|g| &g.stumps));
        if let Some(stump) = stumps.find(|s| s.feature >= model.features.len()) {
            let (set, expected) = (model.features.name(), model.features.len());
            return Err(Error::FeatureCount { set, expected, found: stump.feature + 1 });
        }
        Ok(model)
    }

    /// The weights file, one stump a line.
    #[must_use]
    pub fn to_json(&self) -> String {
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        let mut out = String::with_capacity(text.len());
        // A stump is the only thing so deep; its lines are joined.
        for line in text.lines() {
            let inner = line.trim_start();
            match line.len() - inner.len() {
                8 => out.extend([inner, if inner.ends_with(',') { " " } else { "" }]),
                6 if inner == "{" => out.push_str("      {"),
                6 if inner.starts_with('}') => out.extend([inner, "\n"]),
                _ => out.extend([line, "\n"]),
            }
        }
        out
    }

    /// The classifiers with the weights that ship inside.
    #[must_use]
    pub fn shipped(features: FeatureSet) -> Self {
        let text = match features {
            FeatureSet::Zhu27 => include_str!("../weights/zhu27.json"),
            FeatureSet::Full => include_str!("../weights/full.json"),
            FeatureSet::Geometric => include_str!("../weights/geometric.json"),
        };
        Self::from_json(text).expect("the shipped weights are read by a test")
    }

    /// The probabilities of every pixel.
    ///
    /// # Errors
    /// If the features need colour and there is none.
    pub fn probability(&self, input: &Orthograph<'_>) -> Result<Plants, Error> {
        let sum = |c: &Classifier| StepFunctions::new(&c.stumps, self.features.len());
        let (tree_steps, low_steps) = (sum(&self.tree), self.grass.as_ref().map(sum));
        let window = input.height.window();
        let mut tree = Raster::filled(window, tree_steps.base);
        let mut low = low_steps.as_ref().map(|steps| Raster::filled(window, steps.base));
        for_each_feature(input, self.features, |feature, values| {
            tree_steps.add(feature, values, tree.values_mut());
            if let (Some(steps), Some(low)) = (&low_steps, &mut low) {
                steps.add(feature, values, low.values_mut());
            }
        })?;
        tree.values_mut().iter_mut().for_each(|f| *f = self.tree.calibrated(*f));
        if let (Some(grass), Some(low)) = (&self.grass, &mut low) {
            low.values_mut().iter_mut().for_each(|f| *f = grass.calibrated(*f));
        }
        Ok(Plants { tree, low })
    }
}

/// The stumps, gathered by feature: their sum is one step function for each feature.
pub(crate) struct StepFunctions {
    /// Score where every feature is below all its thresholds.
    base: f32,
    /// Thresholds of each feature, ascending, with the step taken there.
    steps: Vec<Vec<(f32, f32)>>,
}

impl StepFunctions {
    pub(crate) fn new(stumps: &[Stump], features: usize) -> Self {
        let mut steps: Vec<Vec<(f32, f32)>> = vec![Vec::new(); features];
        for stump in stumps {
            steps[stump.feature].push((stump.threshold, stump.above - stump.below));
        }
        for steps in &mut steps {
            steps.sort_by(|a, b| a.0.total_cmp(&b.0));
            steps.dedup_by(|b, a| {
                let same = a.0 == b.0;
                if same {
                    a.1 += b.1;
                }
                same
            });
        }
        Self { base: stumps.iter().map(|s| s.below).sum(), steps }
    }

    /// Adds the step function of one feature to the scores.
    ///
    /// A feature has few distinct thresholds, so comparing with each of them on whole vectors of pixels beats a search
    /// or a table for each pixel: no branch, no gather, and exact.
    pub(crate) fn add(&self, feature: usize, values: &[f32], scores: &mut [f32]) {
        const CHUNK: usize = 1024;
        for (values, scores) in values.chunks(CHUNK).zip(scores.chunks_mut(CHUNK)) {
            for &(threshold, step) in &self.steps[feature] {
                for (score, value) in scores.iter_mut().zip(values) {
                    *score += if *value > threshold { step } else { 0.0 };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;

    #[test]
    fn step_functions_equal_the_sum_of_stumps() {
        let mut random = Counter::new(9);
        let stumps: Vec<Stump> = (0..60)
            .map(|_| Stump {
                feature: random.index(3),
                threshold: random.index(8) as f32,
                below: random.range(-1.0, 1.0) as f32,
                above: random.range(-1.0, 1.0) as f32,
            })
            .collect();
        let tables = StepFunctions::new(&stumps, 3);
        let planes: Vec<Vec<f32>> =
            (0..3).map(|_| (0..2000).map(|_| random.range(-1.0, 9.0).round() as f32).collect()).collect();
        let mut scores = vec![tables.base; 2000];
        for (f, plane) in planes.iter().enumerate() {
            tables.add(f, plane, &mut scores);
        }
        for (i, score) in scores.iter().enumerate() {
            let direct: f32 =
                stumps.iter().map(|s| if planes[s.feature][i] > s.threshold { s.above } else { s.below }).sum();
            assert!((score - direct).abs() < 1e-4);
        }
    }

    #[test]
    fn shipped_weights_are_read_and_written_the_same() {
        for set in [FeatureSet::Zhu27, FeatureSet::Full, FeatureSet::Geometric] {
            let model = Model::shipped(set);
            assert_eq!(model.features, set);
            assert_eq!(model.tree.stumps.len(), 200);
            assert_eq!(model.grass.is_some(), set == FeatureSet::Full);
            assert_eq!(Model::from_json(&model.to_json()).unwrap(), model);
        }
    }

    #[test]
    fn foreign_weights_are_refused() {
        assert!(matches!(Model::from_json("{}"), Err(Error::Weights(_))));
        let stump = Stump { feature: 27, threshold: 0.0, below: 0.0, above: 1.0 };
        let text = Model::new(FeatureSet::Zhu27, vec![stump], None, String::new()).to_json();
        assert!(matches!(Model::from_json(&text), Err(Error::FeatureCount { found: 28, .. })));
        let other = text.replace("\"version\": 2", "\"version\": 9");
        assert!(matches!(Model::from_json(&other), Err(Error::Weights(_))));
    }
}
