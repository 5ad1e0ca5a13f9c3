//! Removing blobs that nothing refers to.
//!
//! Who is about to refer to a blob *holds* it first, also if it is there already: from then on it is not removed. The removal of one
//! is decided on the row of its hold, so the two cannot miss each other. What is left behind by a collector that was killed
//! is removed by the next one.

use crate::{BlobId, Blobs, JobStoreError, Store};
use sqlx::{AssertSqlSafe, Row};
use std::time::Duration;

/// Blobs in one statement.
const SOME: usize = 200;

/// What was removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Collected {
    /// Blobs.
    pub blobs: u64,
    /// Outcomes that no job has taken over for long.
    pub outcomes: u64,
    /// Artefacts of jobs that are over, but for their results.
    pub artifacts: u64,
}

impl Store {
    /// Keeps blobs from being removed for `time`; true if all of them are held now. If not, some are just being removed: try
    /// again soon, and only then put them.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn hold(&self, blobs: &[BlobId], time: Duration) -> Result<bool, JobStoreError> {
        let mut names: Vec<String> = blobs.iter().map(ToString::to_string).collect();
        names.sort_unstable();
        names.dedup();
        let mut all = true;
        for some in names.chunks(SOME) {
            let places: Vec<String> = (2..some.len() + 2).map(|i| format!("(${i}, {{now}} + $1, 0)")).collect();
            let statement = format!(
                "INSERT INTO blob_hold (blob, until, doomed) VALUES {} ON CONFLICT (blob) \
                 DO UPDATE SET until = excluded.until WHERE blob_hold.doomed = 0",
                places.join(", ")
            );
            let mut query = sqlx::query(self.sql_of(&statement)).bind(milliseconds(time));
            for name in some {
                query = query.bind(name);
            }
            all &= query.execute(&self.pool).await?.rows_affected() == some.len() as u64;
        }
        Ok(all)
    }

    /// Removes blobs of at least this age that nothing refers to and nobody holds, after forgetting outcomes that were unused for
    /// `outcomes`, uploads that no task has read for `jobs`, and artefacts other than results of jobs that were over
    /// before `jobs`.
    /// Several may do so at once.
    ///
    /// # Errors
    /// If the database or the object store does not answer; what was done until then is done.
    pub async fn collect(
        &self,
        blobs: &Blobs,
        age: Duration,
        outcomes: Duration,
        jobs: Duration,
    ) -> Result<Collected, JobStoreError> {
        let mut collected = Collected { outcomes: self.forget_outcomes(outcomes).await?, ..Collected::default() };
        self.forget_uploads(jobs).await?;
        self.forget_open_uploads().await?;
        let mut tx = self.begin().await?;
        // Those that failed in part could be retried until then.
        let statement = "UPDATE job SET emptied = 1 WHERE emptied = 0 AND finished < {now} - $1 \
                         AND state IN ('successful', 'partial', 'failed', 'cancelled')";
        sqlx::query(self.sql(statement)).bind(milliseconds(jobs)).execute(&mut *tx).await?;
        let statement = "DELETE FROM artifact WHERE SUBSTR(path, 1, 7) <> 'result/' AND job IN \
                         (SELECT id FROM job WHERE emptied = 1 AND state IN ('successful', 'partial', 'failed', 'cancelled'))";
        collected.artifacts = sqlx::query(statement).execute(&mut *tx).await?.rows_affected();
        tx.commit().await?;
        for row in sqlx::query("SELECT blob FROM blob_hold WHERE doomed = 1").fetch_all(&self.pool).await? {
            let name: String = row.try_get("blob")?;
            let blob = name.parse().map_err(|()| JobStoreError::Stored { what: "blob", value: name })?;
            self.remove(blobs, blob).await?;
        }
        for blob in blobs.older_than(age).await? {
            if self.doom(blob).await? {
                self.remove(blobs, blob).await?;
                collected.blobs += 1;
            }
        }
        let statement = "DELETE FROM blob_hold WHERE doomed = 0 AND until < {now}";
        sqlx::query(self.sql(statement)).execute(&self.pool).await?;
        Ok(collected)
    }

    /// Decides that a blob is to be removed; false if it is in use.
    async fn doom(&self, blob: BlobId) -> Result<bool, JobStoreError> {
        // Most blobs are in use, and need no transaction to be left alone.
        if self.is_referenced(blob).await? {
            return Ok(false);
        }
        let mut tx = self.begin().await?;
        let statement = "INSERT INTO blob_hold (blob, until, doomed) VALUES ($1, 0, 1) ON CONFLICT (blob) \
                         DO UPDATE SET doomed = 1 WHERE blob_hold.doomed = 0 AND blob_hold.until < {now}";
        let doomed = sqlx::query(self.sql(statement)).bind(blob.to_string()).execute(&mut *tx).await?;
        // Asked again: what was held until now has been referred to, or never will be.
        if !crate::database::one_row(&doomed) || self.is_referenced_in(&mut tx, blob).await? {
            return Ok(false);
        }
        tx.commit().await?;
        Ok(true)
    }

    async fn remove(&self, blobs: &Blobs, blob: BlobId) -> Result<(), JobStoreError> {
        blobs.remove(blob).await?;
        sqlx::query("DELETE FROM blob_hold WHERE blob = $1 AND doomed = 1")
            .bind(blob.to_string())
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    pub(crate) fn sql_of(&self, statement: &str) -> AssertSqlSafe<String> {
        AssertSqlSafe(statement.replace("{now}", self.now()))
    }
}

fn milliseconds(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}
