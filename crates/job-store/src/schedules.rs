//! Jobs that are submitted again and again, by the clock.
//!
//! Several coordinators may look at the same schedule: a tick belongs to the one that moves the schedule on to its next tick, in the
//! transaction that also submits the job. So a tick has one run, whoever is killed when.

use crate::database::Tx;
use crate::members::of_members;
use crate::names::named;
use crate::{JobState, JobStoreError, NewJob, NewTask, Store};
use sqlx::Row;
use sqlx::any::AnyRow;

/// Runs that are remembered for each schedule.
const HISTORY: i64 = 1000;

named! {
    /// What becomes of a tick at which no coordinator was there.
    Missed, "missed ticks of a schedule", {
        /// Nothing: the next tick will come.
        Skip = "skip",
        /// One run as soon as a coordinator is there, however many ticks were missed.
        Once = "once",
    }
}

/// What a user says of a schedule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewSchedule {
    /// Its name, unique.
    pub name: String,
    /// Who owns its jobs.
    pub owner: String,
    /// The city that its jobs refresh.
    pub city: String,
    /// What each job is to do, as JSON.
    pub request: String,
    /// Priority of its jobs.
    pub priority: i64,
    /// When, as a cron expression.
    pub cron: String,
    /// Name of the time zone of the expression.
    pub zone: String,
    /// What becomes of ticks at which no coordinator was there.
    pub missed: Missed,
    /// Whether it ticks.
    pub enabled: bool,
    /// Its next tick, milliseconds since 1970; none if none will come.
    pub next: Option<i64>,
}

/// A schedule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// What a user said of it, and its next tick.
    pub said: NewSchedule,
    /// Number of its last run, from 1; 0 before the first.
    pub runs: i64,
    /// The job of the last run that had one.
    pub job: Option<String>,
    /// When it was made, milliseconds since 1970.
    pub created: i64,
}

named! {
    /// What became of a tick.
    RunOutcome, "outcome of a run", {
        /// A job was submitted.
        Submitted = "submitted",
        /// Nothing: the job of the run before was not over.
        Overlap = "overlap",
        /// Nothing: no coordinator was there at the time.
        Missed = "missed",
    }
}

/// A run of a schedule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScheduleRun {
    /// Its number, from 1.
    pub number: i64,
    /// The tick, milliseconds since 1970; for a run by hand, when it was asked for.
    pub due: i64,
    /// When it was looked at, milliseconds since 1970.
    pub at: i64,
    /// What became of it.
    pub outcome: RunOutcome,
    /// The job that was submitted.
    pub job: Option<String>,
}

/// What to do at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tick {
    /// Submit a job, unless the one before is not over.
    Run,
    /// Only note that the tick was missed.
    Miss,
}

const COLUMNS: &str = "name, owner, city, request, priority, cron, zone, missed, enabled, next, runs, job, created";

impl Schedule {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            said: NewSchedule {
                name: row.try_get("name")?,
                owner: row.try_get("owner")?,
                city: row.try_get("city")?,
                request: row.try_get("request")?,
                priority: row.try_get("priority")?,
                cron: row.try_get("cron")?,
                zone: row.try_get("zone")?,
                missed: row.try_get::<&str, _>("missed")?.parse()?,
                enabled: row.try_get::<i64, _>("enabled")? != 0,
                next: row.try_get("next")?,
            },
            runs: row.try_get("runs")?,
            job: row.try_get("job")?,
            created: row.try_get("created")?,
        })
    }
}

impl Store {
    /// The database's clock, milliseconds since 1970.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn clock(&self) -> Result<i64, JobStoreError> {
        Ok(sqlx::query(self.sql("SELECT {now} AS now")).fetch_one(&self.pool).await?.try_get("now")?)
    }

    /// Adds a schedule; false if the name is taken.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn add_schedule(&self, new: &NewSchedule) -> Result<bool, JobStoreError> {
        let statement = "INSERT INTO schedule (name, owner, city, request, priority, cron, zone, missed, enabled, next, runs, created) \
                         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, 0, {now}) ON CONFLICT (name) DO NOTHING";
        let added = self.bound(statement, new).execute(&self.pool).await?;
        Ok(crate::database::one_row(&added))
    }

    /// Changes a schedule; its runs stay. False if there is none of this name.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn change_schedule(&self, new: &NewSchedule) -> Result<bool, JobStoreError> {
        let statement = "UPDATE schedule SET owner = $2, city = $3, request = $4, priority = $5, cron = $6, zone = $7, missed = $8, \
                         enabled = $9, next = $10 WHERE name = $1";
        let changed = self.bound(statement, new).execute(&self.pool).await?;
        Ok(crate::database::one_row(&changed))
    }

    fn bound<'q>(
        &self,
        statement: &'static str,
        new: &'q NewSchedule,
    ) -> sqlx::query::Query<'q, sqlx::Any, sqlx::any::AnyArguments> {
        sqlx::query(self.sql(statement))
            .bind(&new.name)
            .bind(&new.owner)
            .bind(&new.city)
            .bind(&new.request)
            .bind(new.priority)
            .bind(&new.cron)
            .bind(&new.zone)
            .bind(new.missed.name())
            .bind(i64::from(new.enabled))
            .bind(new.next)
    }

    /// Removes a schedule with its history; its jobs stay. False if there is none of this name.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn remove_schedule(&self, name: &str) -> Result<bool, JobStoreError> {
        let removed = sqlx::query("DELETE FROM schedule WHERE name = $1").bind(name).execute(&self.pool).await?;
        Ok(crate::database::one_row(&removed))
    }

    /// A schedule.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn schedule(&self, name: &str) -> Result<Option<Schedule>, JobStoreError> {
        let statement = format!("SELECT {COLUMNS} FROM schedule WHERE name = $1");
        let row = sqlx::query(sqlx::AssertSqlSafe(statement)).bind(name).fetch_optional(&self.pool).await?;
        row.as_ref().map(Schedule::read).transpose()
    }

    /// Schedules by name, those after `after`, at most `limit`; with names, only of cities that have one of these as a member.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn schedules(
        &self,
        seen_by: Option<&[String]>,
        after: Option<&str>,
        limit: i64,
    ) -> Result<Vec<Schedule>, JobStoreError> {
        let names = seen_by.unwrap_or_default();
        let seen = seen_by.map_or_else(String::new, |_| format!("{} AND ", of_members("city", 3, names.len())));
        let statement = format!("SELECT {COLUMNS} FROM schedule WHERE {seen}name > $1 ORDER BY name LIMIT $2");
        let query = sqlx::query(sqlx::AssertSqlSafe(statement)).bind(after.unwrap_or_default()).bind(limit);
        let rows = names.iter().fold(query, |query, name| query.bind(name)).fetch_all(&self.pool).await?;
        rows.iter().map(Schedule::read).collect()
    }

    /// The schedules whose next tick has come, those that wait longest first.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn due_schedules(&self) -> Result<Vec<Schedule>, JobStoreError> {
        let statement =
            format!("SELECT {COLUMNS} FROM schedule WHERE enabled = 1 AND next <= {} ORDER BY next, name", self.now());
        let rows = sqlx::query(sqlx::AssertSqlSafe(statement)).fetch_all(&self.pool).await?;
        rows.iter().map(Schedule::read).collect()
    }

    /// Carries a tick out, and moves the schedule on to the following one. None if someone else was quicker, or the schedule was
    /// changed meanwhile.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn tick(
        &self,
        schedule: &Schedule,
        tick: Tick,
        first: &NewTask,
        following: Option<i64>,
    ) -> Result<Option<ScheduleRun>, JobStoreError> {
        let Some(due) = schedule.said.next else { return Ok(None) };
        let mut tx = self.begin().await?;
        let won = sqlx::query(
            "UPDATE schedule SET next = $3, runs = runs + 1 WHERE name = $1 AND next = $2 AND enabled = 1 AND request = $4",
        )
        .bind(&schedule.said.name)
        .bind(due)
        .bind(following)
        .bind(&schedule.said.request)
        .execute(&mut *tx)
        .await?;
        if !crate::database::one_row(&won) {
            return Ok(None);
        }
        let run = self.run_of(&mut tx, &schedule.said, due, tick, first).await?;
        self.commit(tx).await?;
        Ok(Some(run))
    }

    /// Submits a job of a schedule at once, beside its ticks, unless the one before is not over. None if there is no such schedule.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn run_schedule(&self, name: &str, first: &NewTask) -> Result<Option<ScheduleRun>, JobStoreError> {
        let mut tx = self.begin().await?;
        let locked = sqlx::query("UPDATE schedule SET runs = runs + 1 WHERE name = $1").bind(name).execute(&mut *tx);
        if !crate::database::one_row(&locked.await?) {
            return Ok(None);
        }
        let statement = format!("SELECT {COLUMNS} FROM schedule WHERE name = $1");
        let row = sqlx::query(sqlx::AssertSqlSafe(statement)).bind(name).fetch_one(&mut *tx).await?;
        let schedule = Schedule::read(&row)?;
        let due: i64 = sqlx::query(self.sql("SELECT {now} AS now")).fetch_one(&mut *tx).await?.try_get("now")?;
        let run = self.run_of(&mut tx, &schedule.said, due, Tick::Run, first).await?;
        self.commit(tx).await?;
        Ok(Some(run))
    }

    /// Carries a run out; the schedule is locked, and its number of runs raised.
    async fn run_of(
        &self,
        tx: &mut Tx,
        schedule: &NewSchedule,
        due: i64,
        tick: Tick,
        first: &NewTask,
    ) -> Result<ScheduleRun, JobStoreError> {
        let before = sqlx::query(
            "SELECT schedule.runs, job.state FROM schedule LEFT JOIN job ON job.id = schedule.job WHERE schedule.name = $1",
        )
        .bind(&schedule.name)
        .fetch_one(&mut **tx)
        .await?;
        let number: i64 = before.try_get("runs")?;
        // The job may have been forgotten.
        let state = before.try_get::<Option<String>, _>("state")?.map(|s| s.parse::<JobState>()).transpose()?;
        let outcome = match tick {
            Tick::Miss => RunOutcome::Missed,
            Tick::Run if state.is_none_or(JobState::is_over) => RunOutcome::Submitted,
            Tick::Run => RunOutcome::Overlap,
        };
        let mut job = None;
        if outcome == RunOutcome::Submitted {
            let new = NewJob {
                city: schedule.city.clone(),
                owner: schedule.owner.clone(),
                request: schedule.request.clone(),
                priority: schedule.priority,
                tasks: vec![first.clone()],
                ..NewJob::default()
            };
            let submitted = self.submit_in(tx, &new).await?;
            sqlx::query("UPDATE schedule SET job = $2 WHERE name = $1")
                .bind(&schedule.name)
                .bind(&submitted.id)
                .execute(&mut **tx)
                .await?;
            job = Some(submitted.id);
        }
        let statement = "INSERT INTO schedule_run (schedule, number, due, at, outcome, job) \
                         VALUES ($1, $2, $3, {now}, $4, $5) RETURNING at";
        let row = sqlx::query(self.sql(statement))
            .bind(&schedule.name)
            .bind(number)
            .bind(due)
            .bind(outcome.name())
            .bind(&job)
            .fetch_one(&mut **tx)
            .await?;
        sqlx::query("DELETE FROM schedule_run WHERE schedule = $1 AND number <= $2")
            .bind(&schedule.name)
            .bind(number - HISTORY)
            .execute(&mut **tx)
            .await?;
        Ok(ScheduleRun { number, due, at: row.try_get("at")?, outcome, job })
    }

    /// The runs of a schedule, newest first, those before number `before`, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn schedule_runs(
        &self,
        name: &str,
        before: Option<i64>,
        limit: i64,
    ) -> Result<Vec<ScheduleRun>, JobStoreError> {
        let rows = sqlx::query(
            "SELECT number, due, at, outcome, job FROM schedule_run WHERE schedule = $1 AND number < $2 \
             ORDER BY number DESC LIMIT $3",
        )
        .bind(name)
        .bind(before.unwrap_or(i64::MAX))
        .bind(limit)
        .fetch_all(&self.pool)
        .await?;
        rows.iter()
            .map(|row| {
                Ok(ScheduleRun {
                    number: row.try_get("number")?,
                    due: row.try_get("due")?,
                    at: row.try_get("at")?,
                    outcome: row.try_get::<&str, _>("outcome")?.parse()?,
                    job: row.try_get("job")?,
                })
            })
            .collect()
    }
}
