//! What the programs of tasks said.

use crate::database::one_row;
use crate::texts::kept;
use crate::{Claim, JobStoreError, Store};
use sqlx::Row;

/// What the last attempt at a task said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskLog {
    /// Stage of the task.
    pub stage: i64,
    /// Which attempt it was, from 1.
    pub attempt: i64,
    /// Its last lines.
    pub text: String,
}

impl Store {
    /// Keeps what an attempt at a task said, in place of what the one before it said; to be called before the task is handed in.
    ///
    /// # Errors
    /// [`JobStoreError::Lost`] if the task is no longer the worker's; then nothing is changed.
    pub async fn keep_log(&self, claim: &Claim, text: &str) -> Result<(), JobStoreError> {
        let statement = "INSERT INTO task_log (job, stage, unit, attempt, log) \
                         SELECT job, stage, unit, attempts, CAST($5 AS TEXT) FROM task \
                         WHERE job = $1 AND stage = $2 AND unit = $3 AND fence = $4 AND state = 'running' \
                         ON CONFLICT (job, stage, unit) DO UPDATE SET attempt = excluded.attempt, log = excluded.log";
        let kept = sqlx::query(statement)
            .bind(&claim.job)
            .bind(claim.stage)
            .bind(&claim.unit)
            .bind(claim.fence)
            .bind(kept(text))
            .execute(&self.pool)
            .await?;
        if one_row(&kept) { Ok(()) } else { Err(claim.lost()) }
    }

    /// What the last attempts at a unit's tasks said, by stage. Those whose worker fell silent have left nothing: then it is what the
    /// attempt before said.
    ///
    /// # Errors
    /// [`JobStoreError::NoJob`] if there is no such job.
    pub async fn logs(&self, job: &str, unit: &str) -> Result<Vec<TaskLog>, JobStoreError> {
        self.job(job).await?;
        let rows = sqlx::query("SELECT stage, attempt, log FROM task_log WHERE job = $1 AND unit = $2 ORDER BY stage")
            .bind(job)
            .bind(unit)
            .fetch_all(&self.pool)
            .await?;
        let read = |row: &sqlx::any::AnyRow| {
            Ok(TaskLog { stage: row.try_get("stage")?, attempt: row.try_get("attempt")?, text: row.try_get("log")? })
        };
        rows.iter().map(read).collect()
    }
}
