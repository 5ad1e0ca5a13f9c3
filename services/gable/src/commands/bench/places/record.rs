//! What is kept of one place.

use super::super::record::{Cost, Figures, Timing};
use gable_evaluation::real::RealFigures;
use serde::{Deserialize, Serialize};

/// One row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlaceRecord {
    pub(super) row: String,
    /// Place in the table.
    pub(super) order: usize,
    /// What `gable synth` was asked for.
    pub(super) synth_arguments: Vec<String>,
    pub(super) mesh_faces: u64,
    pub(super) area_km2: f64,
    pub(super) buildings: u64,
    pub(super) date: String,
    pub(super) cores: usize,
    pub(super) build: String,
    pub(super) synth: Cost,
    pub(super) run: Timing,
    /// Against the truth, as in the other made scenes.
    pub(super) figures: Figures,
    /// As on real meshes: only where the mesh has a surface.
    pub(super) judged: RealFigures,
    /// Terrain minus bare ground of the truth outside of roofs: RMS and mean, metres; `None` without terrain.
    pub(super) terrain: Option<[f64; 2]>,
}
