//! Who did what: a record that is only added to.

use crate::{JobStoreError, Store};
use sqlx::{AssertSqlSafe, Row};
use std::time::Duration;

/// Rows that one statement adds.
const ROWS: usize = 100;

/// Something that was done, or was to be done and was refused.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AuditEntry {
    /// Id; ids of later entries sort later. Made by the store.
    pub id: String,
    /// When, milliseconds since 1970; set by the database's clock.
    pub at: i64,
    /// Name of the token.
    pub who: String,
    /// From where, as far as it is known.
    pub address: Option<String>,
    /// Method and kind of address, such as `POST /api/v1/jobs/{id}/cancel`.
    pub action: String,
    /// The address itself.
    pub target: String,
    /// HTTP status of the answer.
    pub status: i64,
    /// The city that it was about, as far as it is known.
    pub city: Option<String>,
    /// What was made, if something was.
    pub made: Option<String>,
    /// How often.
    pub times: i64,
}

/// Which entries.
#[derive(Clone, Debug, Default)]
pub struct AuditFilter {
    /// Only of this name.
    pub who: Option<String>,
    /// Only about this city.
    pub city: Option<String>,
    /// Only those before the entry with this id.
    pub before: Option<String>,
}

impl Store {
    /// Adds entries, all or none.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn add_audit(&self, entries: &[AuditEntry]) -> Result<(), JobStoreError> {
        let mut tx = self.begin().await?;
        for some in entries.chunks(ROWS) {
            let mut rows = Vec::new();
            for n in 0..some.len() {
                let own: Vec<String> = (1..=9).map(|column| format!("${}", 9 * n + column)).collect();
                rows.push(format!("({}, {{now}})", own.join(", ")));
            }
            let statement = format!(
                "INSERT INTO audit (id, who, address, action, target, status, city, made, times, at) VALUES {}",
                rows.join(", ")
            );
            let mut query = sqlx::query(self.sql_of(&statement));
            for entry in some {
                query = query.bind(uuid::Uuid::now_v7().to_string()).bind(&entry.who).bind(&entry.address);
                query = query.bind(&entry.action).bind(&entry.target).bind(entry.status).bind(&entry.city);
                query = query.bind(&entry.made).bind(entry.times);
            }
            query.execute(&mut *tx).await?;
        }
        tx.commit().await?;
        Ok(())
    }

    /// Entries, newest first, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn audit(&self, filter: &AuditFilter, limit: i64) -> Result<Vec<AuditEntry>, JobStoreError> {
        let (mut conditions, mut values) = (Vec::new(), Vec::new());
        for (condition, value) in [("who =", &filter.who), ("city =", &filter.city), ("id <", &filter.before)] {
            if let Some(value) = value {
                values.push(value);
                conditions.push(format!("{condition} ${}", 1 + values.len()));
            }
        }
        let conditions =
            if conditions.is_empty() { String::new() } else { format!("WHERE {}", conditions.join(" AND ")) };
        let statement = format!(
            "SELECT id, at, who, address, action, target, status, city, made, times FROM audit {conditions} \
             ORDER BY id DESC LIMIT $1"
        );
        let query = sqlx::query(AssertSqlSafe(statement)).bind(limit);
        let rows = values.into_iter().fold(query, |query, value| query.bind(value)).fetch_all(&self.pool).await?;
        let mut entries = Vec::new();
        for row in &rows {
            entries.push(AuditEntry {
                id: row.try_get("id")?,
                at: row.try_get("at")?,
                who: row.try_get("who")?,
                address: row.try_get("address")?,
                action: row.try_get("action")?,
                target: row.try_get("target")?,
                status: row.try_get("status")?,
                city: row.try_get("city")?,
                made: row.try_get("made")?,
                times: row.try_get("times")?,
            });
        }
        Ok(entries)
    }

    /// Removes entries of at least this age, and gives their number.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn purge_audit(&self, age: Duration) -> Result<u64, JobStoreError> {
        let age = i64::try_from(age.as_millis()).unwrap_or(i64::MAX);
        let purged = sqlx::query(self.sql("DELETE FROM audit WHERE at < {now} - $1")).bind(age);
        Ok(purged.execute(&self.pool).await?.rows_affected())
    }
}
