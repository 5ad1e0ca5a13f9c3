//! What can go wrong while a city is made.

use std::path::PathBuf;

/// An error of the synthetic city.
#[derive(Debug, thiserror::Error)]
pub enum SynthError {
    /// A parameter is out of its range.
    #[error("{name} is {value}: it must be {range}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What would have been right.
        range: &'static str,
    },
    /// The truth that was given has no building that can be used.
    #[error("the truth has no building with a usable LOD2 solid: give a model with closed LOD2 shells")]
    EmptyTruth,
    /// A file or folder could not be written or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A picture could not be encoded.
    #[error("{}: {source}", path.display())]
    Picture {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
    /// A file of truth could not be encoded.
    #[error("{}: {reason}", path.display())]
    Truth {
        /// Which one.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

impl SynthError {
    pub(crate) fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }
}
