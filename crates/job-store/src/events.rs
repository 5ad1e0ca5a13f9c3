//! What happened to a job, in order.

use crate::database::Tx;
use crate::{JobStoreError, Store};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use sqlx::any::AnyRow;

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// The job was taken in.
    Submitted,
    /// The job's state changed; the message has the new one.
    State,
    /// The job went on to another stage.
    Stage,
    /// A task was claimed; the message has the worker.
    Claimed,
    /// A task is done.
    Done,
    /// A task's result was taken over from an earlier run.
    Reused,
    /// A task will be tried again; the message has the reason.
    Retry,
    /// A task failed for good; the message has the reason.
    Failed,
    /// The job's priority changed.
    Priority,
    /// What the job made is its city's new generation; the message says which.
    Published,
    /// What the job made did not become a generation of its city; the message says why.
    Withheld,
}

impl EventKind {
    const ALL: [(Self, &'static str); 11] = [
        (Self::Submitted, "submitted"),
        (Self::State, "state"),
        (Self::Stage, "stage"),
        (Self::Claimed, "claimed"),
        (Self::Done, "done"),
        (Self::Reused, "reused"),
        (Self::Retry, "retry"),
        (Self::Failed, "failed"),
        (Self::Priority, "priority"),
        (Self::Published, "published"),
        (Self::Withheld, "withheld"),
    ];

    /// The name under which it is stored and shown.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name)
    }

    fn parse(text: &str) -> Result<Self, JobStoreError> {
        let found = Self::ALL.iter().find(|(_, name)| *name == text).map(|(kind, _)| *kind);
        found.ok_or_else(|| JobStoreError::Stored { what: "kind of an event", value: text.to_owned() })
    }
}

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
            kind: EventKind::parse(row.try_get("kind")?)?,
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
            .bind(about.message)
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
