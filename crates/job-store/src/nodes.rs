//! Which node does which task.
//!
//! A node is a process with workers: what is wrong with one of its slots is most often wrong with all. A task that has failed on a node goes to
//! another one, as long as there is one that has not tried it; it fails for good only when its attempts are used up and no such node is
//! left. One that a node lacks something for, such as its source root, is not offered to that node again.

use crate::database::Tx;
use crate::{Claim, EventKind, JobState, JobStoreError, Store};
use sqlx::Row;
use std::time::Duration;

/// How long after its last sign of life a node counts as there, milliseconds. Workers give one three times in a lease, and every few
/// seconds at least.
pub(crate) const THERE: i64 = 20_000;

/// How long a task waits for a node that has what it needs, milliseconds.
const PATIENCE: i64 = 120_000;

/// Who claims.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claimant {
    /// Id of the worker.
    pub worker: String,
    /// Its process.
    pub node: String,
    /// Most memory that a task may use there, bytes.
    pub task_memory: i64,
    /// Its version.
    pub version: String,
}

impl Claimant {
    /// A worker that is alone in its process, and has what any task needs.
    #[must_use]
    pub fn alone(worker: &str) -> Self {
        Self { worker: worker.to_owned(), node: worker.to_owned(), task_memory: i64::MAX, version: String::new() }
    }
}

/// What became of tasks that a node has failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Whether there is another node that takes tasks.
    pub others: bool,
    /// How many of them have failed on another node as well.
    pub failed_elsewhere: usize,
}

/// A node, `w`, that is there and takes tasks, is of the version that does the job, is none of those that the task has tried or that lack
/// what it needs, and has its memory.
/// The first place is that of the node that asks, which does not count.
const ANOTHER: &str = "EXISTS (SELECT 1 FROM worker AS w WHERE w.seen > {now} - {there} AND w.trouble IS NULL AND w.node <> $1 \
                       AND w.version = COALESCE((SELECT program FROM job WHERE job.id = task.job), w.version) \
                       AND w.task_memory >= task.needs_memory AND NOT EXISTS (SELECT 1 FROM task_node AS tried \
                       WHERE tried.job = task.job AND tried.stage = task.stage AND tried.unit = task.unit AND tried.node = w.node))";

impl Store {
    /// The condition that a task is one for a node: `$1` is the node, `$2` the memory that it has.
    pub(crate) fn for_node(&self) -> String {
        let another = self.with_clock(ANOTHER);
        let own = "SELECT 1 FROM task_node AS own WHERE own.job = task.job AND own.stage = task.stage AND own.unit = task.unit \
                   AND own.node = $1";
        format!(
            "NOT EXISTS ({own} AND own.what = 'unfit') AND NOT (EXISTS ({own} AND own.what = 'failed') AND {another}) \
             AND (task.needs_memory <= $2 OR NOT {another})"
        )
    }

    fn with_clock(&self, condition: &str) -> String {
        condition.replace("{now}", self.now()).replace("{there}", &THERE.to_string())
    }

    /// Whether a node other than that of the claim could try its task.
    pub(crate) async fn another_node(&self, tx: &mut Tx, claim: &Claim) -> Result<bool, JobStoreError> {
        let statement = format!(
            "SELECT unit FROM task WHERE job = $2 AND stage = $3 AND unit = $4 AND {}",
            self.with_clock(ANOTHER)
        );
        let row = sqlx::query(sqlx::AssertSqlSafe(statement))
            .bind(&claim.node)
            .bind(&claim.job)
            .bind(claim.stage)
            .bind(&claim.unit)
            .fetch_optional(&mut **tx)
            .await?;
        Ok(row.is_some())
    }

    /// Notes that the node of a claim has failed its task, or lacks something for it.
    pub(crate) async fn note_node(&self, tx: &mut Tx, claim: &Claim, what: &'static str) -> Result<(), JobStoreError> {
        let statement = "INSERT INTO task_node (job, stage, unit, node, what, at) VALUES ($1, $2, $3, $4, $5, {now}) \
                         ON CONFLICT (job, stage, unit, node) DO UPDATE SET what = excluded.what";
        sqlx::query(self.sql(statement))
            .bind(&claim.job)
            .bind(claim.stage)
            .bind(&claim.unit)
            .bind(&claim.node)
            .bind(what)
            .execute(&mut **tx)
            .await?;
        Ok(())
    }

    /// Lets tasks fail that have waited for a node that has what they need for as long as they may; gives them with the state in which
    /// their jobs ended.
    pub(crate) async fn give_up_unfit(&self) -> Result<Vec<(Claim, Option<JobState>)>, JobStoreError> {
        // No place is that of a node that does not count. From the few that lack something to their tasks: this is asked all the time.
        let another = self.with_clock(ANOTHER);
        let statement = format!(
            "SELECT task.job, job.city, task.stage, task.unit, task.fence, task.attempts, task.required, task.reason \
             FROM task_node AS n JOIN task ON task.job = n.job AND task.stage = n.stage AND task.unit = n.unit \
             JOIN job ON job.id = task.job WHERE n.what = 'unfit' AND n.at < {{now}} - $2 AND task.state = 'ready' \
             AND job.state = 'running' AND NOT {another}"
        );
        let rows = sqlx::query(self.sql_of(&statement)).bind("").bind(PATIENCE).fetch_all(&self.pool).await?;
        let mut given_up = Vec::new();
        for row in rows {
            let claim = Claim::taken_back(&row)?;
            let (required, reason): (i64, Option<String>) = (row.try_get("required")?, row.try_get("reason")?);
            let reason = reason.unwrap_or_default();
            let mut tx = self.begin().await?;
            self.lock(&mut tx, &claim.job).await?;
            let statement = "UPDATE task SET state = 'failed', fence = fence + 1, finished = {now} \
                             WHERE job = $1 AND stage = $2 AND unit = $3 AND fence = $4 AND state = 'ready'";
            let failed = sqlx::query(self.sql(statement))
                .bind(&claim.job)
                .bind(claim.stage)
                .bind(&claim.unit)
                .bind(claim.fence)
                .execute(&mut *tx)
                .await?;
            if !crate::database::one_row(&failed) {
                continue;
            }
            self.about(&mut tx, &claim, EventKind::Failed, Some(&reason)).await?;
            let ended = if required == 1 {
                self.end(&mut tx, &claim.job, JobState::Failed, Some(&reason)).await?;
                Some(JobState::Failed)
            } else {
                self.advance(&mut tx, &claim.job).await?
            };
            tx.commit().await?;
            given_up.push((claim, ended));
        }
        Ok(given_up)
    }

    /// What became elsewhere of tasks that a node has failed, by job, stage and unit.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn judge(&self, node: &str, tasks: &[(String, i64, String)]) -> Result<Verdict, JobStoreError> {
        let statement =
            "SELECT COUNT(*) AS others FROM worker WHERE seen > {now} - $2 AND trouble IS NULL AND node <> $1";
        let others: i64 =
            sqlx::query(self.sql(statement)).bind(node).bind(THERE).fetch_one(&self.pool).await?.try_get("others")?;
        let mut verdict = Verdict { others: others > 0, failed_elsewhere: 0 };
        for (job, stage, unit) in tasks {
            let statement = "SELECT COUNT(*) AS failed FROM task_node WHERE job = $1 AND stage = $2 AND unit = $3 \
                             AND node <> $4 AND what = 'failed'";
            let query = sqlx::query(statement).bind(job).bind(stage).bind(unit).bind(node);
            let failed: i64 = query.fetch_one(&self.pool).await?.try_get("failed")?;
            verdict.failed_elsewhere += usize::from(failed > 0);
        }
        Ok(verdict)
    }

    /// Forgets the workers that were not seen for so long, and gives their number.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn forget_workers(&self, unseen: Duration) -> Result<u64, JobStoreError> {
        let unseen = i64::try_from(unseen.as_millis()).unwrap_or(i64::MAX);
        let forgotten = sqlx::query(self.sql("DELETE FROM worker WHERE seen < {now} - $1")).bind(unseen);
        Ok(forgotten.execute(&self.pool).await?.rows_affected())
    }

    /// Notes that a worker has stopped: nobody waits for it any more.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn part_from_worker(&self, id: &str) -> Result<(), JobStoreError> {
        sqlx::query("DELETE FROM worker WHERE id = $1").bind(id).execute(&self.pool).await?;
        Ok(())
    }
}
