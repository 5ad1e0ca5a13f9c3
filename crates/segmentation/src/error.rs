//! The crate's error.

use std::path::PathBuf;

/// What can go wrong when a raster is labelled or a classifier is trained.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Two rasters that must lie on one window do not.
    #[error("the {what} raster lies on another window than the height raster: sample both on the same window")]
    WindowMismatch {
        /// Which raster.
        what: &'static str,
    },
    /// A feature set that needs colour was asked for on input without.
    #[error("the {set} features need colour: use the geometric features for untextured input")]
    ColourMissing {
        /// Name of the feature set.
        set: &'static str,
    },
    /// A feature set that needs heights was asked for on images alone.
    #[error(
        "the {set} features need heights and normals, which {source_name} does not have: train the zhu27 features on it"
    )]
    HeightMissing {
        /// Name of the feature set.
        set: &'static str,
        /// Name of the labelled raster.
        source_name: String,
    },
    /// A model was made for another set of features.
    #[error("the model has {found} features, the {set} set has {expected}: train it again")]
    FeatureCount {
        /// Name of the feature set.
        set: &'static str,
        /// Features of the set.
        expected: usize,
        /// Features of the model.
        found: usize,
    },
    /// A parameter outside its range.
    #[error("{name} is {value}, it must be {range}")]
    Parameter {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The range in words.
        range: &'static str,
    },
    /// Training samples of one class only.
    #[error("all {samples} training samples are of one class: label trees and other things")]
    OneClass {
        /// Samples given.
        samples: usize,
    },
    /// A weights file that cannot be read as one.
    #[error("the weights are not a model of this version: {0}")]
    Weights(String),
    /// A labelled image that cannot be used.
    #[error("{}: {reason}", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A file or folder that cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The graph cut refused the problem.
    #[error("the graph cut failed: {0}")]
    GraphCut(String),
    /// A parameter of the method cannot be read.
    #[error("a parameter of the method: {0}")]
    Settings(String),
}
