//! Meshes that users have sent.

use crate::database::Tx;
use crate::members::{of_members, places};
use crate::{Artifact, JobStoreError, Store, UploadQuota, parts};
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, Row};
use std::time::Duration;

/// Files that one statement adds.
const SOME: usize = 200;

/// A mesh that a user has sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Upload {
    /// Id.
    pub id: String,
    /// Who has sent it.
    pub owner: String,
    /// The city whose members may use it; none for its sender only.
    pub city: Option<String>,
    /// The name under which it was sent.
    pub name: String,
    /// Size of its files.
    pub bytes: u64,
    /// Number of its files.
    pub files: u64,
    /// When it was sent, milliseconds since 1970; set by the database's clock.
    pub created: i64,
}

impl Upload {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            id: row.try_get("id")?,
            owner: row.try_get("owner")?,
            city: row.try_get("city")?,
            name: row.try_get("name")?,
            bytes: row.try_get::<i64, _>("bytes")? as u64,
            files: row.try_get::<i64, _>("files")? as u64,
            created: row.try_get("created")?,
        })
    }
}

impl Store {
    /// Adds an upload whose files are in the object store, and held.
    ///
    /// # Errors
    /// If its owner may have no more bytes here, or the database does not answer.
    pub async fn add_upload(
        &self,
        upload: &Upload,
        files: &[Artifact],
        quota: UploadQuota,
    ) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        parts::lock_owner(&mut tx, &upload.owner).await?;
        self.insert_upload(&mut tx, upload, files).await?;
        parts::within(&mut tx, &upload.owner, quota).await?;
        self.commit(tx).await
    }

    pub(crate) async fn insert_upload(
        &self,
        tx: &mut Tx,
        upload: &Upload,
        files: &[Artifact],
    ) -> Result<(), JobStoreError> {
        let statement = "INSERT INTO upload (id, owner, name, bytes, files, city, created, used) \
                         VALUES ($1, $2, $3, $4, $5, $6, {now}, {now})";
        sqlx::query(self.sql(statement))
            .bind(&upload.id)
            .bind(&upload.owner)
            .bind(&upload.name)
            .bind(upload.bytes as i64)
            .bind(upload.files as i64)
            .bind(&upload.city)
            .execute(&mut **tx)
            .await?;
        for some in files.chunks(SOME) {
            let places: Vec<String> =
                (0..some.len()).map(|i| format!("($1, ${}, ${}, ${})", 3 * i + 2, 3 * i + 3, 3 * i + 4)).collect();
            let statement = format!("INSERT INTO upload_file (upload, path, blob, bytes) VALUES {}", places.join(", "));
            let mut query = sqlx::query(AssertSqlSafe(statement)).bind(&upload.id);
            for file in some {
                query = query.bind(&file.path).bind(file.blob.to_string()).bind(file.bytes as i64);
            }
            query.execute(&mut **tx).await?;
        }
        Ok(())
    }

    /// An upload.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn upload(&self, id: &str) -> Result<Option<Upload>, JobStoreError> {
        let row = sqlx::query("SELECT id, owner, city, name, bytes, files, created FROM upload WHERE id = $1")
            .bind(id)
            .fetch_optional(&self.pool)
            .await?;
        row.as_ref().map(Upload::read).transpose()
    }

    /// Uploads, newest first, at most `limit`; with names, only those that one of them has sent, or that are of a city that has one of
    /// them as a member.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn uploads(&self, seen_by: Option<&[String]>, limit: i64) -> Result<Vec<Upload>, JobStoreError> {
        let names = seen_by.unwrap_or_default();
        let seen = seen_by.map_or_else(String::new, |_| {
            let (sent, of_city) = (places(2, names.len()), of_members("city", 2, names.len()));
            format!("WHERE owner IN ({sent}) OR {of_city}")
        });
        let statement =
            format!("SELECT id, owner, city, name, bytes, files, created FROM upload {seen} ORDER BY id DESC LIMIT $1");
        let query = sqlx::query(AssertSqlSafe(statement)).bind(limit);
        let rows = names.iter().fold(query, |query, name| query.bind(name)).fetch_all(&self.pool).await?;
        rows.iter().map(Upload::read).collect()
    }

    /// The files of an upload, by path, for a task that is about to read them; none if there is no such upload.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn upload_files(&self, id: &str) -> Result<Vec<Artifact>, JobStoreError> {
        sqlx::query(self.sql("UPDATE upload SET used = {now} WHERE id = $1")).bind(id).execute(&self.pool).await?;
        let rows = sqlx::query("SELECT path, blob, bytes FROM upload_file WHERE upload = $1 ORDER BY path")
            .bind(id)
            .fetch_all(&self.pool)
            .await?;
        rows.iter().map(Artifact::read).collect()
    }

    /// Removes an upload; its contents are collected later. False if there is none of this id.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn remove_upload(&self, id: &str) -> Result<bool, JobStoreError> {
        let removed = sqlx::query("DELETE FROM upload WHERE id = $1").bind(id).execute(&self.pool).await?;
        Ok(crate::database::one_row(&removed))
    }

    /// Forgets uploads that no task has read for so long, and gives their number.
    pub(crate) async fn forget_uploads(&self, unused: Duration) -> Result<u64, JobStoreError> {
        let unused = i64::try_from(unused.as_millis()).unwrap_or(i64::MAX);
        let forgotten = sqlx::query(self.sql("DELETE FROM upload WHERE used < {now} - $1")).bind(unused);
        Ok(forgotten.execute(&self.pool).await?.rows_affected())
    }
}
