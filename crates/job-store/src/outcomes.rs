//! Results that later jobs of the same city take over: what a task made of certain inputs.
//!
//! The key is a hash of all that the result depends on, chosen by the worker. A task that was done leaves its outcome; one
//! whose key is known is finished with it and not done.

use crate::database::Tx;
use crate::{Artifact, Claim, Finished, JobStoreError, NewTask, Store};
use sqlx::Row;
use std::time::Duration;

impl Store {
    /// What a task of this key made in an earlier job of the city, as the claim's task can be finished with; none if that is
    /// not known.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn outcome(&self, claim: &Claim, key: &str) -> Result<Option<Finished>, JobStoreError> {
        let row = sqlx::query("SELECT tasks FROM outcome WHERE city = $1 AND key = $2")
            .bind(&claim.city)
            .bind(key)
            .fetch_optional(&self.pool)
            .await?;
        let Some(row) = row else { return Ok(None) };
        let text: String = row.try_get("tasks")?;
        let tasks: Vec<NewTask> = serde_json::from_str(&text)
            .map_err(|_| JobStoreError::Stored { what: "tasks of an outcome", value: text.clone() })?;
        let rows =
            sqlx::query("SELECT path, blob, bytes FROM outcome_artifact WHERE city = $1 AND key = $2 ORDER BY path")
                .bind(&claim.city)
                .bind(key)
                .fetch_all(&self.pool)
                .await?;
        let artifacts = rows.iter().map(Artifact::read).collect::<Result<_, _>>()?;
        Ok(Some(Finished { artifacts, tasks, reused: true, key: Some(key.to_owned()), publication: None }))
    }

    /// Forgets outcomes that were neither made nor taken over for this long, and gives their number.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn forget_outcomes(&self, unused: Duration) -> Result<u64, JobStoreError> {
        // The artefacts go with them.
        let forgotten = sqlx::query(self.sql("DELETE FROM outcome WHERE used < {now} - $1"))
            .bind(i64::try_from(unused.as_millis()).unwrap_or(i64::MAX))
            .execute(&self.pool)
            .await?;
        Ok(forgotten.rows_affected())
    }

    /// Keeps what a task made, or notes that it was taken over; false if what was taken over is not kept any more.
    pub(crate) async fn keep_outcome(
        &self,
        tx: &mut Tx,
        city: &str,
        key: &str,
        result: &Finished,
    ) -> Result<bool, JobStoreError> {
        if result.reused {
            let kept = sqlx::query(self.sql("UPDATE outcome SET used = {now} WHERE city = $1 AND key = $2"))
                .bind(city)
                .bind(key)
                .execute(&mut **tx)
                .await?;
            return Ok(crate::database::one_row(&kept));
        }
        let tasks = serde_json::to_string(&result.tasks)
            .map_err(|e| JobStoreError::Stored { what: "tasks of an outcome", value: e.to_string() })?;
        // A task that was done twice leaves what it made last. The row locks what else happens to this key.
        let statement = "INSERT INTO outcome (city, key, tasks, used) VALUES ($1, $2, $3, {now}) ON CONFLICT (city, key) \
                         DO UPDATE SET tasks = excluded.tasks, used = excluded.used";
        sqlx::query(self.sql(statement)).bind(city).bind(key).bind(tasks).execute(&mut **tx).await?;
        sqlx::query("DELETE FROM outcome_artifact WHERE city = $1 AND key = $2")
            .bind(city)
            .bind(key)
            .execute(&mut **tx)
            .await?;
        for artifact in &result.artifacts {
            sqlx::query("INSERT INTO outcome_artifact (city, key, path, blob, bytes) VALUES ($1, $2, $3, $4, $5)")
                .bind(city)
                .bind(key)
                .bind(&artifact.path)
                .bind(artifact.blob.to_string())
                .bind(artifact.bytes as i64)
                .execute(&mut **tx)
                .await?;
        }
        Ok(true)
    }
}
