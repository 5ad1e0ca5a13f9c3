//! What a worker and its child say to each other.

use serde::{Deserialize, Serialize};

/// Exit code of a child whose input is bad: trying again would not help.
pub const BAD_INPUT: i32 = 2;

/// Exit code of a child that could not do its task; the last line of its log is the reason.
pub const FAILED: i32 = 1;

/// What a line of the child's log begins with that tells how far it is.
pub const PHASE: &str = "phase: ";

/// Folder, within that of the task, of the upload that it reads.
pub const UPLOAD: &str = "upload";

/// Folder, within that of the task, of the objects that it reads.
pub const OBJECTS: &str = "objects";

/// What a child is to do: one line of JSON on its standard input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// The job's request, as it was submitted.
    pub request: serde_json::Value,
    /// Stage of the task.
    pub stage: i64,
    /// Unit of the task.
    pub unit: String,
    /// What else the task needs to know.
    pub input: serde_json::Value,
    /// What happened in the earlier stages, if the member `history` of the input is true.
    #[serde(default)]
    pub history: Option<History>,
}

/// What happened in the stages before that of a task. They are over, so this is the same at every attempt, but for the times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Tasks that failed for good, by stage and unit.
    pub failed: Vec<Ended>,
    /// Tasks whose results were taken over, by stage and unit.
    pub reused: Vec<Ended>,
    /// Times of the stages.
    pub stages: Vec<StageTime>,
}

/// A task that is over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ended {
    /// Stage.
    pub stage: i64,
    /// Name of the unit.
    pub unit: String,
    /// Why it failed.
    #[serde(default)]
    pub reason: String,
}

/// Time of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageTime {
    /// Stage.
    pub stage: i64,
    /// From the begin of its first task to the end of its last, seconds.
    pub wall: f64,
    /// Sum over its tasks, seconds.
    pub sum: f64,
}

/// What a task needs: members of its input.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Needs {
    /// Artefacts of the job that it reads: paths, or folders, which end with `/`.
    #[serde(default)]
    pub reads: Vec<String>,
    /// An upload that it reads; its files are laid into the folder [`UPLOAD`].
    #[serde(default)]
    pub upload: Option<String>,
    /// The place of objects that it reads, `s3://BUCKET/PREFIX`; they are laid into the folder [`OBJECTS`]. A child has no
    /// credentials to fetch them itself.
    #[serde(default)]
    pub objects: Option<String>,
    /// Whether it is to be told what happened in earlier stages.
    #[serde(default)]
    pub history: bool,
    /// Whether its result depends on its input, on what it reads and on what failed earlier, and on nothing else: then the result
    /// of an earlier job of the city may be taken over.
    #[serde(default)]
    pub reuse: bool,
}

/// What a child made: the last line of its standard output.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Report {
    /// Files to be kept: paths within its folder, parts joined by `/`.
    pub made: Vec<String>,
    /// Tasks of later stages that it found to be needed.
    #[serde(default)]
    pub tasks: Vec<Addition>,
    /// The finished city, which is published with the end of the task.
    #[serde(default)]
    pub city: Option<CityReport>,
}

/// A finished city.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CityReport {
    /// Reference system of the coordinates.
    pub crs: String,
    /// Path of the file that lists its buildings, one [`Building`] as JSON a line.
    pub buildings: String,
}

/// A building of a finished city.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Building {
    /// Identifier, the same in all jobs.
    pub id: String,
    /// Hash of its geometries and attributes.
    pub hash: String,
    /// Column and row of the tile that holds it.
    pub tile: [u32; 2],
    /// West, south, east, north; world coordinates, metres.
    pub bbox: [f64; 4],
    /// The best LOD, such as `lod2`.
    pub lod: String,
    /// Roof type.
    #[serde(default)]
    pub roof_type: Option<String>,
    /// Highest roof point above the ground, metres.
    pub height_m: f64,
    /// Footprint area, m².
    pub area_m2: f64,
    /// Attributes by name.
    pub attributes: serde_json::Value,
}

/// A task that a child adds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Addition {
    /// Stage.
    pub stage: i64,
    /// Name of the unit, unique in its stage.
    pub unit: String,
    /// What it needs to know; `reads` names the artefacts that it reads.
    pub input: serde_json::Value,
    /// Whether the job fails if it fails.
    pub required: bool,
}
