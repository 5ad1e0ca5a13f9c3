//! Tasks: one unit of one stage each.

use crate::database::Tx;
use crate::names::named;
use crate::{JobStoreError, Store};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use sqlx::any::AnyRow;
use std::collections::BTreeMap;

named! {
    /// State of a task.
    TaskState, "state of a task", {
        /// Waits for its stage, or for a worker.
        Ready = "ready",
        /// A worker holds it.
        Running = "running",
        /// Done.
        Done = "done",
        /// Done earlier on the same input: its result was taken over.
        Reused = "reused",
        /// Failed for good.
        Failed = "failed",
        /// Its job ended before it was done.
        Cancelled = "cancelled",
    }
}

impl TaskState {}

/// A task to be added to a job.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NewTask {
    /// Tasks of a stage begin when no task of an earlier one is left.
    pub stage: i64,
    /// Name of the unit, unique in its stage, such as the block `3_7`.
    pub unit: String,
    /// What the worker needs to know, as JSON.
    pub input: String,
    /// Whether the job fails if it fails.
    pub required: bool,
    /// How often it is tried.
    pub max_attempts: i64,
}

/// A task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Task {
    /// Stage.
    pub stage: i64,
    /// Name of the unit.
    pub unit: String,
    /// State.
    pub state: TaskState,
    /// How often it was claimed.
    pub attempts: i64,
    /// Who holds it, or held it last.
    pub worker: Option<String>,
    /// What its worker said last about how far it is.
    pub phase: Option<String>,
    /// Why the last attempt failed.
    pub reason: Option<String>,
    /// When the last attempt began, milliseconds since 1970.
    pub started: Option<i64>,
    /// When it ended, milliseconds since 1970.
    pub finished: Option<i64>,
}

impl Task {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            stage: row.try_get("stage")?,
            unit: row.try_get("unit")?,
            state: row.try_get::<&str, _>("state")?.parse()?,
            attempts: row.try_get("attempts")?,
            worker: row.try_get("worker")?,
            phase: row.try_get("phase")?,
            reason: row.try_get("reason")?,
            started: row.try_get("started")?,
            finished: row.try_get("finished")?,
        })
    }
}

/// How many tasks a job has, by stage and state.
pub type TaskCounts = BTreeMap<(i64, TaskState), i64>;

impl Store {
    /// The tasks of a job, by stage and unit.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn tasks(&self, job: &str) -> Result<Vec<Task>, JobStoreError> {
        let rows = sqlx::query(
            "SELECT stage, unit, state, attempts, worker, phase, reason, started, finished FROM task WHERE job = $1 \
             ORDER BY stage, unit",
        )
        .bind(job)
        .fetch_all(&self.pool)
        .await?;
        rows.iter().map(Task::read).collect()
    }

    /// How many tasks of a job are in which state.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn task_counts(&self, job: &str) -> Result<TaskCounts, JobStoreError> {
        let rows = sqlx::query("SELECT stage, state, COUNT(*) AS tasks FROM task WHERE job = $1 GROUP BY stage, state")
            .bind(job)
            .fetch_all(&self.pool)
            .await?;
        rows.iter()
            .map(|row| Ok(((row.try_get("stage")?, row.try_get::<&str, _>("state")?.parse()?), row.try_get("tasks")?)))
            .collect()
    }

    /// Adds tasks to a job that is locked; `origin` is the stage of the task that adds them, -1 for the submission. A task
    /// that is there already stays as it is. Fences begin at the number of the job's last event, which is as high as any of its fences: so
    /// whoever held a task of the same name that was removed since has lost it.
    pub(crate) async fn add_tasks(
        &self,
        tx: &mut Tx,
        job: &str,
        origin: i64,
        tasks: &[NewTask],
    ) -> Result<(), JobStoreError> {
        for task in tasks {
            sqlx::query(
                "INSERT INTO task (job, stage, unit, input, required, state, attempts, max_attempts, fence, not_before, origin) \
                 VALUES ($1, $2, $3, $4, $5, 'ready', 0, $6, (SELECT events FROM job WHERE id = $1), 0, $7) ON CONFLICT (job, stage, unit) DO NOTHING",
            )
            .bind(job)
            .bind(task.stage)
            .bind(&task.unit)
            .bind(&task.input)
            .bind(i64::from(task.required))
            .bind(task.max_attempts)
            .bind(origin)
            .execute(&mut **tx)
            .await?;
        }
        Ok(())
    }
}
