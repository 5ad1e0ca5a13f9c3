//! People who have signed in, for as long as they have.

use crate::{JobStoreError, Scope, Store};
use sqlx::Row;
use sqlx::any::AnyRow;
use std::time::Duration;

/// Somebody who has signed in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Session {
    /// Hash of what their browser shows.
    pub hash: String,
    /// Who they are.
    pub name: String,
    /// What they may do.
    pub scope: Scope,
    /// Their groups, without commas.
    pub groups: Vec<String>,
    /// When it ends, milliseconds since 1970; set by the database's clock.
    pub expires: i64,
}

impl Session {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        let groups = row.try_get::<&str, _>("in_groups")?.split(',').filter(|g| !g.is_empty());
        Ok(Self {
            hash: row.try_get("hash")?,
            name: row.try_get("name")?,
            scope: row.try_get::<&str, _>("scope")?.parse()?,
            groups: groups.map(str::to_owned).collect(),
            expires: row.try_get("expires")?,
        })
    }
}

impl Store {
    /// Keeps a session for this time; what stands in it as its end does not count. Those that have ended are forgotten.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn add_session(&self, session: &Session, time: Duration) -> Result<(), JobStoreError> {
        sqlx::query(self.sql("DELETE FROM session WHERE expires <= {now}")).execute(&self.pool).await?;
        let statement = "INSERT INTO session (hash, name, scope, in_groups, created, expires) \
                         VALUES ($1, $2, $3, $4, {now}, {now} + $5)";
        sqlx::query(self.sql(statement))
            .bind(&session.hash)
            .bind(&session.name)
            .bind(session.scope.name())
            .bind(session.groups.iter().map(|group| format!("{group},")).collect::<String>())
            .bind(i64::try_from(time.as_millis()).unwrap_or(i64::MAX / 4))
            .execute(&self.pool)
            .await?;
        self.note_write();
        Ok(())
    }

    /// The session with this hash, if it has not ended.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn session(&self, hash: &str) -> Result<Option<Session>, JobStoreError> {
        let statement = "SELECT hash, name, scope, in_groups, expires FROM session WHERE hash = $1 AND expires > {now}";
        let row = sqlx::query(self.sql(statement)).bind(hash).fetch_optional(&self.pool).await?;
        row.as_ref().map(Session::read).transpose()
    }

    /// The session of this name that ends last, if one has not ended.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn session_of(&self, name: &str) -> Result<Option<Session>, JobStoreError> {
        let statement = "SELECT hash, name, scope, in_groups, expires FROM session WHERE name = $1 AND expires > {now} \
                         ORDER BY expires DESC LIMIT 1";
        let row = sqlx::query(self.sql(statement)).bind(name).fetch_optional(&self.pool).await?;
        row.as_ref().map(Session::read).transpose()
    }

    /// Ends a session; false if there is none with this hash.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn remove_session(&self, hash: &str) -> Result<bool, JobStoreError> {
        let removed = sqlx::query("DELETE FROM session WHERE hash = $1").bind(hash).execute(&self.pool).await?;
        self.note_write();
        Ok(crate::database::one_row(&removed))
    }

    /// Ends all sessions of a name; gives how many there were.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn remove_sessions_of(&self, name: &str) -> Result<u64, JobStoreError> {
        let removed = sqlx::query("DELETE FROM session WHERE name = $1").bind(name).execute(&self.pool).await?;
        self.note_write();
        Ok(removed.rows_affected())
    }
}
