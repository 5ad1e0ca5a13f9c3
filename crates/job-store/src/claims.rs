//! Who does a task: claims under a lease and a fence.
//!
//! A claim raises the task's fence. Every later word of the worker about the task carries the fence it was given, and is
//! refused if the fence was raised since: because the lease ran out and another worker took over, or the job was
//! cancelled. So a task's body may run more than once, but its result counts exactly once.

use crate::database::Tx;
use crate::events::About;
use crate::texts::kept;
use crate::{
    Artifact, Attempt, Cause, Claimant, Consequence, EventKind, JobState, JobStoreError, NewTask, Publication, Reaped,
    Store, TaskState,
};
use sqlx::Row;
use sqlx::any::AnyRow;
use std::time::Duration;

/// A task that a worker holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Id of the job.
    pub job: String,
    /// The city that the job makes or refreshes.
    pub city: String,
    /// What the job is to do, as JSON.
    pub request: String,
    /// Stage of the task.
    pub stage: i64,
    /// Unit of the task.
    pub unit: String,
    /// What the worker needs to know, as JSON.
    pub input: String,
    /// The number under which it is held.
    pub fence: i64,
    /// Which attempt this is, from 1; those whose leases ran out do not count.
    pub attempt: i64,
    /// The process of the worker.
    pub node: String,
}

impl Claim {
    /// What is taken from whoever held it, from a row with the task and the job's city; what only a worker needs is empty.
    pub(crate) fn taken_back(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            job: row.try_get("job")?,
            city: row.try_get("city")?,
            request: String::new(),
            stage: row.try_get("stage")?,
            unit: row.try_get("unit")?,
            input: String::new(),
            fence: row.try_get("fence")?,
            attempt: row.try_get("attempts")?,
            node: String::new(),
        })
    }

    pub(crate) fn lost(&self) -> JobStoreError {
        JobStoreError::Lost { job: self.job.clone(), stage: self.stage, unit: self.unit.clone(), fence: self.fence }
    }
}

/// What a worker is to do after a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The lease is longer now.
    Continue,
    /// The task is no longer the worker's: stop, and throw the result away.
    Stop,
}

/// Whether a task that failed may be tried again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Retry {
    /// After this time, while attempts are left.
    After(Duration),
    /// Never: it would fail again.
    Never,
    /// After this time, where tasks may use more than this many bytes, as far as there is such a node.
    WithMemory(Duration, u64),
    /// By another node: this one lacks something that the task needs. The attempt does not count.
    Elsewhere,
}

/// What a finished task leaves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finished {
    /// What it made.
    pub artifacts: Vec<Artifact>,
    /// Tasks of later stages that it found to be needed.
    pub tasks: Vec<NewTask>,
    /// Whether the result was taken over from an earlier run.
    pub reused: bool,
    /// Hash of all that the result depends on, so that later jobs of the city can take it over; none for a result that
    /// depends on more than can be hashed.
    pub key: Option<String>,
    /// The finished city, to be published with the end of the task.
    pub publication: Option<Publication>,
}

/// How often the lease of a task may run out: often enough for many workers that are killed, and seldom enough for a task that kills them.
const MOST_LOSSES: i64 = 20;

/// How long a task waits that could not be done for want of a disk, a database or an object store.
const AWAY_PAUSE: Duration = Duration::from_secs(2);

impl Store {
    /// Gives a worker that is alone in its process, and has what any task needs, the next task, as [`Store::claim_as`] does.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn claim(&self, worker: &str, lease: Duration) -> Result<Option<Claim>, JobStoreError> {
        self.claim_as(&Claimant::alone(worker), lease).await
    }

    /// Gives a worker the next task that is for its node: of the job with the highest priority, then of the oldest one. None if none is
    /// ready.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn claim_as(&self, by: &Claimant, lease: Duration) -> Result<Option<Claim>, JobStoreError> {
        let statement = format!(
            "SELECT id FROM job WHERE state IN ('accepted', 'running') AND COALESCE(program, $3) = $3 AND EXISTS (SELECT 1 FROM task \
             WHERE task.job = job.id AND task.state = 'ready' AND task.stage = job.stage AND task.not_before <= {{now}} AND {}) \
             ORDER BY priority DESC, created, id LIMIT 8",
            self.for_node()
        );
        let query = sqlx::query(self.sql_of(&statement)).bind(&by.node).bind(by.task_memory).bind(&by.version);
        let jobs = query.fetch_all(&self.pool).await?;
        for row in jobs {
            let claim = self.claim_of(row.try_get("id")?, by, lease).await?;
            if claim.is_some() {
                return Ok(claim);
            }
        }
        Ok(None)
    }

    async fn claim_of(&self, id: &str, by: &Claimant, lease: Duration) -> Result<Option<Claim>, JobStoreError> {
        let mut tx = self.begin().await?;
        let job = self.locked(&mut tx, id).await?;
        if !matches!(job.state, JobState::Accepted | JobState::Running) {
            return Ok(None);
        }
        // The job is of the version whose worker takes its first task. It was not bound when it was looked for.
        let statement = "UPDATE job SET program = $2 WHERE id = $1 AND COALESCE(program, $2) = $2";
        let bound = sqlx::query(statement).bind(id).bind(&by.version).execute(&mut *tx).await?;
        if !crate::database::one_row(&bound) {
            return Ok(None);
        }
        let statement = format!(
            "UPDATE task SET state = 'running', fence = fence + 1, attempts = attempts + 1, worker = $5, phase = NULL, \
             started = {{now}}, finished = NULL, lease_until = {{now}} + $6 \
             WHERE job = $3 AND stage = $4 AND unit = (SELECT unit FROM task WHERE job = $3 AND stage = $4 \
             AND state = 'ready' AND not_before <= {{now}} AND {} ORDER BY unit LIMIT 1) \
             RETURNING unit, input, fence, attempts",
            self.for_node()
        );
        let Some(row) = sqlx::query(self.sql_of(&statement))
            .bind(&by.node)
            .bind(by.task_memory)
            .bind(id)
            .bind(job.stage)
            .bind(&by.worker)
            .bind(milliseconds(lease))
            .fetch_optional(&mut *tx)
            .await?
        else {
            return Ok(None);
        };
        let claim = Claim {
            job: job.id,
            city: job.city,
            request: job.request,
            stage: job.stage,
            unit: row.try_get("unit")?,
            input: row.try_get("input")?,
            fence: row.try_get("fence")?,
            attempt: row.try_get("attempts")?,
            node: by.node.clone(),
        };
        if job.state == JobState::Accepted {
            let statement = "UPDATE job SET state = 'running', started = {now} WHERE id = $1";
            sqlx::query(self.sql(statement)).bind(id).execute(&mut *tx).await?;
            let message = Some(JobState::Running.name());
            self.note(&mut tx, id, EventKind::State, About { message, ..About::default() }).await?;
            self.tell_progress(&mut tx, id).await?;
        }
        let about = About { stage: Some(claim.stage), unit: Some(&claim.unit), message: Some(&by.worker) };
        self.note(&mut tx, id, EventKind::Claimed, about).await?;
        tx.commit().await?;
        Ok(Some(claim))
    }

    /// Holds a task for another lease, and says how far it is.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn heartbeat(&self, claim: &Claim, lease: Duration, phase: &str) -> Result<Order, JobStoreError> {
        let statement = "UPDATE task SET lease_until = {now} + $5, phase = $6 \
                         WHERE job = $1 AND stage = $2 AND unit = $3 AND fence = $4 AND state = 'running'";
        let held = sqlx::query(self.sql(statement))
            .bind(&claim.job)
            .bind(claim.stage)
            .bind(&claim.unit)
            .bind(claim.fence)
            .bind(milliseconds(lease))
            .bind(kept(phase))
            .execute(&self.pool)
            .await?;
        Ok(if crate::database::one_row(&held) { Order::Continue } else { Order::Stop })
    }

    /// Takes over a task's result: its artefacts, the tasks it adds, its end and what follows from it, in one transaction.
    ///
    /// # Errors
    /// [`JobStoreError::Lost`] if the task is no longer the worker's; then nothing is changed. If the call was cut off, it may
    /// be repeated: [`JobStoreError::Lost`] then also means that the first one was carried out.
    /// [`JobStoreError::NoOutcome`] if what it takes over is not kept any more: the task has to be done after all.
    pub async fn finish(&self, claim: &Claim, result: &Finished) -> Result<Consequence, JobStoreError> {
        if let Some(early) = result.tasks.iter().find(|t| t.stage <= claim.stage) {
            let (unit, stage, added) = (claim.unit.clone(), claim.stage, early.stage);
            return Err(JobStoreError::StageOrder { unit, stage, added });
        }
        let mut tx = self.begin().await?;
        let kind = if result.reused { EventKind::Reused } else { EventKind::Done };
        self.about(&mut tx, claim, kind, None).await?;
        let (state, outcome) = match result.reused {
            true => (TaskState::Reused, Attempt::Reused),
            false => (TaskState::Done, Attempt::Done),
        };
        let took = self.leave(&mut tx, claim, state, None).await?;
        self.add_artifacts(&mut tx, &claim.job, claim.stage, &result.artifacts).await?;
        self.add_tasks(&mut tx, &claim.job, claim.stage, &result.tasks).await?;
        if let Some(key) = &result.key
            && !self.keep_outcome(&mut tx, &claim.city, key, result).await?
        {
            return Err(JobStoreError::NoOutcome { unit: claim.unit.clone(), key: key.clone() });
        }
        let publication = match &result.publication {
            Some(publication) => Some(self.publish(&mut tx, &claim.job, publication).await?),
            None => None,
        };
        let ended = self.advance(&mut tx, &claim.job).await?;
        let bytes = result.artifacts.iter().map(|a| a.bytes).sum();
        self.count(&mut tx, claim.stage, outcome, took, bytes).await?;
        tx.commit().await?;
        Ok(Consequence { took, again: false, publication, ended })
    }

    /// Gives a task up: it is tried again, or fails for good when its attempts are used up.
    ///
    /// # Errors
    /// [`JobStoreError::Lost`] if the task is no longer the worker's.
    pub async fn fail(&self, claim: &Claim, reason: &str, retry: Retry) -> Result<Consequence, JobStoreError> {
        let mut tx = self.begin().await?;
        self.lock(&mut tx, &claim.job).await?;
        let consequence = self.give_up(&mut tx, claim, reason, retry, false).await?;
        tx.commit().await?;
        Ok(consequence)
    }

    /// Notes that a task waits for something that is away.
    ///
    /// # Errors
    /// If there is no such job, or the database does not answer.
    pub async fn note_waiting(&self, claim: &Claim, reason: &str) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        self.about(&mut tx, claim, EventKind::Waiting, Some(reason)).await?;
        tx.commit().await?;
        Ok(())
    }

    /// Hands a task back that was not begun, or that a draining worker stops: the attempt does not count.
    ///
    /// # Errors
    /// [`JobStoreError::Lost`] if the task is no longer the worker's.
    pub async fn release(&self, claim: &Claim) -> Result<Consequence, JobStoreError> {
        self.hand_back(claim, "handed back by its worker", None, Duration::ZERO).await
    }

    /// The same for a task that could not be done here and now, and says why: it waits for a moment.
    ///
    /// # Errors
    /// [`JobStoreError::Lost`] if the task is no longer the worker's.
    pub async fn release_for(&self, claim: &Claim, reason: &str) -> Result<Consequence, JobStoreError> {
        self.hand_back(claim, reason, Some(reason), AWAY_PAUSE).await
    }

    async fn hand_back(
        &self,
        claim: &Claim,
        message: &str,
        reason: Option<&str>,
        pause: Duration,
    ) -> Result<Consequence, JobStoreError> {
        let mut tx = self.begin().await?;
        self.about(&mut tx, claim, EventKind::Retry, Some(message)).await?;
        let took = self.leave(&mut tx, claim, TaskState::Ready, reason).await?;
        let statement = "UPDATE task SET attempts = attempts - 1, not_before = {now} + $4 \
                         WHERE job = $1 AND stage = $2 AND unit = $3";
        sqlx::query(self.sql(statement))
            .bind(&claim.job)
            .bind(claim.stage)
            .bind(&claim.unit)
            .bind(milliseconds(pause))
            .execute(&mut *tx)
            .await?;
        self.count(&mut tx, claim.stage, Attempt::HandedBack, took, 0).await?;
        tx.commit().await?;
        Ok(Consequence { took, again: true, publication: None, ended: None })
    }

    /// Takes tasks back whose lease ran out, lets those fail that have waited too long for a node that has what they need, and gives them. Every coordinator and worker may call it at any time.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn reap(&self) -> Result<Vec<Reaped>, JobStoreError> {
        let statement = "SELECT task.job, job.city, task.stage, task.unit, task.fence, task.attempts, task.worker FROM task \
                         JOIN job ON job.id = task.job WHERE task.state = 'running' AND task.lease_until < {now}";
        let expired = sqlx::query(self.sql(statement)).fetch_all(&self.pool).await?;
        let mut taken = Vec::new();
        for row in expired {
            let claim = Claim::taken_back(&row)?;
            let worker = row.try_get::<Option<String>, _>("worker")?.unwrap_or_else(|| "?".to_owned());
            let mut tx = self.begin().await?;
            self.lock(&mut tx, &claim.job).await?;
            let reason = Cause::silent(&worker);
            match self.give_up(&mut tx, &claim, &reason, Retry::After(Duration::ZERO), true).await {
                Ok(consequence) => {
                    tx.commit().await?;
                    let Claim { job, city, stage, unit, attempt, .. } = claim;
                    taken.push(Reaped { job, city, stage, unit, attempt, worker, consequence });
                }
                // A heartbeat has come since, or someone else was quicker.
                Err(JobStoreError::Lost { .. }) => {}
                Err(e) => return Err(e),
            }
        }
        for (claim, ended) in self.give_up_unfit().await? {
            let Claim { job, city, stage, unit, attempt, node, .. } = claim;
            let consequence = Consequence { took: Duration::ZERO, again: false, publication: None, ended };
            taken.push(Reaped { job, city, stage, unit, attempt, worker: node, consequence });
        }
        Ok(taken)
    }

    /// Ends a hold without a result; with `expired`, only if its lease has run out.
    async fn give_up(
        &self,
        tx: &mut Tx,
        claim: &Claim,
        reason: &str,
        retry: Retry,
        expired: bool,
    ) -> Result<Consequence, JobStoreError> {
        let statement = "SELECT required, max_attempts, attempts, losses FROM task WHERE job = $1 AND stage = $2 AND unit = $3 \
                         AND fence = $4 AND state = 'running' AND ($5 = 0 OR lease_until < {now})";
        let row = sqlx::query(self.sql(statement))
            .bind(&claim.job)
            .bind(claim.stage)
            .bind(&claim.unit)
            .bind(claim.fence)
            .bind(i64::from(expired))
            .fetch_optional(&mut **tx)
            .await?
            .ok_or_else(|| claim.lost())?;
        let (required, most): (i64, i64) = (row.try_get("required")?, row.try_get("max_attempts")?);
        let (attempts, losses): (i64, i64) = (row.try_get("attempts")?, row.try_get("losses")?);
        let mut ended = None;
        let (mut pause, mut memory) = (Duration::ZERO, 0);
        let another = match retry {
            // What has died with its worker may do better with the next: another limit, and it says nothing about the node.
            _ if expired => losses + 1 < MOST_LOSSES,
            Retry::Never => false,
            Retry::Elsewhere => {
                // It waits for a node that has what it needs, and is given up later.
                self.note_node(tx, claim, "unfit").await?;
                // Where nothing is made yet, a node of another version may have it.
                let statement = "UPDATE job SET program = NULL WHERE id = $1 AND NOT EXISTS (SELECT 1 FROM task \
                                 WHERE task.job = job.id AND (task.state IN ('done', 'reused') \
                                 OR (task.state = 'running' AND NOT (task.stage = $2 AND task.unit = $3))))";
                let query = sqlx::query(statement).bind(&claim.job).bind(claim.stage).bind(&claim.unit);
                query.execute(&mut **tx).await?;
                true
            }
            Retry::After(wanted) | Retry::WithMemory(wanted, _) => {
                self.note_node(tx, claim, "failed").await?;
                if let Retry::WithMemory(_, had) = retry {
                    memory = i64::try_from(had).unwrap_or(i64::MAX - 1) + 1;
                }
                pause = wanted;
                attempts < most || self.another_node(tx, claim).await?
            }
        };
        let uncounted = expired || retry == Retry::Elsewhere;
        let (again, took) = if another {
            let took = self.leave(tx, claim, TaskState::Ready, Some(reason)).await?;
            let statement = "UPDATE task SET not_before = {now} + $4, attempts = attempts - $5, losses = losses + $6, \
                             needs_memory = CASE WHEN needs_memory < $7 THEN $7 ELSE needs_memory END \
                             WHERE job = $1 AND stage = $2 AND unit = $3";
            sqlx::query(self.sql(statement))
                .bind(&claim.job)
                .bind(claim.stage)
                .bind(&claim.unit)
                .bind(milliseconds(pause))
                .bind(i64::from(uncounted))
                .bind(i64::from(expired))
                .bind(memory)
                .execute(&mut **tx)
                .await?;
            self.about(tx, claim, EventKind::Retry, Some(reason)).await?;
            (true, took)
        } else {
            let took = self.leave(tx, claim, TaskState::Failed, Some(reason)).await?;
            self.about(tx, claim, EventKind::Failed, Some(reason)).await?;
            if required == 1 {
                self.end(tx, &claim.job, JobState::Failed, Some(reason)).await?;
                ended = Some(JobState::Failed);
            } else {
                ended = self.advance(tx, &claim.job).await?;
            }
            (false, took)
        };
        let outcome = match (expired, again) {
            (true, _) => Attempt::Lost,
            (false, true) => Attempt::Retried,
            (false, false) => Attempt::Failed,
        };
        self.count(tx, claim.stage, outcome, took, 0).await?;
        Ok(Consequence { took, again, publication: None, ended })
    }

    /// Ends the hold on a task, if it is held under this fence; gives how long it was held.
    async fn leave(
        &self,
        tx: &mut Tx,
        claim: &Claim,
        state: TaskState,
        reason: Option<&str>,
    ) -> Result<Duration, JobStoreError> {
        let statement = "UPDATE task SET state = $5, reason = $6, phase = NULL, lease_until = NULL, finished = {now} \
                         WHERE job = $1 AND stage = $2 AND unit = $3 AND fence = $4 AND state = 'running' \
                         RETURNING finished - started AS took";
        let left = sqlx::query(self.sql(statement))
            .bind(&claim.job)
            .bind(claim.stage)
            .bind(&claim.unit)
            .bind(claim.fence)
            .bind(state.name())
            .bind(reason.map(kept))
            .fetch_optional(&mut **tx)
            .await?
            .ok_or_else(|| claim.lost())?;
        let took: Option<i64> = left.try_get("took")?;
        Ok(Duration::from_millis(took.and_then(|t| u64::try_from(t).ok()).unwrap_or(0)))
    }

    /// Notes an event about a task; the job is locked from then on.
    pub(crate) async fn about(
        &self,
        tx: &mut Tx,
        claim: &Claim,
        kind: EventKind,
        message: Option<&str>,
    ) -> Result<(), JobStoreError> {
        let about = About { stage: Some(claim.stage), unit: Some(&claim.unit), message };
        self.note(tx, &claim.job, kind, about).await
    }
}

fn milliseconds(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}
