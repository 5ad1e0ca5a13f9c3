#![doc = include_str!("../README.md")]

pub mod params;

mod artefact;
mod budget;
mod clock;
mod error;
mod failure;
mod geography;
mod known;
pub mod label_map;
mod mosaic;
mod observer;
pub mod render;
pub mod report;
mod run;
mod sampled;
mod stages;
mod summary;
mod units;
mod warnings;
mod workspace;

pub use clock::core_seconds;
pub use error::{ErrorKind, PipelineError};
pub use observer::{Observer, Stage, Unobserved};
pub use params::{ParamError, Params};
pub use run::run;
pub use sampled::{SampledMesh, sample_mesh};
pub use summary::{
    BlockRecord, BlockState, BuildingRecord, Lod, RunStatus, RunSummary, StageSeconds, peak_memory_bytes,
};
#[cfg(feature = "fuzzing")]
#[doc(hidden)]
pub use units::fuzzing;
pub use units::{
    CityBuilding, FailedUnit, RESULT, UnitCity, UnitHistory, UnitInput, UnitJob, UnitResult, UnitTask, carry_out,
    first_unit,
};
pub use warnings::InputWarning;
