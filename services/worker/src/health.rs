//! How a node does: all workers of a process share it.
//!
//! A node on which several different tasks have failed in a row takes no more tasks, if there is another node on which they did not fail
//! as well: what is wrong is then the node, not the tasks. After a rest it tries one again. One whose folder cannot be written takes none
//! until it can.

use gable_job_store::{Claim, JobStoreError, Store};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// So many different tasks that fail in a row are no chance.
const MANY: usize = 5;

/// How often it is asked again whether the node or the tasks are to blame, or whether the folder can be written.
const LOOK: Duration = Duration::from_secs(2);

/// How long a node rests before it tries a task again.
pub const REST: Duration = Duration::from_secs(300);

/// Whether a worker may take a task.
#[derive(Debug, Default)]
pub struct Health(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    /// Tasks that failed since one was done.
    failed: Vec<(String, i64, String)>,
    /// Why the last of them failed.
    reason: String,
    /// What is wrong.
    trouble: Option<Trouble>,
    /// What tasks wait for just now.
    waits: Option<String>,
    looked: Option<Instant>,
}

#[derive(Debug)]
struct Trouble {
    text: String,
    /// Since when it rests.
    since: Instant,
    /// Whether it is the folder.
    local: bool,
}

impl Health {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why the node takes no tasks, if it takes none.
    #[must_use]
    pub fn trouble(&self) -> Option<String> {
        let state = self.state();
        state.trouble.as_ref().map(|t| t.text.clone()).or_else(|| state.waits.clone())
    }

    /// Tasks wait for something that is away; none when it is there again.
    pub(crate) fn waits(&self, reason: Option<&str>) {
        self.state().waits = reason.map(|reason| format!("waits: {reason}"));
    }

    /// A task was done here.
    pub(crate) fn done(&self) {
        let mut state = self.state();
        state.failed.clear();
        if state.trouble.take().is_some() {
            tracing::info!("a task was done here: this worker takes tasks again");
        }
    }

    /// A task failed here.
    pub(crate) fn failed(&self, claim: &Claim, reason: &str) {
        let mut state = self.state();
        let task = (claim.job.clone(), claim.stage, claim.unit.clone());
        if !state.failed.contains(&task) {
            state.failed.push(task);
        }
        reason.clone_into(&mut state.reason);
    }

    /// The folder of the tasks cannot be written.
    pub(crate) fn no_folder(&self, reason: &str) {
        let mut state = self.state();
        if state.trouble.as_ref().is_none_or(|t| !t.local) {
            tracing::error!(reason, "this worker takes no tasks until its folder can be written");
            let text = format!("its folder cannot be written: {reason}");
            state.trouble = Some(Trouble { text, since: Instant::now(), local: true });
        }
        state.looked = Some(Instant::now());
    }

    /// Whether a worker of the node may take a task now.
    pub(crate) async fn may_claim(
        &self,
        store: &Store,
        node: &str,
        folder: &Path,
        rest: Duration,
    ) -> Result<bool, JobStoreError> {
        let (suspects, local) = {
            let mut state = self.state();
            let local = state.trouble.as_ref().is_some_and(|t| t.local);
            if !local && state.failed.len() < MANY {
                return Ok(true);
            }
            if state.looked.is_some_and(|at| at.elapsed() < LOOK) {
                return Ok(state.trouble.is_none());
            }
            state.looked = Some(Instant::now());
            (state.failed.clone(), local)
        };
        if local {
            return Ok(self.folder_is_back(folder));
        }
        let verdict = store.judge(node, &suspects).await?;
        let mut state = self.state();
        if !verdict.others || 2 * verdict.failed_elsewhere >= suspects.len() {
            // Nobody else could do better, or the tasks are to blame.
            state.trouble = None;
            return Ok(true);
        }
        let (count, reason) = (suspects.len(), state.reason.clone());
        match &mut state.trouble {
            Some(trouble) if trouble.since.elapsed() >= rest => {
                trouble.since = Instant::now();
                tracing::warn!("this worker tries a task again");
                Ok(true)
            }
            Some(_) => Ok(false),
            None => {
                tracing::error!(count, reason, "this worker takes no more tasks: different tasks failed here in a row");
                let text = format!("{count} different tasks failed here in a row, the last one: {reason}");
                state.trouble = Some(Trouble { text, since: Instant::now(), local: false });
                Ok(false)
            }
        }
    }

    fn folder_is_back(&self, folder: &Path) -> bool {
        let written = tempfile::NamedTempFile::new_in(folder)
            .and_then(|mut file| std::io::Write::write_all(&mut file, &[0; 1 << 16]));
        if written.is_ok() {
            tracing::info!("the folder can be written again: this worker takes tasks");
            self.state().trouble = None;
        }
        written.is_ok()
    }
}

/// Whether an error says that the local disk is full, or cannot be written.
pub(crate) fn is_local(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
    matches!(error.kind(), PermissionDenied | QuotaExceeded | ReadOnlyFilesystem | StorageFull)
}

/// Whether a child says so, by the numbers of ENOSPC, EROFS and EDQUOT.
pub(crate) fn says_local(reason: &str) -> bool {
    ["(os error 28)", "(os error 30)", "(os error 122)"].iter().any(|number| reason.contains(number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_job_store::Worker;

    fn claim(unit: &str) -> Claim {
        Claim {
            job: "j".to_owned(),
            city: "delft".to_owned(),
            request: String::new(),
            stage: 1,
            unit: unit.to_owned(),
            input: String::new(),
            fence: 1,
            attempt: 1,
            node: "here".to_owned(),
        }
    }

    async fn store(folder: &Path) -> Store {
        Store::connect(&format!("sqlite:{}", folder.join("jobs.db").display())).await.expect("opens")
    }

    fn other() -> Worker {
        Worker {
            id: "w".to_owned(),
            host: "there".to_owned(),
            pid: 1,
            version: String::new(),
            started: 0,
            seen: 0,
            task: None,
            memory: 0,
            node: "there".to_owned(),
            task_memory: 1,
            trouble: None,
        }
    }

    #[tokio::test]
    async fn a_node_rests_when_different_tasks_fail_and_there_is_another() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = store(folder.path()).await;
        let may = async |health: &Health, rest| {
            health.state().looked = None;
            health.may_claim(&store, "here", folder.path(), rest).await.expect("asks")
        };
        let health = Health::default();
        for _ in 0..2 * MANY {
            health.failed(&claim("same"), "no");
        }
        assert!(may(&health, REST).await, "one task that fails is its own fault");
        for n in 0..MANY {
            health.failed(&claim(&n.to_string()), "the disk is broken");
        }
        assert!(may(&health, REST).await && health.trouble().is_none(), "nobody else could do better");
        store.see_worker(&other()).await.expect("seen");
        assert!(!may(&health, REST).await);
        let trouble = health.trouble().expect("it says so");
        assert!(trouble.starts_with("6 different tasks") && trouble.contains("the disk is broken"), "{trouble}");
        assert!(may(&health, Duration::ZERO).await, "after its rest it tries one");
        assert!(!may(&health, REST).await && health.trouble().is_some());
        health.done();
        assert!(may(&health, REST).await && health.trouble().is_none());
    }

    #[tokio::test]
    async fn a_folder_that_cannot_be_written_is_waited_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = store(folder.path()).await;
        let gone = folder.path().join("gone");
        let health = Health::default();
        health.no_folder("no space left");
        let may = async || {
            health.state().looked = None;
            health.may_claim(&store, "here", &gone, REST).await.expect("asks")
        };
        assert!(!may().await && health.trouble().expect("told").contains("no space left"));
        std::fs::create_dir(&gone).expect("made");
        assert!(may().await && health.trouble().is_none());
        assert!(says_local("mesh: No space left on device (os error 28)") && !says_local("os error 2"));
    }
}
