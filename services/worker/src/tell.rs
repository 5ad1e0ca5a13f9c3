//! What a worker logs of tasks, and of what followed from them.
//!
//! Lines about an attempt stand in a span that says which task of which job it is. What is tried again is a warning, what failed for
//! good an error, so that a log of warnings tells all that went wrong, and nothing else.

use gable_job_store::{Consequence, JobState, Published, Reaped};
use std::time::Duration;

/// Seconds to the millisecond.
fn seconds(time: Duration) -> f64 {
    (time.as_secs_f64() * 1000.0).round() / 1000.0
}

/// An attempt has made what it was to make.
pub(crate) fn done(files: usize, reused: bool, followed: &Consequence) {
    let what = if reused { "reused" } else { "done" };
    tracing::info!(seconds = seconds(followed.took), files, "task {what}");
    consequences(followed);
}

/// An attempt has failed; the next one would begin after `pause`.
pub(crate) fn failed(reason: &str, pause: Duration, followed: &Consequence) {
    let seconds_taken = seconds(followed.took);
    if followed.again {
        tracing::warn!(
            seconds = seconds_taken,
            again_in_seconds = seconds(pause),
            reason,
            "task failed, to be tried again"
        );
    } else {
        tracing::error!(seconds = seconds_taken, reason, "task failed for good");
    }
    consequences(followed);
}

/// The worker of an attempt, another one, fell silent. There is no span of the attempt here, so the lines say all themselves.
pub(crate) fn reaped(task: &Reaped, stage: &str) {
    let Reaped { job, city, unit, attempt, worker, consequence, .. } = task;
    let seconds = seconds(consequence.took);
    if worker.is_empty() {
        tracing::error!(job, city, stage, unit, "no worker has what the task needs: task failed for good");
    } else if consequence.again {
        tracing::warn!(job, city, stage, unit, attempt, worker, seconds, "worker fell silent, task to be tried again");
    } else {
        tracing::error!(job, city, stage, unit, attempt, worker, seconds, "worker fell silent, task failed for good");
    }
    match consequence.ended {
        Some(JobState::Failed) => tracing::error!(job, city, "job failed"),
        Some(state) => tracing::warn!(job, city, "job {}", state.name()),
        None => {}
    }
}

/// What became of the city and the job.
fn consequences(followed: &Consequence) {
    match &followed.publication {
        Some(Published::Generation(generation)) => tracing::info!(generation, "city published"),
        Some(Published::Unchanged(generation)) => tracing::info!(generation, "nothing has changed in the city"),
        Some(Published::Withheld(reason)) => tracing::warn!(reason, "city not published"),
        None => {}
    }
    match followed.ended {
        Some(JobState::Failed) => tracing::error!("job failed"),
        Some(JobState::Partial) => tracing::warn!("job partial: some of its blocks failed"),
        Some(state) => tracing::info!("job {}", state.name()),
        None => {}
    }
}
