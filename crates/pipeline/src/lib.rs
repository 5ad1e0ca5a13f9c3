//! The stages as functions from artefacts to artefacts, and the one list of parameters.

pub mod params;

mod observer;
mod summary;

pub use observer::{Observer, Stage, Unobserved};
pub use params::{ParamError, Params};
pub use summary::{
    BlockRecord, BlockState, BuildingRecord, Lod, RunStatus, RunSummary, StageSeconds, peak_memory_bytes,
};
