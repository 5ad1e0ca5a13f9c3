//! What a worker and its child say to each other.

use serde::{Deserialize, Serialize};

/// Exit code of a child whose input is bad: trying again would not help.
pub const BAD_INPUT: i32 = 2;

/// What a line of the child's log begins with that tells how far it is.
pub const PHASE: &str = "phase: ";

/// What a child is to do: one line of JSON on its standard input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Order {
    /// The job's request, as it was submitted.
    pub request: serde_json::Value,
    /// Stage of the task.
    pub stage: i64,
    /// Unit of the task.
    pub unit: String,
    /// What else the task needs to know.
    pub input: serde_json::Value,
}

/// Which artefacts a task reads: the member `reads` of its input.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reads {
    /// Beginnings of paths: all artefacts of the job whose paths begin so.
    #[serde(default)]
    pub reads: Vec<String>,
}

/// What a child made: the last line of its standard output.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Report {
    /// Files to be kept: paths within its folder, parts joined by `/`.
    pub made: Vec<String>,
    /// Tasks of later stages that it found to be needed.
    #[serde(default)]
    pub tasks: Vec<Addition>,
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
