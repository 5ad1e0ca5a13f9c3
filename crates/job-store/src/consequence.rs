//! What followed from the end of an attempt at a task: for whoever tells people of it.

use crate::JobState;
use std::time::Duration;

/// What followed from the end of an attempt at a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Consequence {
    /// How long the attempt took.
    pub took: Duration,
    /// Whether the task will be tried again.
    pub again: bool,
    /// What became of the finished city, if the task had finished one.
    pub publication: Option<Published>,
    /// The state in which the job ended, if it did.
    pub ended: Option<JobState>,
}

/// What became of a finished city.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Published {
    /// It is the generation of this number.
    Generation(i64),
    /// It is what the generation of this number has already.
    Unchanged(i64),
    /// It is none, for this reason.
    Withheld(String),
}

/// An attempt whose worker fell silent, or that no worker could begin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reaped {
    /// Id of the job.
    pub job: String,
    /// The city that the job makes or refreshes.
    pub city: String,
    /// Stage of the task.
    pub stage: i64,
    /// Unit of the task.
    pub unit: String,
    /// Which attempt it was, from 1.
    pub attempt: i64,
    /// The worker; empty if none could begin it.
    pub worker: String,
    /// What followed.
    pub consequence: Consequence,
}
