//! One task, from its claim to its result.

use crate::cache::Cache;
use crate::child::{self, Ended, State};
use crate::history;
use crate::protocol::{History, Order, Reads, Report};
use crate::{Settings, WorkerError};
use gable_job_store::{Artifact, BlobId, Blobs, Claim, Finished, JobStoreError, NewTask, Order as Word, Retry, Store};
use std::path::{Component, Path};
use std::time::Duration;
use tokio::sync::watch;

/// How often a task that a child adds is tried.
const ATTEMPTS: i64 = 3;

/// The first pause before another attempt; it doubles with each.
const PAUSE: Duration = Duration::from_secs(2);

/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// What a task needs besides its claim.
pub(crate) struct Around<'a> {
    pub(crate) store: &'a Store,
    pub(crate) blobs: &'a Blobs,
    pub(crate) cache: &'a Cache,
    pub(crate) settings: &'a Settings,
    pub(crate) state: &'a watch::Sender<State>,
}

/// What became of a task.
enum Made {
    Result(Finished),
    BadInput(String),
    Failed(String),
    Stopped,
}

impl Around<'_> {
    /// Does a task and hands in what came of it. `drain` becomes true when the worker has no more time for it.
    pub(crate) async fn carry_out(&self, claim: &Claim, mut drain: watch::Receiver<bool>) -> Result<(), WorkerError> {
        let (stop, stopped) = watch::channel(false);
        let work = self.work(claim, stopped);
        tokio::pin!(work);
        let mut beat = tokio::time::interval(self.settings.lease / 3);
        let mut draining = false;
        let made = loop {
            tokio::select! {
                made = &mut work => break made?,
                _ = beat.tick() => {
                    let phase = self.state.borrow().phase.clone();
                    match self.store.heartbeat(claim, self.settings.lease, &phase).await {
                        Ok(Word::Continue) => {}
                        Ok(Word::Stop) => { stop.send_replace(true); }
                        // If the database stays away, the lease runs out, and the result will be refused.
                        Err(e) => tracing::warn!(unit = claim.unit, "no heartbeat: {e}"),
                    }
                }
                changed = drain.changed(), if !draining => {
                    if changed.is_err() || *drain.borrow() {
                        draining = true;
                        stop.send_replace(true);
                    }
                }
            }
        };
        let draining = draining && matches!(made, Made::Stopped);
        self.hand_in(claim, made, draining).await
    }

    /// The body of a task. Only what would hit every task is an error.
    async fn work(&self, claim: &Claim, stop: watch::Receiver<bool>) -> Result<Made, WorkerError> {
        let folder = tempfile::tempdir_in(&self.settings.folder)
            .map_err(|source| WorkerError::Folder { path: self.settings.folder.clone(), source })?;
        let value = |text: &str| serde_json::from_str::<serde_json::Value>(text);
        let (Ok(request), Ok(input)) = (value(&claim.request), value(&claim.input)) else {
            return Ok(Made::BadInput("its request or its input is no JSON".to_owned()));
        };
        self.say("fetching");
        if let Err(e) = self.fetch(claim, &input, folder.path()).await {
            return Ok(Made::Failed(format!("fetching its input: {e}")));
        }
        let history = match self.history(claim, &input).await {
            Ok(history) => history,
            Err(e) => return Ok(Made::Failed(format!("looking at what happened before: {e}"))),
        };
        let order = Order { request, stage: claim.stage, unit: claim.unit.clone(), input, history };
        self.say("running");
        let settings = self.settings;
        let ended = child::run(&settings.program, folder.path(), &order, settings.limits, stop, self.state).await?;
        Ok(match ended {
            Ended::Stopped => Made::Stopped,
            Ended::BadInput(reason) => Made::BadInput(reason),
            Ended::Badly(reason) => Made::Failed(reason),
            Ended::Well(report) => {
                self.say("handing in");
                match self.keep(&report, folder.path()).await {
                    Ok(artifacts) => {
                        Made::Result(Finished { artifacts, tasks: additions(report), ..Finished::default() })
                    }
                    Err(e) => Made::Failed(format!("keeping its result: {e}")),
                }
            }
        })
    }

    fn say(&self, phase: &str) {
        self.state.send_modify(|s| s.phase = phase.to_owned());
    }

    /// What happened before, if the task wants to know.
    async fn history(&self, claim: &Claim, input: &serde_json::Value) -> Result<Option<History>, JobStoreError> {
        if input.get("history").and_then(serde_json::Value::as_bool) != Some(true) {
            return Ok(None);
        }
        Ok(Some(history::before(claim.stage, &self.store.tasks(&claim.job).await?)))
    }

    /// Lays out what a task reads.
    async fn fetch(&self, claim: &Claim, input: &serde_json::Value, folder: &Path) -> Result<(), JobStoreError> {
        let Reads { reads } = serde_json::from_value(input.clone()).unwrap_or_default();
        for prefix in &reads {
            for artifact in self.store.artifacts(&claim.job, prefix).await? {
                let place = folder.join(&artifact.path);
                if !place.exists() {
                    self.cache.lay(self.blobs, artifact.blob, &place).await?;
                }
            }
        }
        Ok(())
    }

    /// Keeps what a task made.
    async fn keep(&self, report: &Report, folder: &Path) -> Result<Vec<Artifact>, JobStoreError> {
        let mut kept = Vec::new();
        for path in &report.made {
            let file = folder.join(path);
            let wrong = |source| JobStoreError::File { path: file.clone(), source };
            if !Path::new(path).components().all(|c| matches!(c, Component::Normal(_))) {
                return Err(wrong(std::io::Error::other("it lies outside of the task's folder")));
            }
            let content = tokio::fs::read(&file).await.map_err(wrong)?;
            let (blob, bytes) = (BlobId::of(&content), content.len() as u64);
            self.cache.keep(blob, &content).await?;
            again_while_away(self.settings.lease, || self.blobs.put(content.clone())).await?;
            kept.push(Artifact { path: path.clone(), blob, bytes });
        }
        Ok(kept)
    }

    async fn hand_in(&self, claim: &Claim, made: Made, draining: bool) -> Result<(), WorkerError> {
        let told = again_while_away(self.settings.lease, || async {
            match &made {
                Made::Result(result) => self.store.finish(claim, result).await,
                Made::BadInput(reason) => self.store.fail(claim, reason, Retry::Never).await,
                Made::Failed(reason) => self.store.fail(claim, reason, Retry::After(pause(claim.attempt))).await,
                Made::Stopped if draining => self.store.release(claim).await,
                Made::Stopped => Ok(()),
            }
        })
        .await;
        match told {
            Ok(()) => Ok(()),
            Err(e @ JobStoreError::Lost { .. }) => {
                tracing::info!("{e}: its result is thrown away");
                Ok(())
            }
            // The lease will run out, and another worker will take the task.
            Err(e) if e.is_transient() => {
                tracing::warn!(unit = claim.unit, "not handed in: {e}");
                Ok(())
            }
            Err(e) => Err(e.into()),
        }
    }
}

/// The pause before the next attempt.
fn pause(attempt: i64) -> Duration {
    let doublings = u32::try_from(attempt - 1).unwrap_or(0).min(16);
    (PAUSE * 2_u32.pow(doublings)).min(LONGEST_PAUSE)
}

fn additions(report: Report) -> Vec<NewTask> {
    let added = report.tasks.into_iter();
    added
        .map(|t| NewTask {
            stage: t.stage,
            unit: t.unit,
            input: t.input.to_string(),
            required: t.required,
            max_attempts: ATTEMPTS,
        })
        .collect()
}

/// Repeats a call while the database or the object store is away, for as long as a lease may last.
async fn again_while_away<T, F: Future<Output = Result<T, JobStoreError>>>(
    patience: Duration,
    call: impl Fn() -> F,
) -> Result<T, JobStoreError> {
    let begin = tokio::time::Instant::now();
    let mut wait = Duration::from_millis(100);
    loop {
        match call().await {
            Err(e) if e.is_transient() && begin.elapsed() < patience => {
                tracing::warn!("trying again: {e}");
                tokio::time::sleep(wait).await;
                wait = (wait * 2).min(Duration::from_secs(5));
            }
            result => return result,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_to_a_limit() {
        let seconds: Vec<u64> = [1, 2, 3, 6, 60].map(|a| pause(a).as_secs()).to_vec();
        assert_eq!(seconds, [2, 4, 8, 60, 60]);
    }
}
