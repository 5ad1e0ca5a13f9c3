//! Figures for monitoring.

use crate::database::Tx;
use crate::names::named;
use crate::{JobState, JobStoreError, Store, TaskState, Worker};
use sqlx::Row;
use std::time::Duration;

named! {
    /// What became of an attempt at a task.
    Attempt, "outcome of an attempt", {
        /// The task is done.
        Done = "done",
        /// The result was taken over from an earlier job.
        Reused = "reused",
        /// It failed, and the task will be tried again.
        Retried = "retried",
        /// It failed, and so did the task.
        Failed = "failed",
        /// Its lease ran out.
        Lost = "lost",
        /// Its worker gave it back.
        HandedBack = "handed-back",
    }
}

/// All figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figures {
    /// How many jobs are in which state.
    pub jobs: Vec<(JobState, i64)>,
    /// How long the oldest job waits that nobody has begun, milliseconds; 0 if none waits.
    pub oldest_waiting: i64,
    /// The tasks of jobs that are not over.
    pub queue: Vec<Queue>,
    /// What became of attempts so far.
    pub attempts: Vec<Attempts>,
    /// The workers that were seen of late.
    pub workers: Vec<Worker>,
}

/// The tasks of a stage, of jobs that are not over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Queue {
    /// The stage.
    pub stage: i64,
    /// Their state.
    pub state: TaskState,
    /// How many there are.
    pub tasks: i64,
    /// How many of them may be claimed now: their job runs, and has come to their stage.
    pub claimable: i64,
}

/// The attempts at tasks of a stage that had the same outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct Attempts {
    /// The stage.
    pub stage: i64,
    /// What became of them.
    pub outcome: Attempt,
    /// How many there were.
    pub tasks: i64,
    /// How long they took together.
    pub seconds: f64,
    /// Bytes of what they made.
    pub bytes: i64,
}

impl Store {
    /// The figures, with the workers that were seen since `lately`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn figures(&self, lately: Duration) -> Result<Figures, JobStoreError> {
        let mut figures = Figures::default();
        let jobs = sqlx::query("SELECT state, COUNT(*) AS jobs FROM job GROUP BY state ORDER BY state");
        for row in jobs.fetch_all(&self.pool).await? {
            figures.jobs.push((row.try_get::<&str, _>("state")?.parse()?, row.try_get("jobs")?));
        }
        let statement = "SELECT {now} - MIN(created) AS waits FROM job WHERE state = 'accepted'";
        let waits = sqlx::query(self.sql(statement)).fetch_one(&self.pool).await?;
        figures.oldest_waiting = waits.try_get::<Option<i64>, _>("waits")?.unwrap_or(0).max(0);
        let queue = sqlx::query(
            "SELECT task.stage, task.state, COUNT(*) AS tasks, COUNT(CASE WHEN task.state = 'ready' AND task.stage = job.stage \
             AND job.state <> 'paused' THEN 1 END) AS claimable FROM job JOIN task ON task.job = job.id \
             WHERE job.state IN ('accepted', 'running', 'paused') AND task.state IN ('ready', 'running') \
             GROUP BY task.stage, task.state ORDER BY task.stage, task.state",
        );
        for row in queue.fetch_all(&self.pool).await? {
            figures.queue.push(Queue {
                stage: row.try_get("stage")?,
                state: row.try_get::<&str, _>("state")?.parse()?,
                tasks: row.try_get("tasks")?,
                claimable: row.try_get("claimable")?,
            });
        }
        let attempts = sqlx::query("SELECT stage, outcome, tasks, seconds, bytes FROM tally ORDER BY stage, outcome");
        for row in attempts.fetch_all(&self.pool).await? {
            figures.attempts.push(Attempts {
                stage: row.try_get("stage")?,
                outcome: row.try_get::<&str, _>("outcome")?.parse()?,
                tasks: row.try_get("tasks")?,
                seconds: row.try_get("seconds")?,
                bytes: row.try_get("bytes")?,
            });
        }
        figures.workers = self.workers_seen(Some(lately)).await?;
        Ok(figures)
    }

    /// Bytes of all contents that anything refers to, each counted once. It looks at every reference, so it is not to be asked for
    /// often.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn stored_bytes(&self) -> Result<i64, JobStoreError> {
        let statement = "SELECT CAST(COALESCE(SUM(bytes), 0) AS BIGINT) AS bytes FROM (SELECT MAX(bytes) AS bytes FROM ( \
                         SELECT blob, bytes FROM artifact UNION ALL SELECT blob, bytes FROM outcome_artifact UNION ALL \
                         SELECT blob, bytes FROM city_file UNION ALL SELECT blob, bytes FROM upload_file UNION ALL \
                         SELECT blob, bytes FROM upload_part) AS referred \
                         GROUP BY blob) AS contents";
        Ok(sqlx::query(statement).fetch_one(&self.pool).await?.try_get("bytes")?)
    }

    /// Counts an attempt that ends. The last statement of its transaction: all tasks of a stage meet in one row.
    pub(crate) async fn count(
        &self,
        tx: &mut Tx,
        stage: i64,
        outcome: Attempt,
        took: Duration,
        bytes: u64,
    ) -> Result<(), JobStoreError> {
        sqlx::query(
            "INSERT INTO tally (stage, outcome, tasks, seconds, bytes) VALUES ($1, $2, 1, $3, $4) \
             ON CONFLICT (stage, outcome) DO UPDATE SET tasks = tally.tasks + 1, seconds = tally.seconds + excluded.seconds, \
             bytes = tally.bytes + excluded.bytes",
        )
        .bind(stage)
        .bind(outcome.name())
        .bind(took.as_secs_f64())
        .bind(i64::try_from(bytes).unwrap_or(i64::MAX))
        .execute(&mut **tx)
        .await?;
        Ok(())
    }
}
