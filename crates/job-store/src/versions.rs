//! Versions of the program: the results of one job come from one.
//!
//! The first worker that takes a task of a job binds the job to its version; workers of other versions leave it alone. So during an
//! upgrade jobs under way end with the workers they began with. When none of these is left, and nothing has gone on for a while, a worker
//! of another version begins the job anew: what its tasks had added and made is forgotten, as if it had just been submitted.

use crate::events::About;
use crate::nodes::THERE;
use crate::{Claimant, EventKind, JobState, JobStoreError, Store};
use sqlx::Row;
use std::time::Duration;

/// A job that was begun anew.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Anew {
    /// Id of the job.
    pub job: String,
    /// The version that had begun it.
    pub before: String,
}

impl Store {
    /// Lets jobs begin anew that were begun by a version of which no worker is left, and at which nothing went on for `idle`; gives them. Every
    /// worker may call it at any time.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn begin_anew(&self, by: &Claimant, idle: Duration) -> Result<Vec<Anew>, JobStoreError> {
        let statement = "SELECT id, program FROM job WHERE state IN ('accepted', 'running') AND program <> $1 \
                         AND NOT EXISTS (SELECT 1 FROM worker AS w WHERE w.version = job.program AND w.seen > {now} - $2) \
                         AND NOT EXISTS (SELECT 1 FROM task WHERE task.job = job.id \
                         AND (task.state = 'running' OR task.finished > {now} - $3)) LIMIT 8";
        let idle = i64::try_from(idle.as_millis()).unwrap_or(i64::MAX / 4);
        let query = sqlx::query(self.sql(statement)).bind(&by.version).bind(THERE).bind(idle);
        let mut begun = Vec::new();
        for row in query.fetch_all(&self.pool).await? {
            let anew = Anew { job: row.try_get("id")?, before: row.try_get("program")? };
            if self.forget_progress(&anew, &by.version).await? {
                begun.push(anew);
            }
        }
        Ok(begun)
    }

    /// Puts a job back to its submission; false if it has gone on, or another was quicker.
    async fn forget_progress(&self, anew: &Anew, version: &str) -> Result<bool, JobStoreError> {
        let Anew { job: id, before } = anew;
        let mut tx = self.begin().await?;
        let job = self.locked(&mut tx, id).await?;
        if !matches!(job.state, JobState::Accepted | JobState::Running) {
            return Ok(false);
        }
        // Tasks that the submission has added have no other origin.
        let statement = "UPDATE job SET program = NULL, stage = (SELECT MIN(stage) FROM task WHERE job = $1 AND origin < 0) \
                         WHERE id = $1 AND program = $2 \
                         AND NOT EXISTS (SELECT 1 FROM task WHERE job = $1 AND state = 'running')";
        let taken = sqlx::query(statement).bind(id).bind(before).execute(&mut *tx).await?;
        if !crate::database::one_row(&taken) {
            return Ok(false);
        }
        for statement in [
            "DELETE FROM task WHERE job = $1 AND origin >= 0",
            "DELETE FROM task_node WHERE job = $1",
            "DELETE FROM task_log WHERE job = $1",
            "DELETE FROM artifact WHERE job = $1",
            "UPDATE task SET state = 'ready', attempts = 0, losses = 0, needs_memory = 0, not_before = 0, reason = NULL, \
             phase = NULL, worker = NULL, lease_until = NULL, started = NULL, finished = NULL WHERE job = $1",
        ] {
            sqlx::query(statement).bind(id).execute(&mut *tx).await?;
        }
        let message =
            format!("begun anew by gable {version}: gable {before} had begun it, and no worker of that is left");
        self.note(&mut tx, id, EventKind::Retry, About { message: Some(&message), ..About::default() }).await?;
        self.commit(tx).await?;
        Ok(true)
    }
}
