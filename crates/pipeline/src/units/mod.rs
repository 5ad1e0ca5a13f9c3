//! The stages as units of work, each from named artefacts to named artefacts: what a job on many machines consists of.
//!
//! A unit runs in a folder of its own that holds what it reads, and leaves what it makes there; it looks at nothing else
//! but, for the split, at the source. The functions that do the work are those of [`run`](crate::run()), so a job's result has
//! the same bytes. `README.md` has the table of the units with what each reads and makes.

mod city;
mod coarse_file;
#[cfg(feature = "fuzzing")]
pub mod fuzzing;
mod given;
mod map;
mod model;
mod names;
mod publish;
mod sample;
mod segment;
mod split;
mod stitch;
mod terrain;
mod terrain_file;
mod textures;
mod write;

pub use city::CityBuilding;

use crate::stages::Context;
use crate::workspace::Workspace;
use crate::{Observer, Params, PipelineError, Stage, StageSeconds};
use gable_files::Reach;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What all units of a job have in common.
#[derive(Clone, Copy, Debug)]
pub struct UnitJob<'a> {
    /// The mesh; only the split reads it.
    pub source: &'a Path,
    /// Where the mesh, and what it names, has to lie.
    pub reach: &'a Reach,
    /// The parameters.
    pub params: &'a Params,
}

/// A unit that is to be done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitTask {
    /// Its stage. Units of a stage may run at the same time; a stage begins when the earlier ones are over.
    pub stage: Stage,
    /// Its name: the block, or the tile in its place, `{ix}_{iy}`; the patch `patch_{column}_{row}`; `scene` or `city`. What lies at
    /// different places has different names.
    pub unit: String,
    /// What it needs to know.
    pub input: UnitInput,
    /// Whether nothing can come of the job without it.
    pub required: bool,
}

/// What a unit needs to know.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnitInput {
    /// Beginnings of the names of the artefacts that it reads: whole names, or folders with `/` at their end.
    pub reads: Vec<String>,
    /// Whether it needs to know what failed in earlier stages.
    #[serde(default)]
    pub history: bool,
    /// Whether its result is a function of this input, of the contents of what it reads and of what failed earlier, so that
    /// an earlier result may be taken over.
    #[serde(default)]
    pub reuse: bool,
    /// Hash of the parameters that its result depends on.
    #[serde(default)]
    pub basis: String,
    /// What else it needs to know, of its own kind.
    #[serde(default)]
    pub detail: serde_json::Value,
}

/// What happened in the earlier stages of the job.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnitHistory {
    /// Units that failed for good.
    pub failed: Vec<FailedUnit>,
    /// Blocks whose sampling was taken over from an earlier job.
    pub reused: Vec<String>,
    /// Time of the stages; core seconds are those during which units were under way.
    pub stages: Vec<StageSeconds>,
}

/// A unit that failed for good.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailedUnit {
    /// Its stage.
    pub stage: Stage,
    /// Its name.
    pub unit: String,
    /// Why.
    pub reason: String,
}

/// What a unit made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnitResult {
    /// Names of the files in its folder that are to be kept.
    pub made: Vec<String>,
    /// Units of later stages that it found to be needed.
    pub tasks: Vec<UnitTask>,
    /// The finished city, if this was its last unit.
    pub city: Option<UnitCity>,
}

/// A finished city.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UnitCity {
    /// Reference system of the coordinates.
    pub crs: String,
    /// Name of the file that lists its buildings, one [`CityBuilding`] as JSON a line.
    pub buildings: String,
}

/// Under this folder lie the files for the user.
pub const RESULT: &str = "result/";

/// The unit that a job begins with.
#[must_use]
pub fn first_unit() -> UnitTask {
    UnitTask { stage: Stage::Split, unit: "scene".to_owned(), input: UnitInput::default(), required: true }
}

/// Does a unit in `folder`, which holds what it reads.
///
/// # Errors
/// If the input is bad, or the unit cannot be done; see [`PipelineError::kind`].
pub fn carry_out(
    job: &UnitJob<'_>,
    task: &UnitTask,
    history: &UnitHistory,
    folder: &Path,
    threads: usize,
    observer: &dyn Observer,
) -> Result<UnitResult, PipelineError> {
    job.params.check()?;
    let params = given::localised(job.params, folder);
    let workspace = Workspace::at(folder)?;
    let reach = given::reach(&params, folder)?;
    let context = Context { params: &params, observer, workspace: &workspace, reach: &reach };
    let unit = Unit { job, context: &context, task, history, folder };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| PipelineError::Input(format!("{threads} threads: {e}")))?;
    pool.install(|| match task.stage {
        Stage::Split => split::split(&unit),
        Stage::Sample => sample::sample(&unit),
        Stage::Terrain => terrain::terrain(&unit),
        Stage::Segment => segment::segment(&unit),
        Stage::Stitch => stitch::stitch(&unit),
        Stage::Model => model::model(&unit),
        Stage::Write => write::write(&unit),
        Stage::Report => publish::publish(&unit),
    })
}

/// A unit under way.
struct Unit<'a> {
    job: &'a UnitJob<'a>,
    context: &'a Context<'a>,
    task: &'a UnitTask,
    history: &'a UnitHistory,
    folder: &'a Path,
}

impl Unit<'_> {
    /// The detail of its input.
    fn detail<T: DeserializeOwned>(&self) -> Result<T, PipelineError> {
        serde_json::from_value(self.task.input.detail.clone()).map_err(|e| self.failed(format!("its input: {e}")))
    }

    /// The block that it is named after.
    fn block(&self) -> Result<[u32; 2], PipelineError> {
        block(&self.task.unit).ok_or_else(|| self.failed("its name is not that of a block"))
    }

    fn failed(&self, reason: impl std::fmt::Display) -> PipelineError {
        self.context.failed(self.task.stage, &self.task.unit, reason)
    }

    /// Reads JSON that an earlier unit wrote.
    fn read<T: DeserializeOwned>(&self, name: &str) -> Result<T, PipelineError> {
        crate::artefact::read_json(&self.folder.join(name))?.ok_or_else(|| self.failed(format!("{name} is not there")))
    }

    /// Writes JSON.
    fn write<T: Serialize>(&self, name: &str, value: &T) -> Result<(), PipelineError> {
        crate::artefact::write_json(&self.folder.join(name), value)
    }

    /// Why a unit of an earlier stage failed, if it did.
    fn failure(&self, stage: Stage, unit: &str) -> Option<&str> {
        self.history.failed.iter().find(|f| f.stage == stage && f.unit == unit).map(|f| f.reason.as_str())
    }

    /// The result as the title of files names it.
    fn title(&self) -> String {
        crate::run::title(self.job.source, self.job.params)
    }
}

/// Column and row of the block that a name stands for.
fn block(name: &str) -> Option<[u32; 2]> {
    let (ix, iy) = name.split_once('_')?;
    Some([ix.parse().ok()?, iy.parse().ok()?])
}
