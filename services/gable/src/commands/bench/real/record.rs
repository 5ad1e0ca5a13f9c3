//! What is kept of one row of one real scene.

use super::super::record::Timing;
use super::scenes::Half;
use gable_evaluation::real::RealFigures;
use serde::{Deserialize, Serialize};

/// One row of one real scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RealRecord {
    pub(super) scene: String,
    pub(super) half: Half,
    pub(super) row: String,
    /// Place of the scene in the list.
    pub(super) order: usize,
    pub(super) mesh_faces: u64,
    pub(super) area_km2: f64,
    pub(super) date: String,
    pub(super) cores: usize,
    pub(super) build: String,
    pub(super) run: Timing,
    pub(super) figures: RealFigures,
}
