//! What happened to a job, in order.

use crate::database::Tx;
use crate::names::named;
use crate::texts::kept;
use crate::{JobState, JobStoreError, Store};
use serde::Serialize;
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, Row};

named! {
    /// Kind of an event.
    EventKind, "kind of an event", {
        /// The job was taken in.
        Submitted = "submitted",
        /// The job's state changed; the message has the new one.
        State = "state",
        /// The job went on to another stage.
        Stage = "stage",
        /// A task was claimed; the message has the worker.
        Claimed = "claimed",
        /// A task is done.
        Done = "done",
        /// A task's result was taken over from an earlier run.
        Reused = "reused",
        /// A task will be tried again; the message has the reason.
        Retry = "retry",
        /// A task failed for good; the message has the reason.
        Failed = "failed",
        /// A task waits for the database, the object store or a disk; the message has the reason.
        Waiting = "waiting",
        /// The job's priority changed.
        Priority = "priority",
        /// What the job made is its city's new generation; the message says which.
        Published = "published",
        /// What the job made is what its city has already; the message says which generation.
        Unchanged = "unchanged",
        /// What the job made did not become a generation of its city; the message says why.
        Withheld = "withheld",
    }
}

impl EventKind {}

/// One event of a job.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Event {
    /// Number within the job, from 1, without gaps.
    pub number: i64,
    /// When, milliseconds since 1970.
    pub at: i64,
    /// What happened.
    pub kind: EventKind,
    /// Stage of the task, or the stage that begins.
    pub stage: Option<i64>,
    /// Unit of the task.
    pub unit: Option<String>,
    /// More about it.
    pub message: Option<String>,
}

impl Event {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            number: row.try_get("number")?,
            at: row.try_get("at")?,
            kind: row.try_get::<&str, _>("kind")?.parse()?,
            stage: row.try_get("stage")?,
            unit: row.try_get("unit")?,
            message: row.try_get("message")?,
        })
    }
}

/// What an event is about.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct About<'a> {
    pub(crate) stage: Option<i64>,
    pub(crate) unit: Option<&'a str>,
    pub(crate) message: Option<&'a str>,
}

impl Store {
    /// The events of a job after number `since`, oldest first, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn events(&self, job: &str, since: i64, limit: i64) -> Result<Vec<Event>, JobStoreError> {
        let rows = sqlx::query(
            "SELECT number, at, kind, stage, unit, message FROM event WHERE job = $1 AND number > $2 \
             ORDER BY number LIMIT $3",
        )
        .bind(job)
        .bind(since)
        .bind(limit)
        .fetch_all(&self.pool)
        .await?;
        rows.iter().map(Event::read).collect()
    }

    /// Numbers of the last events of jobs, and their states; of jobs that are not there, nothing.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn last_events(&self, jobs: &[&str]) -> Result<Vec<(String, i64, JobState)>, JobStoreError> {
        let mut found = Vec::new();
        for some in jobs.chunks(500) {
            let places: Vec<String> = (1..=some.len()).map(|i| format!("${i}")).collect();
            let statement = format!("SELECT id, events, state FROM job WHERE id IN ({})", places.join(", "));
            let query = some.iter().fold(sqlx::query(AssertSqlSafe(statement)), |query, id| query.bind(*id));
            for row in query.fetch_all(&self.pool).await? {
                found.push((row.try_get("id")?, row.try_get("events")?, row.try_get::<&str, _>("state")?.parse()?));
            }
        }
        Ok(found)
    }

    /// Locks the job against other changes until the transaction ends, and notes what happens to it.
    pub(crate) async fn note(
        &self,
        tx: &mut Tx,
        job: &str,
        kind: EventKind,
        about: About<'_>,
    ) -> Result<(), JobStoreError> {
        let row = sqlx::query("UPDATE job SET events = events + 1 WHERE id = $1 RETURNING events")
            .bind(job)
            .fetch_optional(&mut **tx)
            .await?
            .ok_or_else(|| JobStoreError::NoJob(job.to_owned()))?;
        let number: i64 = row.try_get("events")?;
        let statement = "INSERT INTO event (job, number, at, kind, stage, unit, message) \
                         VALUES ($1, $2, {now}, $3, $4, $5, $6)";
        sqlx::query(self.sql(statement))
            .bind(job)
            .bind(number)
            .bind(kind.name())
            .bind(about.stage)
            .bind(about.unit)
            .bind(about.message.map(kept))
            .execute(&mut **tx)
            .await?;
        Ok(())
    }

    /// Locks the job against other changes until the transaction ends.
    pub(crate) async fn lock(&self, tx: &mut Tx, job: &str) -> Result<(), JobStoreError> {
        let changed = sqlx::query("UPDATE job SET events = events WHERE id = $1").bind(job).execute(&mut **tx).await?;
        if crate::database::one_row(&changed) { Ok(()) } else { Err(JobStoreError::NoJob(job.to_owned())) }
    }
}
