//! The workers that have been seen.

use crate::texts::kept;
use crate::{JobStoreError, Store};
use serde::Serialize;
use sqlx::Row;
use std::time::Duration;

/// A worker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Worker {
    /// Id, unique among all workers that ever were.
    pub id: String,
    /// Name of its machine.
    pub host: String,
    /// Its process.
    pub pid: i64,
    /// Its version.
    pub version: String,
    /// When it was first seen, milliseconds since 1970; the database's clock.
    pub started: i64,
    /// When it was last seen, milliseconds since 1970.
    pub seen: i64,
    /// What it does.
    pub task: Option<String>,
    /// Memory in use, bytes.
    pub memory: i64,
    /// Its process, which it may share with others.
    pub node: String,
    /// Most memory that a task may use there, bytes.
    pub task_memory: i64,
    /// Why it takes no tasks, if it takes none.
    pub trouble: Option<String>,
}

impl Store {
    /// Notes that a worker is alive; `started` and `seen` are set by the database's clock.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn see_worker(&self, worker: &Worker) -> Result<(), JobStoreError> {
        let statement = "INSERT INTO worker (id, host, pid, version, started, seen, task, memory, node, task_memory, trouble) \
                         VALUES ($1, $2, $3, $4, {now}, {now}, $5, $6, $7, $8, $9) ON CONFLICT (id) \
                         DO UPDATE SET seen = excluded.seen, task = excluded.task, memory = excluded.memory, trouble = excluded.trouble";
        sqlx::query(self.sql(statement))
            .bind(&worker.id)
            .bind(&worker.host)
            .bind(worker.pid)
            .bind(&worker.version)
            .bind(&worker.task)
            .bind(worker.memory)
            .bind(&worker.node)
            .bind(worker.task_memory)
            .bind(worker.trouble.as_deref().map(kept))
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// The workers, those seen last first.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn workers(&self) -> Result<Vec<Worker>, JobStoreError> {
        self.workers_seen(None).await
    }

    /// The workers, those seen last first; with a time, only those that were seen since.
    pub(crate) async fn workers_seen(&self, lately: Option<Duration>) -> Result<Vec<Worker>, JobStoreError> {
        let since = lately.map_or(i64::MAX, |time| i64::try_from(time.as_millis()).unwrap_or(i64::MAX));
        let statement = "SELECT id, host, pid, version, started, seen, task, memory, node, task_memory, trouble FROM worker \
                         WHERE {now} - seen <= $1 ORDER BY seen DESC, id";
        let rows = sqlx::query(self.sql(statement)).bind(since).fetch_all(&self.pool).await?;
        rows.iter()
            .map(|row| {
                Ok(Worker {
                    id: row.try_get("id")?,
                    host: row.try_get("host")?,
                    pid: row.try_get("pid")?,
                    version: row.try_get("version")?,
                    started: row.try_get("started")?,
                    seen: row.try_get("seen")?,
                    task: row.try_get("task")?,
                    memory: row.try_get("memory")?,
                    node: row.try_get("node")?,
                    task_memory: row.try_get("task_memory")?,
                    trouble: row.try_get("trouble")?,
                })
            })
            .collect()
    }
}
