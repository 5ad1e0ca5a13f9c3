//! Why a run did not come to its end.

use crate::params::ParamError;
use std::path::PathBuf;

/// Whose fault an error is; the exit code follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The input or the parameters: another try needs others.
    Input,
    /// The user stopped the run.
    Cancelled,
    /// Anything else: disk, memory, or a fault of the program.
    Failure,
}

/// Why a run did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// Parameters that do not hold.
    #[error(transparent)]
    Params(#[from] ParamError),
    /// The input cannot be used.
    #[error("{0}")]
    Input(String),
    /// The observer asked to stop.
    #[error("the run was stopped; the same command goes on where it was, without doing finished blocks again")]
    Cancelled,
    /// A file of the working folder does not hold what it should.
    #[error("{}: {reason}; remove the folder that it is in and run again", path.display())]
    Artefact {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A stage failed.
    #[error("{stage} of {unit}: {reason}")]
    Stage {
        /// The stage.
        stage: crate::Stage,
        /// The block, patch or building.
        unit: String,
        /// What went wrong.
        reason: String,
    },
    /// A file of the output or of the working folder cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl PipelineError {
    /// Whose fault it is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Params(_) | Self::Input(_) => ErrorKind::Input,
            Self::Cancelled => ErrorKind::Cancelled,
            Self::Io { .. } | Self::Artefact { .. } | Self::Stage { .. } => ErrorKind::Failure,
        }
    }
}
