//! The stages, one a file, as functions from artefacts to artefacts.

pub(crate) mod ground_overview;
pub(crate) mod holes;
pub(crate) mod labels;
pub(crate) mod mesh_tiles;
pub(crate) mod model;
pub(crate) mod prepare;
pub(crate) mod rasters;
pub(crate) mod sample;
pub(crate) mod segment;
pub(crate) mod split;
pub(crate) mod stitch;
pub(crate) mod terrain;
pub(crate) mod tiles3d;
pub(crate) mod vectors;
pub(crate) mod write;

use crate::params::Params;
use crate::workspace::Workspace;
use crate::{Observer, PipelineError, Stage};
use gable_files::Reach;
use std::fmt::Display;

/// What every stage needs.
pub(crate) struct Context<'a> {
    pub(crate) params: &'a Params,
    pub(crate) observer: &'a dyn Observer,
    pub(crate) workspace: &'a Workspace,
    /// Which of the files may be read that parameters name.
    pub(crate) reach: &'a Reach,
}

impl Context<'_> {
    /// An error if the user asked to stop.
    pub(crate) fn check_cancelled(&self) -> Result<(), PipelineError> {
        if self.observer.cancelled() { Err(PipelineError::Cancelled) } else { Ok(()) }
    }

    /// A stage's error about a unit.
    pub(crate) fn failed(&self, stage: Stage, unit: &str, reason: impl Display) -> PipelineError {
        PipelineError::Stage { stage, unit: unit.to_owned(), reason: reason.to_string() }
    }

    /// Bytes for the rasters that are kept in memory: half of what the run may use.
    pub(crate) fn cache_bytes(&self) -> usize {
        self.params.resources.memory * (1 << 20) / 2
    }
}
