//! Which content lies under which path of a job.

use crate::database::Tx;
use crate::{BlobId, JobStoreError, Store};
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, Row};
use std::collections::BTreeMap;

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

/// Paths that are looked for at once.
const PLACES: usize = 500;

/// One row if anything refers to the blob.
const REFERENCES: &str = "SELECT path FROM artifact WHERE blob = $1 UNION ALL \
                          SELECT path FROM city_file WHERE blob = $1 UNION ALL \
                          SELECT path FROM outcome_artifact WHERE blob = $1 UNION ALL \
                          SELECT path FROM upload_file WHERE blob = $1 UNION ALL \
                          SELECT upload FROM upload_part WHERE blob = $1 LIMIT 1";

impl Artifact {
    pub(crate) fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        let blob: String = row.try_get("blob")?;
        let blob = blob.parse().map_err(|()| JobStoreError::Stored { what: "blob", value: blob })?;
        Ok(Self { path: row.try_get("path")?, blob, bytes: row.try_get::<i64, _>("bytes")? as u64 })
    }
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
        rows.iter().map(Artifact::read).collect()
    }

    /// The artefacts of a job at these places, by path: paths, or folders, which end with `/`. What is not there is not given.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn artifacts_at(&self, job: &str, places: &[String]) -> Result<Vec<Artifact>, JobStoreError> {
        let mut found: BTreeMap<String, Artifact> = BTreeMap::new();
        let (folders, paths): (Vec<&String>, Vec<&String>) = places.iter().partition(|p| p.ends_with('/'));
        for folder in folders {
            found.extend(self.artifacts(job, folder).await?.into_iter().map(|a| (a.path.clone(), a)));
        }
        for some in paths.chunks(PLACES) {
            let values: Vec<String> = (2..some.len() + 2).map(|i| format!("${i}")).collect();
            let statement =
                format!("SELECT path, blob, bytes FROM artifact WHERE job = $1 AND path IN ({})", values.join(", "));
            let mut query = sqlx::query(AssertSqlSafe(statement)).bind(job);
            for path in some {
                query = query.bind(*path);
            }
            for row in &query.fetch_all(&self.pool).await? {
                let artifact = Artifact::read(row)?;
                found.insert(artifact.path.clone(), artifact);
            }
        }
        Ok(found.into_values().collect())
    }

    /// Whether a job, a generation of a city, an upload, or an outcome that may be taken over refers to a blob.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn is_referenced(&self, blob: BlobId) -> Result<bool, JobStoreError> {
        Ok(sqlx::query(REFERENCES).bind(blob.to_string()).fetch_optional(&self.pool).await?.is_some())
    }

    pub(crate) async fn is_referenced_in(&self, tx: &mut Tx, blob: BlobId) -> Result<bool, JobStoreError> {
        Ok(sqlx::query(REFERENCES).bind(blob.to_string()).fetch_optional(&mut **tx).await?.is_some())
    }

    /// Adds what a task of a stage made; an artefact with the same path is replaced.
    pub(crate) async fn add_artifacts(
        &self,
        tx: &mut Tx,
        job: &str,
        stage: i64,
        artifacts: &[Artifact],
    ) -> Result<(), JobStoreError> {
        for artifact in artifacts {
            sqlx::query(
                "INSERT INTO artifact (job, path, blob, bytes, stage) VALUES ($1, $2, $3, $4, $5) \
                 ON CONFLICT (job, path) DO UPDATE SET blob = excluded.blob, bytes = excluded.bytes, stage = excluded.stage",
            )
            .bind(job)
            .bind(&artifact.path)
            .bind(artifact.blob.to_string())
            .bind(artifact.bytes as i64)
            .bind(stage)
            .execute(&mut **tx)
            .await?;
        }
        Ok(())
    }
}
