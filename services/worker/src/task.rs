//! One task, from its claim to its result.

use crate::cache::Cache;
use crate::child::{self, Ended, State};
use crate::health;
use crate::history;
use crate::log::Log;
use crate::outcome;
use crate::places::Places;
use crate::protocol::{History, Needs, OBJECTS, Order, Report, UPLOAD};
use crate::tell;
use crate::{Settings, WorkerError};
use gable_files::Source;
use gable_job_store::{
    Artifact, BlobId, Blobs, Cause, Claim, FetchLimits, Finished, JobStoreError, NewTask, Order as Word, Publication,
    Retry, Store,
};
use std::fmt;
use std::path::{Component, Path};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;

/// How long it may take until a worker hears that it is to stop, whose children have heard it.
const MOMENT: Duration = Duration::from_secs(2);

/// How often a task that a child adds is tried.
const ATTEMPTS: i64 = 3;

/// The same for a task without which nothing can come of the job: workers may die of something else.
const REQUIRED_ATTEMPTS: i64 = 6;

/// The first pause before another attempt; it doubles with each.
const PAUSE: Duration = Duration::from_secs(2);

/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// How long a task waits for a database or an object store that is away, before it is handed back.
const OUTAGE: Duration = Duration::from_secs(600);

/// How long blobs are held before their task is finished: longer than handing in takes.
const HOLD: Duration = Duration::from_secs(24 * 3600);

/// What a source in an object store may have: what one machine can split.
const FETCH: FetchLimits = FetchLimits { bytes: 1 << 40, objects: 1_000_000 };

/// What a task needs besides its claim.
pub(crate) struct Around<'a> {
    pub(crate) store: &'a Store,
    pub(crate) blobs: &'a Blobs,
    pub(crate) cache: &'a Cache,
    pub(crate) settings: &'a Settings,
    pub(crate) places: &'a Places,
    /// Becomes true when the worker is told to stop.
    pub(crate) stopping: watch::Receiver<bool>,
    pub(crate) state: &'a watch::Sender<State>,
    pub(crate) log: Arc<Log>,
}

/// What is known of a task's result before it is done.
enum Known {
    /// All of it.
    Outcome(Finished),
    /// The key under which it is to be kept, if it may be.
    Key(Option<String>),
}

/// What became of a task.
enum Made {
    Result(Finished),
    BadInput(String),
    Failed(String),
    /// Database or object store are away: another time.
    Away(String),
    /// The local disk is full, or cannot be written: another time, or elsewhere.
    NoDisk(String),
    /// It used more memory than it may here.
    NoMemory(String),
    /// This worker lacks something that it needs.
    Unfit(String),
    /// Its program was ended with the worker: the attempt does not count.
    Interrupted,
    Stopped,
}

impl fmt::Display for Made {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Result(result) if result.reused => write!(f, "taken over from an earlier job"),
            Self::Result(result) => write!(f, "done, {} files", result.artifacts.len()),
            Self::BadInput(reason) => write!(f, "bad input: {reason}"),
            Self::Failed(reason) => write!(f, "failed: {reason}"),
            Self::Away(reason) | Self::NoDisk(reason) => write!(f, "handed back: {reason}"),
            Self::NoMemory(reason) => write!(f, "failed: {reason}"),
            Self::Unfit(reason) => write!(f, "for another worker: {reason}"),
            Self::Interrupted | Self::Stopped => write!(f, "handed back"),
        }
    }
}

impl Made {
    /// What an error of the database, the object store or the local disk means for a task.
    fn of(what: &str, error: &JobStoreError) -> Self {
        let reason = format!("{what}: {error}");
        if let JobStoreError::File { source, .. } = error
            && health::is_local(source)
        {
            return Self::NoDisk(reason);
        }
        if error.is_transient() { Self::Away(reason) } else { Self::Failed(reason) }
    }
}

impl Around<'_> {
    /// Does a task and hands in what came of it. `drain` becomes true when the worker has no more time for it.
    pub(crate) async fn carry_out(&self, claim: &Claim, mut drain: watch::Receiver<bool>) -> Result<(), WorkerError> {
        let (stop, stopped) = watch::channel(false);
        let work = self.work(claim, stopped);
        tokio::pin!(work);
        let pace = self.settings.lease / 3;
        let mut beat = tokio::time::interval_at(tokio::time::Instant::now() + pace, pace);
        let mut draining = false;
        let made = loop {
            tokio::select! {
                // A result that is there is handed in before anything else.
                biased;
                made = &mut work => break made?,
                _ = beat.tick() => {
                    let phase = self.places.hide(&self.state.borrow().phase);
                    match self.store.heartbeat(claim, self.settings.lease, &phase).await {
                        Ok(Word::Continue) => {}
                        Ok(Word::Stop) => { stop.send_replace(true); }
                        // If the database stays away, the lease runs out, and the result will be refused.
                        Err(e) => tracing::warn!("no heartbeat: {e}"),
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
        let draining = draining && matches!(made, Made::Stopped | Made::Away(_));
        // Who has no more time hands in at once, or not at all: then the lease runs out.
        self.hand_in(claim, made, draining, drain).await
    }

    /// The body of a task. Only what would hit every task is an error.
    async fn work(&self, claim: &Claim, stop: watch::Receiver<bool>) -> Result<Made, WorkerError> {
        let folder = match tempfile::tempdir_in(&self.settings.folder) {
            Ok(folder) => folder,
            Err(e) if health::is_local(&e) => {
                return Ok(Made::NoDisk(format!("the worker's folder {}: {e}", self.settings.folder.display())));
            }
            Err(source) => return Err(WorkerError::Folder { path: self.settings.folder.clone(), source }),
        };
        let value = |text: &str| serde_json::from_str::<serde_json::Value>(text);
        let (Ok(request), Ok(input)) = (value(&claim.request), value(&claim.input)) else {
            return Ok(Made::BadInput("its request or its input is no JSON".to_owned()));
        };
        let needs: Needs = match serde_json::from_value(input.clone()) {
            Ok(needs) => needs,
            Err(e) => return Ok(Made::BadInput(format!("what its input says that it needs: {e}"))),
        };
        if let Some(reason) = self.does_not_see(&request, claim.stage, &needs) {
            return Ok(Made::Unfit(reason));
        }
        self.say("fetching");
        let (known, history, read) = match self.look(claim, &input, &needs, &stop).await {
            Ok(found) => found,
            Err(e) => return Ok(Made::of("looking for its input", &e)),
        };
        let key = match known {
            Known::Outcome(result) => return Ok(Made::Result(result)),
            Known::Key(key) => key,
        };
        if let Err(e) = self.fetch(claim, &read, folder.path(), &stop).await {
            return Ok(Made::of("fetching its input", &e));
        }
        if let Some(id) = &needs.upload {
            let files = match self.patiently(claim, &stop, OUTAGE, || self.store.upload_files(id)).await {
                Ok(files) if files.is_empty() => {
                    return Ok(Made::BadInput(format!("upload {id} is not there any more: send the mesh again")));
                }
                Ok(files) => files,
                Err(e) => return Ok(Made::of("looking for its upload", &e)),
            };
            if let Err(e) = self.fetch(claim, &files, &folder.path().join(UPLOAD), &stop).await {
                return Ok(Made::of("fetching its upload", &e));
            }
        }
        if let Some(place) = &needs.objects {
            match self.fetch_objects(claim, place, &folder.path().join(OBJECTS), &stop).await {
                Ok(()) => {}
                Err(e @ JobStoreError::Fetch { .. }) => return Ok(Made::BadInput(e.to_string())),
                Err(e) => return Ok(Made::of(&format!("fetching {place}"), &e)),
            }
        }
        let order = Order { request, stage: claim.stage, unit: claim.unit.clone(), input, history };
        self.say("running");
        let settings = self.settings;
        let told = stop.clone();
        let ended =
            child::run(&settings.program, folder.path(), &order, settings.limits, told, self.state, &self.log).await?;
        Ok(match ended {
            Ended::Stopped => Made::Stopped,
            Ended::BadInput(reason) => Made::BadInput(reason),
            // A supervisor that ends a whole group of processes ends the children with their worker, and may come to them first.
            Ended::Told(reason) => match self.is_stopping().await {
                true => Made::Interrupted,
                false => Made::Failed(reason),
            },
            Ended::Badly(reason) if health::says_local(&reason) => Made::NoDisk(reason),
            Ended::Badly(reason) if Cause::of(&reason) == Some(Cause::Memory) => Made::NoMemory(reason),
            Ended::Badly(reason) => Made::Failed(reason),
            Ended::Well(report) => {
                self.say("handing in");
                match self.keep(claim, &report, folder.path(), &stop).await {
                    Ok((artifacts, publication)) => {
                        let tasks = additions(report);
                        Made::Result(Finished { artifacts, tasks, reused: false, key, publication })
                    }
                    Err(e) => Made::of("keeping its result", &e),
                }
            }
        })
    }

    /// Repeats a call while the database or the object store is away, for as long as that is worth while. What is waited for is told: as the
    /// phase of the task, as an event of the job, and with the worker.
    async fn patiently<T, F: Future<Output = Result<T, JobStoreError>>>(
        &self,
        claim: &Claim,
        stop: &watch::Receiver<bool>,
        patience: Duration,
        call: impl Fn() -> F,
    ) -> Result<T, JobStoreError> {
        let begin = tokio::time::Instant::now();
        let (mut wait, mut told) = (Duration::from_millis(100), false);
        loop {
            match call().await {
                Err(e) if e.is_transient() && begin.elapsed() < patience && !*stop.borrow() => {
                    tracing::warn!("trying again: {e}");
                    let reason = e.to_string();
                    self.settings.health.waits(Some(&reason));
                    self.state.send_modify(|s| s.phase = format!("waits: {reason}"));
                    // The database itself may be what is away.
                    told = told || self.store.note_waiting(claim, &self.places.hide(&reason)).await.is_ok();
                    let mut stop = stop.clone();
                    tokio::select! {
                        () = tokio::time::sleep(wait) => {}
                        // Also if whoever could say so is gone.
                        _ = stop.wait_for(|&s| s) => {}
                    }
                    wait = (wait * 2).min(Duration::from_secs(5));
                }
                result => {
                    if wait > Duration::from_millis(100) {
                        self.settings.health.waits(None);
                    }
                    return result;
                }
            }
        }
    }

    /// Whether the worker is told to stop, now or within a moment.
    async fn is_stopping(&self) -> bool {
        let mut stopping = self.stopping.clone();
        let told = tokio::time::timeout(MOMENT, stopping.wait_for(|&stop| stop)).await;
        matches!(told, Ok(Ok(_)))
    }

    fn say(&self, phase: &str) {
        self.log.say(phase);
        self.state.send_modify(|s| s.phase = phase.to_owned());
    }

    /// What a task reads, what happened before if it wants to know, and whether its result is known already.
    async fn look(
        &self,
        claim: &Claim,
        input: &serde_json::Value,
        needs: &Needs,
        stop: &watch::Receiver<bool>,
    ) -> Result<(Known, Option<History>, Vec<Artifact>), JobStoreError> {
        let read = self.patiently(claim, stop, OUTAGE, || self.store.artifacts_at(&claim.job, &needs.reads)).await?;
        let history = if needs.history {
            let tasks = self.patiently(claim, stop, OUTAGE, || self.store.tasks(&claim.job)).await?;
            Some(history::before(claim.stage, &tasks))
        } else {
            None
        };
        if !needs.reuse {
            return Ok((Known::Key(None), history, read));
        }
        let key = outcome::key(claim, input, &read, history.as_ref());
        let known = self.patiently(claim, stop, OUTAGE, || self.store.outcome(claim, &key)).await?;
        Ok((known.map_or(Known::Key(Some(key)), Known::Outcome), history, read))
    }

    /// Lays out what a task reads.
    async fn fetch(
        &self,
        claim: &Claim,
        read: &[Artifact],
        folder: &Path,
        stop: &watch::Receiver<bool>,
    ) -> Result<(), JobStoreError> {
        for artifact in read {
            let place = folder.join(&artifact.path);
            self.patiently(claim, stop, OUTAGE, || self.cache.lay(self.blobs, artifact.blob, &place)).await?;
        }
        Ok(())
    }

    /// Why this worker does not see the source of a task that reads one, if it does not: it has not the source root in which that lies.
    fn does_not_see(&self, request: &serde_json::Value, stage: i64, needs: &Needs) -> Option<String> {
        let roots = &self.settings.roots;
        let unseen =
            |source: &str| format!("the source {source} lies under no source root of this worker (--source-root)");
        if let Some(place) = &needs.objects {
            return (!matches!(roots.locate(place), Ok(Source::Objects(_)))).then(|| unseen(place));
        }
        let source = request.get("source").and_then(serde_json::Value::as_str)?;
        if stage != 0 || needs.upload.is_some() || roots.places().next().is_none() || roots.locate(source).is_ok() {
            return None;
        }
        // What should lie in a root that is here, and does not, is not there for anybody.
        let path = Path::new(source);
        let here = path.is_absolute() && roots.places().any(|root| path.starts_with(&root) && root.is_dir());
        (!here).then(|| unseen(source))
    }

    /// Lays out the objects that are a task's source.
    async fn fetch_objects(
        &self,
        claim: &Claim,
        place: &str,
        folder: &Path,
        stop: &watch::Receiver<bool>,
    ) -> Result<(), JobStoreError> {
        let variables: Vec<(String, String)> = std::env::vars().collect();
        self.patiently(claim, stop, OUTAGE, || async {
            gable_job_store::fetch_objects(place, variables.clone(), folder, FETCH).await.map(drop)
        })
        .await
    }

    /// Keeps what a task made; with the city that it finished.
    async fn keep(
        &self,
        claim: &Claim,
        report: &Report,
        folder: &Path,
        stop: &watch::Receiver<bool>,
    ) -> Result<(Vec<Artifact>, Option<Publication>), JobStoreError> {
        let mut kept = Vec::new();
        for path in &report.made {
            let file = folder.join(path);
            let wrong = |source| JobStoreError::File { path: file.clone(), source };
            if !Path::new(path).components().all(|c| matches!(c, Component::Normal(_))) {
                return Err(wrong(std::io::Error::other("it lies outside of the task's folder")));
            }
            if !tokio::fs::symlink_metadata(&file).await.map_err(wrong)?.is_file() {
                return Err(wrong(std::io::Error::other("it is no file of its own")));
            }
            let (blob, bytes) = BlobId::of_file(&file).await?;
            kept.push(Artifact { path: path.clone(), blob, bytes });
        }
        self.hold(claim, &kept, stop).await?;
        for artifact in &kept {
            let file = folder.join(&artifact.path);
            self.patiently(claim, stop, OUTAGE, || self.blobs.put_file(artifact.blob, &file)).await?;
            self.cache.keep(artifact.blob, &file).await?;
        }
        let city = match &report.city {
            Some(city) if report.made.contains(&city.buildings) => Some(outcome::publication(city, folder).await?),
            Some(city) => {
                let source = std::io::Error::other("it lists the buildings, and is not among the files that were made");
                return Err(JobStoreError::File { path: city.buildings.clone().into(), source });
            }
            None => None,
        };
        Ok((kept, city))
    }

    /// Keeps what is about to be referred to from being collected.
    async fn hold(&self, claim: &Claim, made: &[Artifact], stop: &watch::Receiver<bool>) -> Result<(), JobStoreError> {
        let blobs: Vec<BlobId> = made.iter().map(|a| a.blob).collect();
        // What is being removed just now is gone soon.
        while !self.patiently(claim, stop, OUTAGE, || self.store.hold(&blobs, HOLD)).await? && !*stop.borrow() {
            tokio::time::sleep(Duration::from_millis(200)).await;
        }
        Ok(())
    }

    async fn hand_in(
        &self,
        claim: &Claim,
        made: Made,
        draining: bool,
        stop: watch::Receiver<bool>,
    ) -> Result<(), WorkerError> {
        let patience = if draining { self.settings.lease } else { OUTAGE };
        let (_never, quiet) = watch::channel(false);
        let stop = if draining { quiet } else { stop };
        let ours = draining || !matches!(made, Made::Stopped);
        self.log.say(&made.to_string());
        match &made {
            Made::Result(result) if !result.reused => self.settings.health.done(),
            Made::Failed(reason) | Made::NoMemory(reason) => self.settings.health.failed(claim, reason),
            Made::NoDisk(reason) => self.settings.health.no_folder(reason),
            _ => {}
        }
        // What users see. The service's own log tells operators the paths as they are.
        let log = self.places.hide(&self.log.text());
        let shown = |reason: &str| self.places.hide(reason);
        let told = self
            .patiently(claim, &stop, patience, || async {
                if ours {
                    self.store.keep_log(claim, &log).await?;
                }
                match &made {
                    Made::Result(result) => self.store.finish(claim, result).await.map(Some),
                    Made::BadInput(reason) => self.store.fail(claim, &shown(reason), Retry::Never).await.map(Some),
                    Made::Failed(reason) => {
                        self.store.fail(claim, &shown(reason), Retry::After(pause(claim.attempt))).await.map(Some)
                    }
                    Made::NoMemory(reason) => {
                        let retry = Retry::WithMemory(pause(claim.attempt), self.settings.limits.memory);
                        self.store.fail(claim, &shown(reason), retry).await.map(Some)
                    }
                    Made::Unfit(reason) => self.store.fail(claim, &shown(reason), Retry::Elsewhere).await.map(Some),
                    Made::Away(reason) | Made::NoDisk(reason) => {
                        self.store.release_for(claim, &shown(reason)).await.map(Some)
                    }
                    Made::Interrupted => self.store.release(claim).await.map(Some),
                    Made::Stopped if draining => self.store.release(claim).await.map(Some),
                    // A heartbeat was told so before there was a result to refuse.
                    Made::Stopped => Ok(None),
                }
            })
            .await;
        let (outcome, reason) = match (&told, &made) {
            (Ok(None), _) | (Err(JobStoreError::Lost { .. }), _) => ("lost", None),
            (Ok(_), Made::Result(result)) => (if result.reused { "reused" } else { "done" }, None),
            (Ok(_), Made::BadInput(reason) | Made::Failed(reason) | Made::NoMemory(reason)) => {
                ("failed", Some(reason.clone()))
            }
            (Ok(_), Made::Away(reason) | Made::NoDisk(reason) | Made::Unfit(reason)) => {
                ("handed-back", Some(reason.clone()))
            }
            (Ok(_), Made::Interrupted | Made::Stopped) => ("handed-back", None),
            (Err(JobStoreError::NoOutcome { .. }), _) => ("handed-back", None),
            (Err(e), _) => ("lost", Some(format!("not handed in: {e}"))),
        };
        let span = tracing::Span::current();
        span.record("outcome", outcome);
        span.record("reason", reason);
        match told {
            Ok(Some(followed)) => {
                match &made {
                    Made::Result(result) => tell::done(result.artifacts.len(), result.reused, &followed),
                    Made::BadInput(reason) | Made::Failed(reason) | Made::NoMemory(reason) => {
                        tell::failed(reason, pause(claim.attempt), &followed)
                    }
                    Made::Away(reason) | Made::NoDisk(reason) => tracing::warn!(reason, "task handed back"),
                    Made::Unfit(reason) => tracing::warn!(reason, "task left to other workers"),
                    Made::Interrupted | Made::Stopped => tracing::info!("task handed back"),
                }
                Ok(())
            }
            Ok(None) => {
                tracing::info!("the task is no longer held here: its result is thrown away");
                Ok(())
            }
            // It was forgotten just now: the task is handed back, and done.
            Err(JobStoreError::NoOutcome { .. }) => {
                if let Err(e) = self.store.release(claim).await {
                    tracing::warn!("not handed back: {e}");
                }
                Ok(())
            }
            Err(e @ JobStoreError::Lost { .. }) => {
                tracing::info!("{e}: its result is thrown away");
                Ok(())
            }
            // The lease will run out, and another worker will take the task.
            Err(e) => {
                tracing::error!("not handed in: {e}");
                Ok(())
            }
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
            max_attempts: if t.required { REQUIRED_ATTEMPTS } else { ATTEMPTS },
        })
        .collect()
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
