//! The loop: claim, do, claim.

use crate::cache::Cache;
use crate::child::State;
use crate::health::Health;
use crate::log::Log;
use crate::places::Places;
use crate::task::Around;
use crate::tell;
use crate::version::version;
use crate::{Limits, WorkerError};
use gable_files::SourceRoots;
use gable_job_store::{Anew, Blobs, Claim, Claimant, JobStoreError, Store, Worker as Seen};
use std::convert::Infallible;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::watch;
use tracing::Instrument as _;

/// How often a worker says that it is alive, at least.
const SEEN: Duration = Duration::from_secs(5);

/// How long nothing has to go on at a job whose version has no worker left, before it is begun anew: workers that start again are there by
/// then.
const IDLE: Duration = Duration::from_secs(20);

/// How a worker works.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Its name, unique among all workers that ever were.
    pub id: String,
    /// Name of its machine.
    pub host: String,
    /// Name of its process, unique among all that ever were.
    pub node: String,
    /// How its process does.
    pub health: Arc<Health>,
    /// How long a process that failed different tasks in a row rests.
    pub rest: Duration,
    /// Name of a stage by its number, as people know it.
    pub stage_name: fn(i64) -> &'static str,
    /// Which meshes it may read.
    pub roots: SourceRoots,
    /// The program that does the tasks, with its arguments.
    pub program: Vec<OsString>,
    /// Where tasks have their folders.
    pub folder: PathBuf,
    /// Where fetched blobs stay, on the same disk; workers may share it.
    pub blobs: PathBuf,
    /// Bytes of fetched blobs that stay.
    pub cache: u64,
    /// How long a task is held without a heartbeat; there are three in it.
    pub lease: Duration,
    /// What a child may use.
    pub limits: Limits,
    /// How often to look for a task when there is none.
    pub pace: Duration,
    /// How long tasks under way may go on after the worker was told to stop.
    pub grace: Duration,
}

/// A worker; it does one task at a time. For more, run several; they may share a folder.
#[derive(Debug)]
pub struct Worker {
    store: Store,
    blobs: Blobs,
    cache: Cache,
    settings: Settings,
    /// What users are not told.
    places: Places,
    version: String,
    state: watch::Sender<State>,
    /// The task under way.
    task: Mutex<Option<String>>,
}

impl Worker {
    /// A worker with its folder, which is made if it is not there.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn new(store: Store, blobs: Blobs, settings: Settings) -> Result<Self, WorkerError> {
        std::fs::create_dir_all(&settings.folder)
            .map_err(|source| WorkerError::Folder { path: settings.folder.clone(), source })?;
        let cache = Cache::open(&settings.blobs, settings.cache)?;
        let roots: Vec<PathBuf> = settings.roots.places().collect();
        let own = settings.roots.own().iter().map(PathBuf::as_path).chain([&*settings.blobs]);
        let places = Places::new(roots.iter().map(PathBuf::as_path), &settings.folder, own);
        Ok(Self {
            store,
            blobs,
            cache,
            settings,
            places,
            version: version(),
            state: watch::Sender::new(State::default()),
            task: Mutex::new(None),
        })
    }

    /// Works until `stop` becomes true.
    ///
    /// # Errors
    /// What would hit every task: the worker's folder or its program. While the database is away, the worker waits.
    pub async fn run(&self, stop: watch::Receiver<bool>) -> Result<(), WorkerError> {
        let ended = tokio::select! {
            ended = self.work(stop) => ended,
            never = self.be_seen() => match never {},
        };
        // Nobody is to wait for it.
        if let Err(e) = self.store.part_from_worker(&self.settings.id).await {
            tracing::warn!("the worker cannot say that it has stopped: {e}");
        }
        ended
    }

    async fn work(&self, mut stop: watch::Receiver<bool>) -> Result<(), WorkerError> {
        let (drain, drained) = watch::channel(false);
        while !*stop.borrow() {
            match self.claim().await {
                Ok(Some(claim)) => {
                    // Every line that is logged about the task says which it is.
                    let span = tracing::info_span!(
                        "task",
                        job = claim.job,
                        city = claim.city,
                        stage = (self.settings.stage_name)(claim.stage),
                        unit = claim.unit,
                        attempt = claim.attempt,
                        worker = self.settings.id,
                        outcome = tracing::field::Empty,
                        reason = tracing::field::Empty,
                    );
                    span.in_scope(|| tracing::info!("task claimed"));
                    let around = Around {
                        store: &self.store,
                        blobs: &self.blobs,
                        cache: &self.cache,
                        settings: &self.settings,
                        places: &self.places,
                        stopping: stop.clone(),
                        state: &self.state,
                        log: Arc::new(Log::new()),
                    };
                    let task = around.carry_out(&claim, drained.clone()).instrument(span);
                    tokio::pin!(task);
                    tokio::select! {
                        ended = &mut task => ended?,
                        () = stopped(&mut stop) => {
                            if let Ok(ended) = tokio::time::timeout(self.settings.grace, &mut task).await {
                                ended?;
                            } else {
                                drain.send_replace(true);
                                task.await?;
                            }
                        }
                    }
                    self.state.send_replace(State::default());
                    self.cache.tidy();
                }
                Ok(None) => self.wait(&mut stop).await,
                Err(e) => {
                    tracing::warn!("no task can be had: {e}");
                    self.wait(&mut stop).await;
                }
            }
        }
        Ok(())
    }

    async fn wait(&self, stop: &mut watch::Receiver<bool>) {
        tokio::select! {
            () = tokio::time::sleep(self.settings.pace) => {}
            () = stopped(stop) => {}
        }
    }

    async fn claim(&self) -> Result<Option<Claim>, JobStoreError> {
        self.reap().await?;
        let Settings { id, node, folder, health, rest, .. } = &self.settings;
        let by = Claimant {
            worker: id.clone(),
            node: node.clone(),
            task_memory: i64::try_from(self.settings.limits.memory).unwrap_or(i64::MAX),
            version: self.version.clone(),
        };
        let claim = match health.may_claim(&self.store, node, folder, *rest).await? {
            true => self.store.claim_as(&by, self.settings.lease).await?,
            false => None,
        };
        // Who has nothing to do looks for jobs that nobody goes on with.
        if claim.is_none() {
            for Anew { job, before } in self.store.begin_anew(&by, IDLE).await? {
                tracing::warn!(job, before, "job begun anew: no worker is left of the version that had begun it");
            }
        }
        let name = claim.as_ref().map(|c| format!("{} {} {}", c.job, c.stage, c.unit));
        *self.task.lock().unwrap_or_else(PoisonError::into_inner) = name;
        Ok(claim)
    }

    /// Takes back what others have lost.
    async fn reap(&self) -> Result<(), JobStoreError> {
        for task in self.store.reap().await? {
            tell::reaped(&task, (self.settings.stage_name)(task.stage));
        }
        Ok(())
    }

    /// Says from time to time that the worker is alive, and what it does; and takes back what others have lost, for all workers may be busy.
    async fn be_seen(&self) -> Infallible {
        loop {
            let seen = Seen {
                id: self.settings.id.clone(),
                host: self.settings.host.clone(),
                pid: i64::from(std::process::id()),
                version: self.version.clone(),
                started: 0,
                seen: 0,
                task: self.task.lock().unwrap_or_else(PoisonError::into_inner).clone(),
                memory: i64::try_from(self.state.borrow().memory).unwrap_or(i64::MAX),
                node: self.settings.node.clone(),
                task_memory: i64::try_from(self.settings.limits.memory).unwrap_or(i64::MAX),
                trouble: self.settings.health.trouble().map(|trouble| self.places.hide(&trouble)),
            };
            if let Err(e) = self.store.see_worker(&seen).await {
                tracing::warn!("the worker cannot say that it is alive: {e}");
            } else if let Err(e) = self.reap().await {
                tracing::warn!("what others have lost cannot be taken back: {e}");
            }
            tokio::time::sleep(SEEN.min(self.settings.lease / 3)).await;
        }
    }
}

/// Ends when the worker is to stop, or whoever could tell it to is gone.
async fn stopped(stop: &mut watch::Receiver<bool>) {
    let _ = stop.wait_for(|&s| s).await;
}
