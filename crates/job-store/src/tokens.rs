//! Who may use the service.

use crate::names::named;
use crate::{JobStoreError, Store};
use sqlx::Row;
use sqlx::any::AnyRow;
use std::time::Duration;

named! {
    /// What a token allows; each allows what the ones before it do.
    Scope, "scope of a token", {
        /// To look at jobs and results.
        Viewer = "viewer",
        /// To submit jobs, and to steer one's own.
        Submitter = "submitter",
        /// To steer all jobs.
        Operator = "operator",
    }
}

/// What is known of a token; not the token itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TokenRecord {
    /// Hash of the token.
    pub hash: String,
    /// Whose it is; unique.
    pub name: String,
    /// What it allows.
    pub scope: Scope,
    /// Groups of its holder.
    pub groups: Vec<String>,
    /// Most jobs under way; none for no limit.
    pub max_jobs: Option<i64>,
    /// When it ends, milliseconds since 1970; none for never.
    pub expires: Option<i64>,
    /// When it was made, milliseconds since 1970; set by the database's clock.
    pub created: i64,
}

impl TokenRecord {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            hash: row.try_get("hash")?,
            name: row.try_get("name")?,
            scope: row.try_get::<&str, _>("scope")?.parse()?,
            groups: row
                .try_get::<&str, _>("in_groups")?
                .split(',')
                .filter(|g| !g.is_empty())
                .map(str::to_owned)
                .collect(),
            max_jobs: row.try_get("max_jobs")?,
            expires: row.try_get("expires")?,
            created: row.try_get("created")?,
        })
    }
}

impl Store {
    /// Adds a token; false if the name is taken.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn add_token(&self, token: &TokenRecord) -> Result<bool, JobStoreError> {
        let statement = "INSERT INTO api_token (hash, name, scope, max_jobs, in_groups, created, expires) \
                         VALUES ($1, $2, $3, $4, $5, {now}, $6) ON CONFLICT (name) DO NOTHING";
        self.insert_token(statement, token).await
    }

    async fn insert_token(&self, statement: &'static str, token: &TokenRecord) -> Result<bool, JobStoreError> {
        let added = sqlx::query(self.sql(statement))
            .bind(&token.hash)
            .bind(&token.name)
            .bind(token.scope.name())
            .bind(token.max_jobs)
            .bind(token.groups.iter().map(|group| format!("{group},")).collect::<String>())
            .bind(token.expires)
            .execute(&self.pool)
            .await?;
        self.note_write();
        Ok(crate::database::one_row(&added))
    }

    /// Adds the first token of all; false if there is any token already. Of several processes that ask at once with tokens of one
    /// name, one is told that its token is the first.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn add_first_token(&self, token: &TokenRecord) -> Result<bool, JobStoreError> {
        // On Postgres two may find the table empty at the same time: then the second one meets the name.
        let statement = "INSERT INTO api_token (hash, name, scope, max_jobs, in_groups, created, expires) \
                         SELECT $1, $2, $3, $4, $5, {now}, $6 WHERE NOT EXISTS (SELECT 1 FROM api_token) \
                         ON CONFLICT (name) DO NOTHING";
        self.insert_token(statement, token).await
    }

    /// The token with this hash, if it has not ended.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn token(&self, hash: &str) -> Result<Option<TokenRecord>, JobStoreError> {
        let statement = "SELECT hash, name, scope, max_jobs, in_groups, expires, created FROM api_token \
                         WHERE (hash = $1 OR (old_hash = $1 AND old_until > {now})) AND (expires IS NULL OR expires > {now})";
        let row = sqlx::query(self.sql(statement)).bind(hash).fetch_optional(&self.pool).await?;
        row.as_ref().map(TokenRecord::read).transpose()
    }

    /// The token of this name, if it has not ended.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn token_of(&self, name: &str) -> Result<Option<TokenRecord>, JobStoreError> {
        let statement = "SELECT hash, name, scope, max_jobs, in_groups, expires, created FROM api_token \
                         WHERE name = $1 AND (expires IS NULL OR expires > {now})";
        let row = sqlx::query(self.sql(statement)).bind(name).fetch_optional(&self.pool).await?;
        row.as_ref().map(TokenRecord::read).transpose()
    }

    /// All tokens by name, also those that have ended.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn tokens(&self) -> Result<Vec<TokenRecord>, JobStoreError> {
        let statement = "SELECT hash, name, scope, max_jobs, in_groups, expires, created FROM api_token ORDER BY name";
        sqlx::query(statement).fetch_all(&self.pool).await?.iter().map(TokenRecord::read).collect()
    }

    /// Whether there is any token, ended or not.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn has_tokens(&self) -> Result<bool, JobStoreError> {
        Ok(sqlx::query("SELECT name FROM api_token LIMIT 1").fetch_optional(&self.pool).await?.is_some())
    }

    /// Puts another token in the place of the one of this name, whose scope, groups and limits stay; the one before opens for `grace` more.
    /// False if there is none of this name.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn rotate_token(&self, name: &str, hash: &str, grace: Duration) -> Result<bool, JobStoreError> {
        let statement = "UPDATE api_token SET old_hash = hash, old_until = {now} + $3, hash = $2 WHERE name = $1";
        let grace = i64::try_from(grace.as_millis()).unwrap_or(i64::MAX / 4);
        let rotated = sqlx::query(self.sql(statement)).bind(name).bind(hash).bind(grace).execute(&self.pool).await?;
        self.note_write();
        Ok(crate::database::one_row(&rotated))
    }

    /// Takes a token away; false if there is none of this name.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn remove_token(&self, name: &str) -> Result<bool, JobStoreError> {
        let removed = sqlx::query("DELETE FROM api_token WHERE name = $1").bind(name).execute(&self.pool).await?;
        self.note_write();
        Ok(crate::database::one_row(&removed))
    }
}
