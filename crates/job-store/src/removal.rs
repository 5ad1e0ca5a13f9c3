//! Removing jobs, generations and cities: at once by people, and by count and age from time to time.
//!
//! Contents are not removed here: what nothing refers to any more is collected later.

use crate::database::{Tx, one_row};
use crate::{JobStoreError, Store};
use sqlx::{AssertSqlSafe, Row};
use std::time::Duration;

/// Rows that are removed in one transaction: others wait meanwhile.
const SOME: i64 = 100;

/// What is kept, and for how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Retention {
    /// Generations of a city that are kept, with the one that readers see; 0 for all.
    pub generations: i64,
    /// Age from which a generation goes that readers do not see; none for never.
    pub generation_age: Option<Duration>,
    /// Age from which a job that is over goes, with its events, logs and result; none for never. What it published stays.
    pub job_age: Option<Duration>,
    /// Age from which entries of the audit log go; none for never.
    pub audit_age: Option<Duration>,
    /// Age from which workers that are not seen any more go.
    pub worker_age: Duration,
}

/// What was removed by count and age.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Purged {
    /// Generations.
    pub generations: u64,
    /// Jobs.
    pub jobs: u64,
    /// Entries of the audit log.
    pub audit: u64,
    /// Workers.
    pub workers: u64,
}

impl Store {
    /// Removes a job that is over, with its events, logs and result. What it published stays.
    ///
    /// # Errors
    /// If it is not over, or there is none.
    pub async fn delete_job(&self, id: &str) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        let job = self.locked(&mut tx, id).await?;
        if !job.state.is_over() {
            let (job, state) = (job.id, job.state.name().to_owned());
            return Err(JobStoreError::State { job, state, wanted: "to delete it, before it is cancelled," });
        }
        sqlx::query("DELETE FROM job WHERE id = $1").bind(id).execute(&mut *tx).await?;
        self.commit(tx).await
    }

    /// Removes a generation of a city that readers do not see; false if there is no such one.
    ///
    /// # Errors
    /// [`JobStoreError::Current`] if readers see it, or the database does not answer.
    pub async fn delete_generation(&self, city: &str, number: i64) -> Result<bool, JobStoreError> {
        let mut tx = self.begin().await?;
        sqlx::query("UPDATE city SET created = created WHERE name = $1").bind(city).execute(&mut *tx).await?;
        let row =
            sqlx::query("SELECT generation FROM city WHERE name = $1").bind(city).fetch_optional(&mut *tx).await?;
        let current = row.map(|row| row.try_get::<Option<i64>, _>("generation")).transpose()?.flatten();
        if current == Some(number) {
            return Err(JobStoreError::Current { city: city.to_owned(), number });
        }
        let removed = sqlx::query("DELETE FROM generation WHERE city = $1 AND number = $2").bind(city).bind(number);
        if !one_row(&removed.execute(&mut *tx).await?) {
            return Ok(false);
        }
        forget_rows(&mut tx, city).await?;
        self.commit(tx).await?;
        Ok(true)
    }

    /// Removes a city: its generations, jobs, members, and what jobs take over from each other. Uploads that were meant for it are their
    /// senders' alone from then on. False if there is no such city.
    ///
    /// # Errors
    /// [`JobStoreError::InUse`] if a job of it is not over or a schedule submits some, or the database does not answer.
    pub async fn delete_city(&self, city: &str) -> Result<bool, JobStoreError> {
        let mut tx = self.begin().await?;
        // Whoever submits a job for it waits here, and finds the city gone: it is theirs then.
        let locked = sqlx::query("UPDATE city_access SET claimed = claimed WHERE city = $1").bind(city);
        let claimed = one_row(&locked.execute(&mut *tx).await?);
        let locked = sqlx::query("UPDATE city SET created = created WHERE name = $1").bind(city);
        let published = one_row(&locked.execute(&mut *tx).await?);
        if !claimed && !published {
            return Ok(false);
        }
        let in_use = |by: String| JobStoreError::InUse { city: city.to_owned(), by };
        let job =
            "SELECT id FROM job WHERE city = $1 AND state IN ('accepted', 'running', 'paused') ORDER BY id LIMIT 1";
        if let Some(row) = sqlx::query(job).bind(city).fetch_optional(&mut *tx).await? {
            return Err(in_use(format!("job {} is not over: cancel it", row.try_get::<&str, _>("id")?)));
        }
        let schedule = "SELECT name FROM schedule WHERE city = $1 ORDER BY name LIMIT 1";
        if let Some(row) = sqlx::query(schedule).bind(city).fetch_optional(&mut *tx).await? {
            return Err(in_use(format!(
                "schedule {} submits jobs for it: delete that",
                row.try_get::<&str, _>("name")?
            )));
        }
        for statement in [
            "DELETE FROM city WHERE name = $1",
            "DELETE FROM outcome WHERE city = $1",
            "DELETE FROM job WHERE city = $1",
            "UPDATE upload SET city = NULL WHERE city = $1",
            "UPDATE open_upload SET city = NULL WHERE city = $1",
            "DELETE FROM city_access WHERE city = $1",
        ] {
            sqlx::query(statement).bind(city).execute(&mut *tx).await?;
        }
        self.commit(tx).await?;
        Ok(true)
    }

    /// Removes what is kept no longer. Several may do so at once.
    ///
    /// # Errors
    /// If the database does not answer; what was done until then is done.
    pub async fn purge(&self, keep: &Retention) -> Result<Purged, JobStoreError> {
        let mut purged = Purged { workers: self.forget_workers(keep.worker_age).await?, ..Purged::default() };
        if let Some(age) = keep.audit_age {
            purged.audit = self.purge_audit(age).await?;
        }
        if let Some(age) = keep.job_age {
            let statement = "DELETE FROM job WHERE id IN (SELECT id FROM job WHERE finished < {now} - $1 \
                             AND state IN ('successful', 'partial', 'failed', 'cancelled') ORDER BY id LIMIT $2)";
            loop {
                let query = sqlx::query(self.sql(statement)).bind(milliseconds(age)).bind(SOME);
                let some = query.execute(&self.pool).await?.rows_affected();
                purged.jobs += some;
                if some == 0 {
                    break;
                }
            }
        }
        for (city, number) in self.stale_generations(keep).await? {
            match self.delete_generation(&city, number).await {
                Ok(removed) => purged.generations += u64::from(removed),
                // It became the current one just now.
                Err(JobStoreError::Current { .. }) => {}
                Err(e) => return Err(e),
            }
        }
        Ok(purged)
    }

    /// Generations that are kept no longer, with their cities.
    async fn stale_generations(&self, keep: &Retention) -> Result<Vec<(String, i64)>, JobStoreError> {
        if keep.generations == 0 && keep.generation_age.is_none() {
            return Ok(Vec::new());
        }
        let (most, age) = (keep.generations, keep.generation_age.map_or(i64::MAX / 4, milliseconds));
        let statement = "SELECT generation.city, generation.number FROM generation JOIN city ON city.name = generation.city \
                         WHERE generation.number < city.generation AND (generation.made < {now} - $2 OR ($1 > 0 AND $1 <= \
                         (SELECT COUNT(*) FROM generation AS newer WHERE newer.city = generation.city \
                         AND newer.number > generation.number))) ORDER BY generation.city, generation.number";
        let rows = sqlx::query(self.sql(statement)).bind(most).bind(age).fetch_all(&self.pool).await?;
        rows.iter().map(|row| Ok((row.try_get("city")?, row.try_get("number")?))).collect()
    }
}

/// Removes the rows of buildings and files of a city that hold for no generation any more.
async fn forget_rows(tx: &mut Tx, city: &str) -> Result<(), JobStoreError> {
    for table in ["building", "city_file"] {
        let statement = format!(
            "DELETE FROM {table} WHERE city = $1 AND until IS NOT NULL AND NOT EXISTS (SELECT 1 FROM generation \
             WHERE generation.city = $1 AND generation.number >= {table}.since AND generation.number < {table}.until)"
        );
        sqlx::query(AssertSqlSafe(statement)).bind(city).execute(&mut **tx).await?;
    }
    Ok(())
}

fn milliseconds(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX / 4)
}
