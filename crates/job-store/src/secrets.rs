//! What the coordinators of a database sign with.

use crate::{JobStoreError, Store};
use sqlx::Row;

impl Store {
    /// The secret of this name; `fresh` becomes it if there is none yet. Of several coordinators that ask at once, all are given the same.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn secret(&self, name: &str, fresh: &str) -> Result<String, JobStoreError> {
        let statement = "INSERT INTO secret (name, value, made) VALUES ($1, $2, {now}) ON CONFLICT (name) DO NOTHING";
        sqlx::query(self.sql(statement)).bind(name).bind(fresh).execute(&self.pool).await?;
        let found = sqlx::query("SELECT value FROM secret WHERE name = $1").bind(name).fetch_one(&self.pool).await?;
        Ok(found.try_get("value")?)
    }

    /// Puts another secret in the place of the one of this name: what was signed before does not hold any more.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn replace_secret(&self, name: &str, fresh: &str) -> Result<(), JobStoreError> {
        let statement = "INSERT INTO secret (name, value, made) VALUES ($1, $2, {now}) \
                         ON CONFLICT (name) DO UPDATE SET value = excluded.value, made = excluded.made";
        sqlx::query(self.sql(statement)).bind(name).bind(fresh).execute(&self.pool).await?;
        self.note_write();
        Ok(())
    }
}
