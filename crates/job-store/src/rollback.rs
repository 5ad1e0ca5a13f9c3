//! Rolling a city back: an earlier generation becomes the newest one again.
//!
//! Numbers go up only: what is rolled back to is published anew, as the generation after the newest one, so that clients that poll see
//! a change, and so that a roll-back can be rolled back.

use crate::database::Tx;
use crate::{JobStoreError, Store};
use sqlx::{AssertSqlSafe, Row};

/// A table whose rows hold for generations: its name, what tells its rows apart, what they hold, and all its columns but those of time.
struct Kept {
    table: &'static str,
    key: &'static str,
    same: &'static str,
    columns: &'static str,
}

const BUILDINGS: Kept = Kept {
    table: "building",
    key: "id",
    same: "earlier.hash = building.hash AND earlier.tile = building.tile",
    columns: "id, hash, tile, west, south, east, north, lod, roof_type, height, area, attributes",
};

const FILES: Kept =
    Kept { table: "city_file", key: "path", same: "earlier.blob = city_file.blob", columns: "path, blob, bytes" };

impl Store {
    /// Makes an earlier generation of a city the newest one; gives the number under which it is published now. None if there is no such
    /// generation; the same number if readers see it already.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn roll_back(&self, city: &str, to: i64) -> Result<Option<i64>, JobStoreError> {
        let mut tx = self.begin().await?;
        // Locks the city: generations come one after the other.
        sqlx::query("UPDATE city SET created = created WHERE name = $1").bind(city).execute(&mut *tx).await?;
        let row = sqlx::query(
            "SELECT city.generation AS newest FROM generation JOIN city ON city.name = generation.city \
             WHERE generation.city = $1 AND generation.number = $2",
        )
        .bind(city)
        .bind(to)
        .fetch_optional(&mut *tx)
        .await?;
        let Some(row) = row else { return Ok(None) };
        let newest: i64 = row.try_get::<Option<i64>, _>("newest")?.unwrap_or(0);
        if newest == to {
            return Ok(Some(to));
        }
        let number = newest + 1;
        let [added, removed, changed] = differences(&mut tx, city, newest, to).await?;
        for kept in [BUILDINGS, FILES] {
            hold_again(&mut tx, &kept, city, to, number).await?;
        }
        let statement = "INSERT INTO generation (city, number, job, partial, crs, made, buildings, added, removed, changed, restored) \
                         SELECT city, $3, job, partial, crs, {now}, buildings, $4, $5, $6, number FROM generation \
                         WHERE city = $1 AND number = $2";
        sqlx::query(self.sql(statement))
            .bind(city)
            .bind(to)
            .bind(number)
            .bind(added)
            .bind(removed)
            .bind(changed)
            .execute(&mut *tx)
            .await?;
        sqlx::query("UPDATE city SET generation = $2 WHERE name = $1")
            .bind(city)
            .bind(number)
            .execute(&mut *tx)
            .await?;
        self.tell_published(&mut tx, city, number).await?;
        self.commit(tx).await?;
        Ok(Some(number))
    }
}

/// Lets the rows of the newest generation end that the earlier one has not, and those of the earlier one hold again that are missing.
async fn hold_again(tx: &mut Tx, kept: &Kept, city: &str, to: i64, number: i64) -> Result<(), JobStoreError> {
    let Kept { table, key, same, columns } = kept;
    let end = format!(
        "UPDATE {table} SET until = $3 WHERE city = $1 AND until IS NULL AND NOT EXISTS (SELECT 1 FROM {table} AS earlier \
         WHERE earlier.city = $1 AND earlier.{key} = {table}.{key} AND earlier.since <= $2 \
         AND (earlier.until IS NULL OR earlier.until > $2) AND {same})"
    );
    sqlx::query(AssertSqlSafe(end)).bind(city).bind(to).bind(number).execute(&mut **tx).await?;
    let begin = format!(
        "INSERT INTO {table} (city, since, {columns}) SELECT city, $3, {columns} FROM {table} AS earlier WHERE city = $1 \
         AND since <= $2 AND (until IS NULL OR until > $2) AND NOT EXISTS (SELECT 1 FROM {table} AS held \
         WHERE held.city = $1 AND held.{key} = earlier.{key} AND held.until IS NULL)"
    );
    sqlx::query(AssertSqlSafe(begin)).bind(city).bind(to).bind(number).execute(&mut **tx).await?;
    Ok(())
}

/// How many buildings of `to` are added, removed and changed against `from`.
async fn differences(tx: &mut Tx, city: &str, from: i64, to: i64) -> Result<[i64; 3], JobStoreError> {
    let row = sqlx::query(
        "SELECT COUNT(CASE WHEN older IS NULL THEN 1 END) AS added, COUNT(CASE WHEN newer IS NULL THEN 1 END) AS removed, \
         COUNT(CASE WHEN older <> newer THEN 1 END) AS changed FROM ( \
           SELECT id, MIN(older) AS older, MIN(newer) AS newer FROM ( \
             SELECT id, hash AS older, NULL AS newer FROM building \
             WHERE city = $1 AND since <= $2 AND (until IS NULL OR until > $2) \
             UNION ALL \
             SELECT id, NULL AS older, hash AS newer FROM building \
             WHERE city = $1 AND since <= $3 AND (until IS NULL OR until > $3)) AS both_sides \
           GROUP BY id) AS pairs",
    )
    .bind(city)
    .bind(from)
    .bind(to)
    .fetch_one(&mut **tx)
    .await?;
    Ok([row.try_get("added")?, row.try_get("removed")?, row.try_get("changed")?])
}
