//! Uploads that come in parts, so that a connection that breaks costs one of them.

use crate::database::Tx;
use crate::{Artifact, BlobId, JobStoreError, Store, Upload};
use sqlx::Row;
use sqlx::any::AnyRow;
use std::time::Duration;

/// How long an upload under way is kept without a sign of its sender.
const SILENCE: Duration = Duration::from_secs(24 * 3600);

/// What one owner may have on the service at a time.
#[derive(Clone, Copy, Debug)]
pub struct UploadQuota {
    /// Most uploads under way.
    pub open: i64,
    /// Most bytes of uploads and of parts of those under way.
    pub bytes: u64,
}

/// An upload under way, or one that has ended not long ago.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenUpload {
    /// Id.
    pub id: String,
    /// Who sends it.
    pub owner: String,
    /// The city whose members may use what it becomes; none for its sender only.
    pub city: Option<String>,
    /// The name under which it is sent.
    pub name: String,
    /// When it was begun, milliseconds since 1970; set by the database's clock.
    pub created: i64,
    /// When it is forgotten if nothing comes, milliseconds since 1970.
    pub expires: i64,
    /// Whether a coordinator puts it together just now.
    pub held: bool,
    /// The upload that it has become.
    pub upload: Option<String>,
    /// Why it cannot become one.
    pub problem: Option<String>,
}

impl OpenUpload {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        let touched: i64 = row.try_get("touched")?;
        Ok(Self {
            id: row.try_get("id")?,
            owner: row.try_get("owner")?,
            city: row.try_get("city")?,
            name: row.try_get("name")?,
            created: row.try_get("created")?,
            expires: touched + SILENCE.as_millis() as i64,
            held: row.try_get::<i64, _>("held")? == 1,
            upload: row.try_get("upload")?,
            problem: row.try_get("problem")?,
        })
    }
}

const OPEN: &str = "SELECT id, owner, city, name, created, touched, upload, problem, \
                    CAST(CASE WHEN held_until > {now} THEN 1 ELSE 0 END AS BIGINT) AS held FROM open_upload";

/// A part of an upload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UploadPart {
    /// Number, from 1, in the order of the file.
    pub number: i64,
    /// Content.
    pub blob: BlobId,
    /// Its size.
    pub bytes: u64,
    /// Its SHA-256, hexadecimal.
    pub sha256: String,
}

impl Store {
    /// Begins an upload in parts.
    ///
    /// # Errors
    /// If its owner has as many under way as they may, or the database does not answer.
    pub async fn open_upload(
        &self,
        id: &str,
        owner: &str,
        name: &str,
        city: Option<&str>,
        quota: UploadQuota,
    ) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        lock_owner(&mut tx, owner).await?;
        let count =
            "SELECT COUNT(*) AS uploads FROM open_upload WHERE owner = $1 AND upload IS NULL AND problem IS NULL";
        let open: i64 = sqlx::query(count).bind(owner).fetch_one(&mut *tx).await?.try_get("uploads")?;
        if open >= quota.open {
            return Err(JobStoreError::OpenUploads { owner: owner.to_owned(), most: quota.open });
        }
        let statement = "INSERT INTO open_upload (id, owner, name, city, created, touched, held_until) \
                         VALUES ($1, $2, $3, $4, {now}, {now}, 0)";
        sqlx::query(self.sql(statement)).bind(id).bind(owner).bind(name).bind(city).execute(&mut *tx).await?;
        self.commit(tx).await
    }

    /// An upload in parts.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn find_open_upload(&self, id: &str) -> Result<Option<OpenUpload>, JobStoreError> {
        let statement = format!("{OPEN} WHERE id = $1");
        let row = sqlx::query(self.sql_of(&statement)).bind(id).fetch_optional(&self.pool).await?;
        row.as_ref().map(OpenUpload::read).transpose()
    }

    /// The uploads in parts of an owner, newest first, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn open_uploads(&self, owner: &str, limit: i64) -> Result<Vec<OpenUpload>, JobStoreError> {
        let statement = format!("{OPEN} WHERE owner = $1 ORDER BY id DESC LIMIT $2");
        let rows = sqlx::query(self.sql_of(&statement)).bind(owner).bind(limit).fetch_all(&self.pool).await?;
        rows.iter().map(OpenUpload::read).collect()
    }

    /// The parts that have come, by number.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn upload_parts(&self, id: &str) -> Result<Vec<UploadPart>, JobStoreError> {
        let statement = "SELECT number, blob, bytes, sha256 FROM upload_part WHERE upload = $1 ORDER BY number";
        let rows = sqlx::query(statement).bind(id).fetch_all(&self.pool).await?;
        let read = |row: &AnyRow| {
            let name: String = row.try_get("blob")?;
            let blob = name.parse().map_err(|()| JobStoreError::Stored { what: "blob", value: name })?;
            let bytes = row.try_get::<i64, _>("bytes")? as u64;
            Ok(UploadPart { number: row.try_get("number")?, blob, bytes, sha256: row.try_get("sha256")? })
        };
        rows.iter().map(read).collect()
    }

    /// Adds a part whose content is in the object store, and held; one of the same number is replaced. False if there is no such upload
    /// under way.
    ///
    /// # Errors
    /// If its owner may have no more bytes here, or the database does not answer.
    pub async fn add_part(
        &self,
        open: &OpenUpload,
        part: &UploadPart,
        quota: UploadQuota,
    ) -> Result<bool, JobStoreError> {
        let mut tx = self.begin().await?;
        lock_owner(&mut tx, &open.owner).await?;
        let statement = "UPDATE open_upload SET touched = {now} WHERE id = $1 AND upload IS NULL AND problem IS NULL \
                         AND held_until <= {now}";
        let touched = sqlx::query(self.sql(statement)).bind(&open.id).execute(&mut *tx).await?;
        if !crate::database::one_row(&touched) {
            return Ok(false);
        }
        sqlx::query(
            "INSERT INTO upload_part (upload, number, blob, bytes, sha256) VALUES ($1, $2, $3, $4, $5) \
             ON CONFLICT (upload, number) DO UPDATE SET blob = excluded.blob, bytes = excluded.bytes, sha256 = excluded.sha256",
        )
        .bind(&open.id)
        .bind(part.number)
        .bind(part.blob.to_string())
        .bind(part.bytes as i64)
        .bind(&part.sha256)
        .execute(&mut *tx)
        .await?;
        within(&mut tx, &open.owner, quota).await?;
        self.commit(tx).await?;
        Ok(true)
    }

    /// Holds an upload for putting it together, or holds it for longer; false if another does, or it is over.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn hold_open_upload(&self, id: &str, longer: bool, time: Duration) -> Result<bool, JobStoreError> {
        let statement = "UPDATE open_upload SET held_until = {now} + $2, touched = {now} WHERE id = $1 AND upload IS NULL \
                         AND problem IS NULL AND ($3 = 1 OR held_until <= {now})";
        let time = i64::try_from(time.as_millis()).unwrap_or(i64::MAX);
        let query = sqlx::query(self.sql(statement)).bind(id).bind(time).bind(i64::from(longer));
        Ok(crate::database::one_row(&query.execute(&self.pool).await?))
    }

    /// Lets go of an upload that could not be put together: for good, with the problem, or until another time.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn let_go_of_open_upload(&self, id: &str, problem: Option<&str>) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        sqlx::query("UPDATE open_upload SET held_until = 0, problem = $2 WHERE id = $1 AND upload IS NULL")
            .bind(id)
            .bind(problem)
            .execute(&mut *tx)
            .await?;
        if problem.is_some() {
            sqlx::query("DELETE FROM upload_part WHERE upload = $1").bind(id).execute(&mut *tx).await?;
        }
        self.commit(tx).await
    }

    /// Makes an upload of an upload in parts; its files are in the object store, and held. False if it is one already, or is gone.
    ///
    /// # Errors
    /// If its owner may have no more bytes here, or the database does not answer.
    pub async fn complete_upload(
        &self,
        id: &str,
        upload: &Upload,
        files: &[Artifact],
        quota: UploadQuota,
    ) -> Result<bool, JobStoreError> {
        let mut tx = self.begin().await?;
        lock_owner(&mut tx, &upload.owner).await?;
        let statement =
            "UPDATE open_upload SET upload = $2, held_until = 0, touched = {now} WHERE id = $1 AND upload IS NULL";
        let ours = sqlx::query(self.sql(statement)).bind(id).bind(&upload.id).execute(&mut *tx).await?;
        if !crate::database::one_row(&ours) {
            return Ok(false);
        }
        sqlx::query("DELETE FROM upload_part WHERE upload = $1").bind(id).execute(&mut *tx).await?;
        self.insert_upload(&mut tx, upload, files).await?;
        within(&mut tx, &upload.owner, quota).await?;
        self.commit(tx).await?;
        Ok(true)
    }

    /// Gives an upload in parts up; its contents are collected later. False if there is none of this id.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn abort_upload(&self, id: &str) -> Result<bool, JobStoreError> {
        let removed = sqlx::query("DELETE FROM open_upload WHERE id = $1").bind(id).execute(&self.pool).await?;
        self.note_write();
        Ok(crate::database::one_row(&removed))
    }

    /// Bytes of what an owner has sent and is sending.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn sent_bytes(&self, owner: &str) -> Result<u64, JobStoreError> {
        let mut tx = self.pool.begin().await?;
        sent_bytes(&mut tx, owner).await
    }

    /// Forgets uploads in parts from which nothing has come for long.
    pub(crate) async fn forget_open_uploads(&self) -> Result<(), JobStoreError> {
        let statement = "DELETE FROM open_upload WHERE touched < {now} - $1 AND held_until <= {now}";
        sqlx::query(self.sql(statement)).bind(SILENCE.as_millis() as i64).execute(&self.pool).await?;
        Ok(())
    }
}

/// What is counted of an owner does not change until the transaction ends. An owner without a token, at a service that is open, is on
/// SQLite, where writers follow one another anyway, or alone.
pub(crate) async fn lock_owner(tx: &mut Tx, owner: &str) -> Result<(), JobStoreError> {
    sqlx::query("UPDATE api_token SET created = created WHERE name = $1").bind(owner).execute(&mut **tx).await?;
    Ok(())
}

/// An error if an owner has more bytes here than they may.
pub(crate) async fn within(tx: &mut Tx, owner: &str, quota: UploadQuota) -> Result<(), JobStoreError> {
    if sent_bytes(tx, owner).await? > quota.bytes {
        return Err(JobStoreError::UploadBytes { owner: owner.to_owned(), most: quota.bytes });
    }
    Ok(())
}

async fn sent_bytes(tx: &mut Tx, owner: &str) -> Result<u64, JobStoreError> {
    let statement = "SELECT CAST(COALESCE(SUM(bytes), 0) AS BIGINT) AS bytes FROM ( \
                     SELECT bytes FROM upload WHERE owner = $1 UNION ALL \
                     SELECT upload_part.bytes FROM upload_part JOIN open_upload ON open_upload.id = upload_part.upload \
                     WHERE open_upload.owner = $1) AS sent";
    Ok(sqlx::query(statement).bind(owner).fetch_one(&mut **tx).await?.try_get::<i64, _>("bytes")? as u64)
}
