//! Which content lies under which path of a job.

use crate::database::Tx;
use crate::{BlobId, JobStoreError, Store};
use sqlx::Row;

/// Something that a task made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Artifact {
    /// Path within the job, parts joined by `/`.
    pub path: String,
    /// Its content.
    pub blob: BlobId,
    /// Its size.
    pub bytes: u64,
}

impl Store {
    /// The artefacts of a job whose paths begin with `prefix`, by path.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn artifacts(&self, job: &str, prefix: &str) -> Result<Vec<Artifact>, JobStoreError> {
        // Not LIKE: a prefix may hold its signs.
        let rows = sqlx::query(
            "SELECT path, blob, bytes FROM artifact WHERE job = $1 AND SUBSTR(path, 1, LENGTH($2)) = $2 ORDER BY path",
        )
        .bind(job)
        .bind(prefix)
        .fetch_all(&self.pool)
        .await?;
        rows.iter()
            .map(|row| {
                let blob: String = row.try_get("blob")?;
                let blob = blob.parse().map_err(|()| JobStoreError::Stored { what: "blob", value: blob })?;
                Ok(Artifact { path: row.try_get("path")?, blob, bytes: row.try_get::<i64, _>("bytes")? as u64 })
            })
            .collect()
    }

    /// Which of these blobs some job still refers to.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn is_referenced(&self, blob: BlobId) -> Result<bool, JobStoreError> {
        let row = sqlx::query("SELECT COUNT(*) AS uses FROM artifact WHERE blob = $1")
            .bind(blob.to_string())
            .fetch_one(&self.pool)
            .await?;
        Ok(row.try_get::<i64, _>("uses")? > 0)
    }

    /// Adds artefacts; one with the same path is replaced.
    pub(crate) async fn add_artifacts(
        &self,
        tx: &mut Tx,
        job: &str,
        artifacts: &[Artifact],
    ) -> Result<(), JobStoreError> {
        for artifact in artifacts {
            sqlx::query(
                "INSERT INTO artifact (job, path, blob, bytes) VALUES ($1, $2, $3, $4) \
                 ON CONFLICT (job, path) DO UPDATE SET blob = excluded.blob, bytes = excluded.bytes",
            )
            .bind(job)
            .bind(&artifact.path)
            .bind(artifact.blob.to_string())
            .bind(artifact.bytes as i64)
            .execute(&mut **tx)
            .await?;
        }
        Ok(())
    }
}
