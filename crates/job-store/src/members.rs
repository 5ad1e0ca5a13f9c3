//! Whose a city is: members and their roles.
//!
//! A city belongs to whoever submits its first job. A member is the name of a token, or `group:NAME` for all tokens of a group; who is
//! several of these has the highest of their roles.

use crate::database::{Tx, one_row};
use crate::names::named;
use crate::{JobStoreError, Store};
use serde::Serialize;
use sqlx::{AssertSqlSafe, Row};

named! {
    /// What a member of a city may do; each what the ones before it may.
    Role, "role of a member", {
        /// Look at the city, its jobs and what they made.
        Viewer = "viewer",
        /// Submit jobs for it, steer one's own, and use its uploads.
        Editor = "editor",
        /// Steer all its jobs, say who its members are, roll it back, and delete it.
        Owner = "owner",
    }
}

/// A member of a city.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Member {
    /// Name of a token, or `group:NAME`.
    pub name: String,
    /// What they may do.
    pub role: Role,
}

impl Store {
    /// The highest role that one of these names has in a city.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn role(&self, city: &str, names: &[String]) -> Result<Option<Role>, JobStoreError> {
        let mut connection = self.pool.acquire().await?;
        role_of(&mut connection, city, names).await
    }

    /// Whether a city is someone's.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn is_claimed(&self, city: &str) -> Result<bool, JobStoreError> {
        let row = sqlx::query("SELECT city FROM city_access WHERE city = $1").bind(city);
        Ok(row.fetch_optional(&self.pool).await?.is_some())
    }

    /// The members of a city, by name.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn members(&self, city: &str) -> Result<Vec<Member>, JobStoreError> {
        let rows = sqlx::query("SELECT member, role FROM city_member WHERE city = $1 ORDER BY member")
            .bind(city)
            .fetch_all(&self.pool)
            .await?;
        let mut members = Vec::new();
        for row in &rows {
            members.push(Member { name: row.try_get("member")?, role: row.try_get::<&str, _>("role")?.parse()? });
        }
        Ok(members)
    }

    /// Makes someone a member of a city, or changes their role; with none, ends it. False if the city is nobody's, or who is to go was
    /// none.
    ///
    /// # Errors
    /// [`JobStoreError::LastOwner`] if the city would be left without an owner, or the database does not answer.
    pub async fn set_member(&self, city: &str, name: &str, role: Option<Role>) -> Result<bool, JobStoreError> {
        let mut tx = self.begin().await?;
        // Locks the city's members: two owners who remove each other do so one after the other.
        let locked = sqlx::query("UPDATE city_access SET claimed = claimed WHERE city = $1").bind(city);
        if !one_row(&locked.execute(&mut *tx).await?) {
            return Ok(false);
        }
        let changed = match role {
            Some(role) => {
                let statement = "INSERT INTO city_member (city, member, role) VALUES ($1, $2, $3) \
                                 ON CONFLICT (city, member) DO UPDATE SET role = excluded.role";
                sqlx::query(statement).bind(city).bind(name).bind(role.name()).execute(&mut *tx).await?
            }
            None => {
                let statement = "DELETE FROM city_member WHERE city = $1 AND member = $2";
                sqlx::query(statement).bind(city).bind(name).execute(&mut *tx).await?
            }
        };
        if !one_row(&changed) {
            return Ok(false);
        }
        let owners: i64 = sqlx::query("SELECT COUNT(*) AS owners FROM city_member WHERE city = $1 AND role = 'owner'")
            .bind(city)
            .fetch_one(&mut *tx)
            .await?
            .try_get("owners")?;
        if owners == 0 {
            return Err(JobStoreError::LastOwner { city: city.to_owned() });
        }
        self.commit(tx).await?;
        Ok(true)
    }

    /// Makes a city that is nobody's that of `owner`. If it is someone's, one of `names` has to be an editor of it at least; with no
    /// names, whoever asks may do everything.
    pub(crate) async fn enter_city(
        &self,
        tx: &mut Tx,
        city: &str,
        owner: &str,
        names: Option<&[String]>,
    ) -> Result<(), JobStoreError> {
        // Of two who submit the first jobs of a city at once, the second waits here for the first.
        let statement = "INSERT INTO city_access (city, claimed) VALUES ($1, {now}) ON CONFLICT (city) DO NOTHING";
        let claimed = sqlx::query(self.sql(statement)).bind(city).execute(&mut **tx).await?;
        if one_row(&claimed) {
            let statement = "INSERT INTO city_member (city, member, role) VALUES ($1, $2, 'owner')";
            sqlx::query(statement).bind(city).bind(owner).execute(&mut **tx).await?;
            return Ok(());
        }
        let Some(names) = names else { return Ok(()) };
        match role_of(tx, city, names).await? {
            Some(Role::Editor | Role::Owner) => Ok(()),
            _ => Err(JobStoreError::NotAnEditor { city: city.to_owned() }),
        }
    }
}

async fn role_of(
    connection: &mut sqlx::AnyConnection,
    city: &str,
    names: &[String],
) -> Result<Option<Role>, JobStoreError> {
    let statement = format!("SELECT role FROM city_member WHERE city = $1 AND member IN ({})", places(2, names.len()));
    let query = names.iter().fold(sqlx::query(AssertSqlSafe(statement)).bind(city), |query, name| query.bind(name));
    let mut highest = None;
    for row in query.fetch_all(connection).await? {
        highest = highest.max(Some(row.try_get::<&str, _>("role")?.parse()?));
    }
    Ok(highest)
}

/// So many places of values, from `$first` on; that of NULL if there are none.
pub(crate) fn places(first: usize, count: usize) -> String {
    if count == 0 {
        return "NULL".to_owned();
    }
    (first..first + count).map(|n| format!("${n}")).collect::<Vec<_>>().join(", ")
}

/// The condition that a city is one of those of the names whose values stand from `$first` on.
pub(crate) fn of_members(column: &str, first: usize, count: usize) -> String {
    format!("{column} IN (SELECT city FROM city_member WHERE member IN ({}))", places(first, count))
}
