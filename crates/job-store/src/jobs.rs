//! Jobs: taking them in, finding them, and what an operator does to them.

use crate::database::Tx;
use crate::events::About;
use crate::names::named;
use crate::texts::kept;
use crate::{EventKind, JobStoreError, NewCallback, NewTask, Store, TaskState};
use serde::Serialize;
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, Row};

named! {
    /// State of a job.
    JobState, "state of a job", {
        /// Taken in; nothing has begun.
        Accepted = "accepted",
        /// Its tasks are being done.
        Running = "running",
        /// No further task begins until it is resumed.
        Paused = "paused",
        /// All is done.
        Successful = "successful",
        /// All is done but for some units that failed.
        Partial = "partial",
        /// It could not go on.
        Failed = "failed",
        /// Stopped by a user.
        Cancelled = "cancelled",
    }
}

impl JobState {
    /// Whether nothing more will happen to it by itself.
    #[must_use]
    pub fn is_over(self) -> bool {
        !matches!(self, Self::Accepted | Self::Running | Self::Paused)
    }
}

/// What is submitted.
#[derive(Clone, Debug, Default)]
pub struct NewJob {
    /// The city that it makes or refreshes.
    pub city: String,
    /// Who submits it.
    pub owner: String,
    /// The names as which whoever submits it may be a member of the city: that of the owner, and those of their groups. None for one who
    /// may do everything.
    pub names: Option<Vec<String>>,
    /// A key of the client's choice: the same key again gives the same job.
    pub idempotency_key: Option<String>,
    /// What is to be done, as JSON.
    pub request: String,
    /// Jobs of higher priority get workers first.
    pub priority: i64,
    /// The first tasks; these add the others.
    pub tasks: Vec<NewTask>,
    /// Most jobs that its owner may have under way, with this one; none for no limit.
    pub max_jobs: Option<i64>,
    /// Who is told how it goes.
    pub callbacks: Vec<NewCallback>,
}

/// What became of a submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submitted {
    /// Id of the job.
    pub id: String,
    /// False if the idempotency key was known: the job is the one of the first submission.
    pub new: bool,
}

/// A job.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Job {
    /// Id; ids of later jobs sort later.
    pub id: String,
    /// The city.
    pub city: String,
    /// Who submitted it.
    pub owner: String,
    /// What is to be done, as JSON.
    pub request: String,
    /// State.
    pub state: JobState,
    /// Why it failed.
    pub reason: Option<String>,
    /// Jobs of higher priority get workers first.
    pub priority: i64,
    /// The stage under way.
    pub stage: i64,
    /// Number of the last event.
    pub events: i64,
    /// Milliseconds since 1970.
    pub created: i64,
    /// Milliseconds since 1970.
    pub started: Option<i64>,
    /// Milliseconds since 1970.
    pub finished: Option<i64>,
}

impl Job {
    pub(crate) const COLUMNS: &'static str =
        "id, city, owner, request, state, reason, priority, stage, events, created, started, finished";

    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            id: row.try_get("id")?,
            city: row.try_get("city")?,
            owner: row.try_get("owner")?,
            request: row.try_get("request")?,
            state: row.try_get::<&str, _>("state")?.parse()?,
            reason: row.try_get("reason")?,
            priority: row.try_get("priority")?,
            stage: row.try_get("stage")?,
            events: row.try_get("events")?,
            created: row.try_get("created")?,
            started: row.try_get("started")?,
            finished: row.try_get("finished")?,
        })
    }
}

/// Which jobs to list.
#[derive(Clone, Debug, Default)]
pub struct JobFilter {
    /// Only in one of these states; none for any.
    pub states: Vec<JobState>,
    /// Only of this city.
    pub city: Option<String>,
    /// Only of this owner.
    pub owner: Option<String>,
    /// Only of cities that have one of these as a member; none for all.
    pub seen_by: Option<Vec<String>>,
    /// Only those created before the job with this id: the last id of a page gives the next page.
    pub before: Option<String>,
    /// Only those created at this time or later, milliseconds since 1970.
    pub created_from: Option<i64>,
    /// Only those created at this time or earlier, milliseconds since 1970.
    pub created_to: Option<i64>,
    /// Only those that took, or have taken so far, at least this long, milliseconds.
    pub min_duration: Option<i64>,
    /// Only those that took, or have taken so far, at most this long, milliseconds.
    pub max_duration: Option<i64>,
}

impl Store {
    /// Takes a job in, with its first tasks, in one transaction.
    ///
    /// # Errors
    /// If the idempotency key was used for another request, the city is of others, the owner has as many jobs under way as they may, or the
    /// database does not answer.
    pub async fn submit(&self, new: &NewJob) -> Result<Submitted, JobStoreError> {
        let mut tx = self.begin().await?;
        let submitted = self.submit_in(&mut tx, new).await?;
        self.commit(tx).await?;
        Ok(submitted)
    }

    /// Takes a job in as a part of a transaction.
    pub(crate) async fn submit_in(&self, tx: &mut Tx, new: &NewJob) -> Result<Submitted, JobStoreError> {
        let id = uuid::Uuid::now_v7().to_string();
        if new.max_jobs.is_some() {
            // Submissions under one token go one after the other from here on, so that each counts those before it.
            sqlx::query("UPDATE api_token SET created = created WHERE name = $1")
                .bind(&new.owner)
                .execute(&mut **tx)
                .await?;
        }
        let stage = new.tasks.iter().map(|t| t.stage).min().unwrap_or(0);
        let statement = "INSERT INTO job (id, city, owner, idempotency_key, request, state, priority, stage, events, created) \
                         VALUES ($1, $2, $3, $4, $5, 'accepted', $6, $7, 0, {now}) ON CONFLICT (owner, idempotency_key) DO NOTHING";
        let inserted = sqlx::query(self.sql(statement))
            .bind(&id)
            .bind(&new.city)
            .bind(&new.owner)
            .bind(&new.idempotency_key)
            .bind(&new.request)
            .bind(new.priority)
            .bind(stage)
            .execute(&mut **tx)
            .await?;
        if !crate::database::one_row(&inserted) {
            let row = sqlx::query("SELECT id, city, request FROM job WHERE owner = $1 AND idempotency_key = $2")
                .bind(&new.owner)
                .bind(&new.idempotency_key)
                .fetch_one(&mut **tx)
                .await?;
            let earlier: String = row.try_get("id")?;
            let (city, request): (String, String) = (row.try_get("city")?, row.try_get("request")?);
            if city != new.city || request != new.request {
                let key = new.idempotency_key.clone().unwrap_or_default();
                return Err(JobStoreError::KeyReused { key, job: earlier });
            }
            return Ok(Submitted { id: earlier, new: false });
        }
        self.enter_city(tx, &new.city, &new.owner, new.names.as_deref()).await?;
        if let Some(most) = new.max_jobs
            && under_way(tx, &new.owner).await? > most
        {
            return Err(JobStoreError::Quota { owner: new.owner.clone(), most });
        }
        self.note(tx, &id, EventKind::Submitted, About { message: Some(&new.owner), ..About::default() }).await?;
        self.add_tasks(tx, &id, -1, &new.tasks).await?;
        for callback in &new.callbacks {
            self.add_callback(tx, &id, &new.owner, callback).await?;
        }
        if new.tasks.is_empty() {
            self.advance(tx, &id).await?;
        }
        Ok(Submitted { id, new: true })
    }

    /// A job.
    ///
    /// # Errors
    /// If there is no such job, or the database does not answer.
    pub async fn job(&self, id: &str) -> Result<Job, JobStoreError> {
        let row =
            sqlx::query(self.sql("SELECT {job} FROM job WHERE id = $1")).bind(id).fetch_optional(&self.pool).await?;
        row.as_ref().map_or_else(|| Err(JobStoreError::NoJob(id.to_owned())), Job::read)
    }

    /// Jobs, newest first, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn jobs(&self, filter: &JobFilter, limit: i64) -> Result<Vec<Job>, JobStoreError> {
        // Only what is asked for stands in the statement: a condition on NULL would keep the database from its indices.
        let (mut texts, mut numbers, mut conditions) = (Vec::new(), Vec::new(), Vec::new());
        let states: Vec<&str> = filter.states.iter().map(|s| s.name()).collect();
        if !states.is_empty() {
            // Names of this crate.
            conditions.push(format!("state IN ('{}')", states.join("', '")));
        }
        for (condition, value) in [("city =", &filter.city), ("owner =", &filter.owner), ("id <", &filter.before)] {
            if let Some(value) = value {
                texts.push(value);
                conditions.push(format!("{condition} ${}", 1 + texts.len()));
            }
        }
        if let Some(names) = &filter.seen_by {
            conditions.push(crate::members::of_members("city", 2 + texts.len(), names.len()));
            texts.extend(names);
        }
        let duration = format!("COALESCE(finished, {}) - started", self.now());
        for (condition, value) in [
            ("created >=".to_owned(), filter.created_from),
            ("created <=".to_owned(), filter.created_to),
            (format!("{duration} >="), filter.min_duration),
            (format!("{duration} <="), filter.max_duration),
        ] {
            if let Some(value) = value {
                numbers.push(value);
                conditions.push(format!("{condition} ${}", 1 + texts.len() + numbers.len()));
            }
        }
        let conditions =
            if conditions.is_empty() { String::new() } else { format!("WHERE {}", conditions.join(" AND ")) };
        let statement = format!("SELECT {} FROM job {conditions} ORDER BY id DESC LIMIT $1", Job::COLUMNS);
        let mut query = sqlx::query(AssertSqlSafe(statement)).bind(limit);
        for text in texts {
            query = query.bind(text);
        }
        for number in numbers {
            query = query.bind(number);
        }
        query.fetch_all(&self.pool).await?.iter().map(Job::read).collect()
    }

    /// Number of the last event of a job: whatever changes of it, this does.
    ///
    /// # Errors
    /// If there is no such job, or the database does not answer.
    pub async fn last_event(&self, id: &str) -> Result<i64, JobStoreError> {
        let row = sqlx::query("SELECT events FROM job WHERE id = $1").bind(id).fetch_optional(&self.pool).await?;
        Ok(row.ok_or_else(|| JobStoreError::NoJob(id.to_owned()))?.try_get("events")?)
    }

    /// Stops a job for good. Tasks under way are told at their next heartbeat, and their results refused.
    ///
    /// # Errors
    /// If the job is over, or there is none.
    pub async fn cancel(&self, id: &str) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        let job = self.locked(&mut tx, id).await?;
        if job.state.is_over() {
            return Err(not_possible(&job, "to cancel it"));
        }
        self.end(&mut tx, id, JobState::Cancelled, None).await?;
        self.commit(tx).await
    }

    /// Lets no further task begin.
    ///
    /// # Errors
    /// If the job is neither accepted nor running.
    pub async fn pause(&self, id: &str) -> Result<(), JobStoreError> {
        self.change(id, &[JobState::Accepted, JobState::Running], JobState::Paused, "to pause it").await
    }

    /// Lets a paused job go on.
    ///
    /// # Errors
    /// If the job is not paused.
    pub async fn resume(&self, id: &str) -> Result<(), JobStoreError> {
        self.change(id, &[JobState::Paused], JobState::Running, "to resume it").await
    }

    /// Sets the priority of a job that is not over.
    ///
    /// # Errors
    /// If the job is over, or there is none.
    pub async fn set_priority(&self, id: &str, priority: i64) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        let job = self.locked(&mut tx, id).await?;
        if job.state.is_over() {
            return Err(not_possible(&job, "another priority"));
        }
        let message = priority.to_string();
        self.note(&mut tx, id, EventKind::Priority, About { message: Some(&message), ..About::default() }).await?;
        sqlx::query("UPDATE job SET priority = $2 WHERE id = $1").bind(id).bind(priority).execute(&mut *tx).await?;
        self.commit(tx).await
    }

    /// Does the failed tasks of a job that is over again, and all of the stages after the first of them, whose results
    /// depend on them. What tasks of those stages had added or made is gone: they add and make it anew.
    ///
    /// # Errors
    /// If the job is not over or was cancelled, or nothing failed.
    pub async fn retry_failed(&self, id: &str) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        let job = self.locked(&mut tx, id).await?;
        let first: Option<i64> =
            sqlx::query("SELECT MIN(stage) AS stage FROM task WHERE job = $1 AND state = 'failed'")
                .bind(id)
                .fetch_one(&mut *tx)
                .await?
                .try_get("stage")?;
        let (JobState::Partial | JobState::Failed, Some(stage)) = (job.state, first) else {
            return Err(not_possible(&job, "to retry what failed"));
        };
        let emptied: i64 = sqlx::query("SELECT emptied FROM job WHERE id = $1")
            .bind(id)
            .fetch_one(&mut *tx)
            .await?
            .try_get("emptied")?;
        // The split makes all anew.
        if emptied == 1 && stage > 0 {
            return Err(not_possible(
                &job,
                "to retry it after what it had made was removed by age: submit it again; that",
            ));
        }
        sqlx::query("DELETE FROM task WHERE job = $1 AND origin > $2").bind(id).bind(stage).execute(&mut *tx).await?;
        sqlx::query("DELETE FROM artifact WHERE job = $1 AND stage > $2")
            .bind(id)
            .bind(stage)
            .execute(&mut *tx)
            .await?;
        sqlx::query(
            "DELETE FROM task_node WHERE job = $1 AND EXISTS (SELECT 1 FROM task WHERE task.job = $1 AND task.stage = task_node.stage \
             AND task.unit = task_node.unit AND (task.state IN ('failed', 'cancelled') OR task.stage > $2))",
        )
        .bind(id)
        .bind(stage)
        .execute(&mut *tx)
        .await?;
        sqlx::query(
            "UPDATE task SET state = 'ready', attempts = 0, losses = 0, not_before = 0, reason = NULL, phase = NULL, worker = NULL, \
             lease_until = NULL, started = NULL, finished = NULL \
             WHERE job = $1 AND (state IN ('failed', 'cancelled') OR stage > $2)",
        )
        .bind(id)
        .bind(stage)
        .execute(&mut *tx)
        .await?;
        sqlx::query("UPDATE job SET state = 'running', reason = NULL, finished = NULL, stage = $2 WHERE id = $1")
            .bind(id)
            .bind(stage)
            .execute(&mut *tx)
            .await?;
        let message = Some(JobState::Running.name());
        self.note(&mut tx, id, EventKind::State, About { stage: Some(stage), message, unit: None }).await?;
        self.commit(tx).await
    }

    async fn change(
        &self,
        id: &str,
        from: &[JobState],
        to: JobState,
        wanted: &'static str,
    ) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        let job = self.locked(&mut tx, id).await?;
        if !from.contains(&job.state) {
            return Err(not_possible(&job, wanted));
        }
        sqlx::query("UPDATE job SET state = $2 WHERE id = $1").bind(id).bind(to.name()).execute(&mut *tx).await?;
        self.note(&mut tx, id, EventKind::State, About { message: Some(to.name()), ..About::default() }).await?;
        self.commit(tx).await
    }

    /// The job, locked against other changes until the transaction ends.
    pub(crate) async fn locked(&self, tx: &mut Tx, id: &str) -> Result<Job, JobStoreError> {
        self.lock(tx, id).await?;
        Job::read(&sqlx::query(self.sql("SELECT {job} FROM job WHERE id = $1")).bind(id).fetch_one(&mut **tx).await?)
    }

    /// Ends a job; what of its tasks was not finished is cancelled, and loses its fence.
    pub(crate) async fn end(
        &self,
        tx: &mut Tx,
        id: &str,
        state: JobState,
        reason: Option<&str>,
    ) -> Result<(), JobStoreError> {
        let statement = "UPDATE task SET state = $2, fence = fence + 1, lease_until = NULL, finished = {now} \
                         WHERE job = $1 AND state IN ('ready', 'running')";
        sqlx::query(self.sql(statement)).bind(id).bind(TaskState::Cancelled.name()).execute(&mut **tx).await?;
        let statement = "UPDATE job SET state = $2, reason = $3, finished = {now} WHERE id = $1";
        sqlx::query(self.sql(statement)).bind(id).bind(state.name()).bind(reason.map(kept)).execute(&mut **tx).await?;
        self.tell_end(tx, id, state, reason).await?;
        self.note(tx, id, EventKind::State, About { message: Some(state.name()), ..About::default() }).await
    }
}

/// How many jobs of an owner are not over.
async fn under_way(tx: &mut Tx, owner: &str) -> Result<i64, JobStoreError> {
    let statement = "SELECT COUNT(*) AS jobs FROM job WHERE owner = $1 AND state IN ('accepted', 'running', 'paused')";
    Ok(sqlx::query(statement).bind(owner).fetch_one(&mut **tx).await?.try_get("jobs")?)
}

fn not_possible(job: &Job, wanted: &'static str) -> JobStoreError {
    JobStoreError::State { job: job.id.clone(), state: job.state.name().to_owned(), wanted }
}
