//! Cities and their generations: what readers see, and how it changes.
//!
//! A generation is published in one transaction with the end of the job that made it, so readers see all of it or nothing.
//! Rows of buildings and files say for which generations they hold; a generation costs what changed.

use crate::database::Tx;
use crate::events::About;
use crate::members::of_members;
use crate::names::named;
use crate::texts::kept;
use crate::{Artifact, EventKind, JobStoreError, Published, Store};
use serde::{Deserialize, Serialize};
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, Row};
use std::collections::{BTreeMap, BTreeSet};

/// Artefacts of a job under this path are files of the city.
const RESULT: &str = "result/";

/// Rows that one statement inserts.
const ROWS: usize = 200;

/// A city.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct City {
    /// Its name.
    pub name: String,
    /// The generation that readers see; none before the first job for it has ended.
    pub generation: Option<i64>,
    /// When it was first published, milliseconds since 1970.
    pub created: i64,
}

/// A state of a city.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Generation {
    /// The city.
    pub city: String,
    /// Its number, from 1.
    pub number: i64,
    /// The job that made it.
    pub job: String,
    /// The earlier generation whose content it has anew, if the city was rolled back to that.
    pub restored: Option<i64>,
    /// Whether blocks are missing.
    pub partial: bool,
    /// Reference system of the coordinates.
    pub crs: String,
    /// When it was published, milliseconds since 1970.
    pub made: i64,
    /// Its buildings.
    pub buildings: i64,
    /// Buildings that the generation before had not.
    pub added: i64,
    /// Buildings of the generation before that are gone.
    pub removed: i64,
    /// Buildings whose geometries or attributes are others.
    pub changed: i64,
}

/// A building of a city.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CityBuilding {
    /// Identifier, the same in all generations.
    pub id: String,
    /// Hash of its geometries and attributes.
    pub hash: String,
    /// Column and row of the tile that holds it, joined by `_`.
    pub tile: String,
    /// West, south, east, north; world coordinates, metres.
    pub bbox: [f64; 4],
    /// The best LOD, such as `lod2`.
    pub lod: String,
    /// Roof type.
    pub roof_type: Option<String>,
    /// Highest roof point above the ground, metres.
    pub height: f64,
    /// Footprint area, m².
    pub area: f64,
    /// Attributes, as JSON.
    pub attributes: String,
}

/// A finished city, to be published.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Publication {
    /// Reference system of the coordinates.
    pub crs: String,
    /// Its buildings; each id once.
    pub buildings: Vec<CityBuilding>,
}

named! {
    /// What became of a building between two generations.
    ChangeKind, "kind of a change", {
        /// Only the later one has it.
        Added = "added",
        /// Only the earlier one has it.
        Removed = "removed",
        /// Both have it, with other geometries or attributes.
        Changed = "changed",
    }
}

/// A building that two generations do not have in common.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Identifier.
    pub id: String,
    /// What became of it.
    pub kind: ChangeKind,
}

/// Which buildings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BuildingFilter {
    /// Only those whose boxes meet this one: west, south, east, north; world coordinates, metres.
    pub bbox: Option<[f64; 4]>,
    /// Only of this best LOD.
    pub lod: Option<String>,
    /// Only of this roof type.
    pub roof_type: Option<String>,
    /// Only of at least this height, metres.
    pub min_height: Option<f64>,
    /// Only of at most this height, metres.
    pub max_height: Option<f64>,
    /// Only of at least this area, m².
    pub min_area: Option<f64>,
    /// Only of at most this area, m².
    pub max_area: Option<f64>,
    /// Only with this id.
    pub id: Option<String>,
    /// Only those whose ids sort after this one: the last id of a page gives the next page.
    pub after: Option<String>,
}

impl Generation {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            city: row.try_get("city")?,
            number: row.try_get("number")?,
            job: row.try_get("job")?,
            restored: row.try_get("restored")?,
            partial: row.try_get::<i64, _>("partial")? != 0,
            crs: row.try_get("crs")?,
            made: row.try_get("made")?,
            buildings: row.try_get("buildings")?,
            added: row.try_get("added")?,
            removed: row.try_get("removed")?,
            changed: row.try_get("changed")?,
        })
    }
}

impl CityBuilding {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            id: row.try_get("id")?,
            hash: row.try_get("hash")?,
            tile: row.try_get("tile")?,
            bbox: [row.try_get("west")?, row.try_get("south")?, row.try_get("east")?, row.try_get("north")?],
            lod: row.try_get("lod")?,
            roof_type: row.try_get("roof_type")?,
            height: row.try_get("height")?,
            area: row.try_get("area")?,
            attributes: row.try_get("attributes")?,
        })
    }
}

/// A row that holds for the generation in place `$2`.
const HOLDS: &str = "since <= $2 AND (until IS NULL OR until > $2)";

impl Store {
    /// Cities by name, those after `after`, at most `limit`; with names, only those that have one of these as a member.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn cities(
        &self,
        seen_by: Option<&[String]>,
        after: Option<&str>,
        limit: i64,
    ) -> Result<Vec<City>, JobStoreError> {
        let names = seen_by.unwrap_or_default();
        let seen = seen_by.map_or_else(String::new, |_| format!("{} AND ", of_members("name", 3, names.len())));
        let statement =
            format!("SELECT name, generation, created FROM city WHERE {seen}name > $1 ORDER BY name LIMIT $2");
        let query = sqlx::query(AssertSqlSafe(statement)).bind(after.unwrap_or_default()).bind(limit);
        let rows = names.iter().fold(query, |query, name| query.bind(name)).fetch_all(&self.pool).await?;
        rows.iter().map(city).collect()
    }

    /// A city; none if nothing of it was ever published.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn city(&self, name: &str) -> Result<Option<City>, JobStoreError> {
        let row = sqlx::query("SELECT name, generation, created FROM city WHERE name = $1")
            .bind(name)
            .fetch_optional(&self.pool)
            .await?;
        row.as_ref().map(city).transpose()
    }

    /// The generations of a city, newest first, those before number `before`, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn generations(
        &self,
        city: &str,
        before: Option<i64>,
        limit: i64,
    ) -> Result<Vec<Generation>, JobStoreError> {
        let rows = sqlx::query(
            "SELECT city, number, job, restored, partial, crs, made, buildings, added, removed, changed FROM generation \
             WHERE city = $1 AND number < $2 ORDER BY number DESC LIMIT $3",
        )
        .bind(city)
        .bind(before.unwrap_or(i64::MAX))
        .bind(limit)
        .fetch_all(&self.pool)
        .await?;
        rows.iter().map(Generation::read).collect()
    }

    /// One generation of a city; none if there is no such one.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn generation(&self, city: &str, number: i64) -> Result<Option<Generation>, JobStoreError> {
        let found = self.generations(city, Some(number.saturating_add(1)), 1).await?;
        Ok(found.into_iter().next().filter(|g| g.number == number))
    }

    /// The buildings of a generation, by id, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn buildings(
        &self,
        city: &str,
        generation: i64,
        filter: &BuildingFilter,
        limit: i64,
    ) -> Result<Vec<CityBuilding>, JobStoreError> {
        // Only what is asked for stands in the statement: a condition on NULL would keep the database from its indices.
        let mut numbers = Vec::new();
        let mut texts = Vec::new();
        let mut condition = String::new();
        let mut number = |column: &str, compare: &str, value: Option<f64>| {
            if let Some(value) = value {
                numbers.push(value);
                condition += &format!(" AND {column} {compare} ${}", 3 + numbers.len());
            }
        };
        let [west, south, east, north] = filter.bbox.map_or([None; 4], |b| b.map(Some));
        number("west", "<=", east);
        number("south", "<=", north);
        number("east", ">=", west);
        number("north", ">=", south);
        number("height", ">=", filter.min_height);
        number("height", "<=", filter.max_height);
        number("area", ">=", filter.min_area);
        number("area", "<=", filter.max_area);
        let mut text = |column: &str, compare: &str, value: &Option<String>| {
            if let Some(value) = value {
                texts.push(value.clone());
                condition += &format!(" AND {column} {compare} ${}", 3 + numbers.len() + texts.len());
            }
        };
        text("lod", "=", &filter.lod);
        text("roof_type", "=", &filter.roof_type);
        text("id", "=", &filter.id);
        text("id", ">", &filter.after);
        let statement = format!(
            "SELECT id, hash, tile, west, south, east, north, lod, roof_type, height, area, attributes FROM building \
             WHERE city = $1 AND {HOLDS}{condition} ORDER BY id LIMIT $3"
        );
        // Columns and signs are constants of this function; values are bound.
        let mut query = sqlx::query(AssertSqlSafe(statement)).bind(city).bind(generation).bind(limit);
        for value in numbers {
            query = query.bind(value);
        }
        for value in texts {
            query = query.bind(value);
        }
        query.fetch_all(&self.pool).await?.iter().map(CityBuilding::read).collect()
    }

    /// The buildings that two generations of a city do not have in common, by id, those after `after`, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn changes(
        &self,
        city: &str,
        from: i64,
        to: i64,
        after: Option<&str>,
        limit: i64,
    ) -> Result<Vec<Change>, JobStoreError> {
        let rows = sqlx::query(
            "SELECT id, MIN(older) AS older, MIN(newer) AS newer FROM ( \
               SELECT id, hash AS older, NULL AS newer FROM building \
               WHERE city = $1 AND since <= $2 AND (until IS NULL OR until > $2) \
               UNION ALL \
               SELECT id, NULL AS older, hash AS newer FROM building \
               WHERE city = $1 AND since <= $3 AND (until IS NULL OR until > $3)) AS both_sides \
             WHERE id > $4 GROUP BY id \
             HAVING MIN(older) IS NULL OR MIN(newer) IS NULL OR MIN(older) <> MIN(newer) ORDER BY id LIMIT $5",
        )
        .bind(city)
        .bind(from)
        .bind(to)
        .bind(after.unwrap_or_default())
        .bind(limit)
        .fetch_all(&self.pool)
        .await?;
        rows.iter()
            .map(|row| {
                let (older, newer): (Option<String>, Option<String>) = (row.try_get("older")?, row.try_get("newer")?);
                let kind = match (older, newer) {
                    (None, _) => ChangeKind::Added,
                    (_, None) => ChangeKind::Removed,
                    _ => ChangeKind::Changed,
                };
                Ok(Change { id: row.try_get("id")?, kind })
            })
            .collect()
    }

    /// The files of a generation whose paths begin with `prefix`, by path: relative to the result, as `tiles/3_7.city.json`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn city_files(&self, city: &str, generation: i64, prefix: &str) -> Result<Vec<Artifact>, JobStoreError> {
        let statement = format!(
            "SELECT path, blob, bytes FROM city_file WHERE city = $1 AND {HOLDS} \
             AND SUBSTR(path, 1, LENGTH($3)) = $3 ORDER BY path"
        );
        let rows = sqlx::query(AssertSqlSafe(statement))
            .bind(city)
            .bind(generation)
            .bind(prefix)
            .fetch_all(&self.pool)
            .await?;
        rows.iter().map(Artifact::read).collect()
    }

    /// A file of a generation; none if it has no such one.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn city_file(&self, city: &str, generation: i64, path: &str) -> Result<Option<Artifact>, JobStoreError> {
        let statement = format!("SELECT path, blob, bytes FROM city_file WHERE city = $1 AND {HOLDS} AND path = $3");
        let row = sqlx::query(AssertSqlSafe(statement))
            .bind(city)
            .bind(generation)
            .bind(path)
            .fetch_optional(&self.pool)
            .await?;
        row.as_ref().map(Artifact::read).transpose()
    }

    /// Publishes what a job made as its city's next generation, and notes it among the job's events. Held back, with the
    /// reason as an event, if nothing has changed, or readers would be worse off: the current generation is of a later job, or is whole where this
    /// one is partial. The job is locked already.
    pub(crate) async fn publish(
        &self,
        tx: &mut Tx,
        job: &str,
        publication: &Publication,
    ) -> Result<Published, JobStoreError> {
        let city: String =
            sqlx::query("SELECT city FROM job WHERE id = $1").bind(job).fetch_one(&mut **tx).await?.try_get("city")?;
        let failed: i64 = sqlx::query("SELECT COUNT(*) AS failed FROM task WHERE job = $1 AND state = 'failed'")
            .bind(job)
            .fetch_one(&mut **tx)
            .await?
            .try_get("failed")?;
        let statement =
            "INSERT INTO city (name, generation, created) VALUES ($1, NULL, {now}) ON CONFLICT (name) DO NOTHING";
        sqlx::query(self.sql(statement)).bind(&city).execute(&mut **tx).await?;
        // Locks the city: generations come one after the other.
        sqlx::query("UPDATE city SET created = created WHERE name = $1").bind(&city).execute(&mut **tx).await?;
        let row = sqlx::query(
            "SELECT generation.number, COALESCE(generation.confirmed, generation.job) AS job, generation.partial, generation.crs FROM city \
             JOIN generation ON generation.city = city.name AND generation.number = city.generation WHERE city.name = $1",
        )
        .bind(&city)
        .fetch_optional(&mut **tx)
        .await?;
        let mut last = 0;
        if let Some(row) = row {
            last = row.try_get("number")?;
            let (made_by, partial): (String, i64) = (row.try_get("job")?, row.try_get("partial")?);
            let reason = if made_by.as_str() > job {
                Some(format!("generation {last} of {city} is of a later job"))
            } else if failed > 0 && partial == 0 {
                Some(format!("generation {last} of {city} is whole, and this one lacks blocks: retry them"))
            } else {
                None
            };
            if let Some(reason) = reason {
                let about = About { message: Some(&reason), ..About::default() };
                self.note(tx, job, EventKind::Withheld, about).await?;
                return Ok(Published::Withheld(reason));
            }
            let same = (partial != 0) == (failed > 0) && row.try_get::<&str, _>("crs")? == publication.crs;
            if same && self.is_unchanged(tx, &city, job, &publication.buildings).await? {
                let statement = "UPDATE generation SET confirmed = $3 WHERE city = $1 AND number = $2";
                sqlx::query(statement).bind(&city).bind(last).bind(job).execute(&mut **tx).await?;
                let message = format!("generation {last} of {city} holds: nothing has changed");
                let about = About { message: Some(&message), ..About::default() };
                self.note(tx, job, EventKind::Unchanged, about).await?;
                return Ok(Published::Unchanged(last));
            }
        }
        let number = last + 1;
        let counts = self.replace_buildings(tx, &city, number, &publication.buildings).await?;
        self.replace_files(tx, &city, number, job).await?;
        let statement = "INSERT INTO generation (city, number, job, partial, crs, made, buildings, added, removed, changed) \
                         VALUES ($1, $2, $3, $4, $5, {now}, $6, $7, $8, $9)";
        sqlx::query(self.sql(statement))
            .bind(&city)
            .bind(number)
            .bind(job)
            .bind(i64::from(failed > 0))
            .bind(kept(&publication.crs))
            .bind(publication.buildings.len() as i64)
            .bind(counts[0])
            .bind(counts[1])
            .bind(counts[2])
            .execute(&mut **tx)
            .await?;
        sqlx::query("UPDATE city SET generation = $2 WHERE name = $1")
            .bind(&city)
            .bind(number)
            .execute(&mut **tx)
            .await?;
        self.tell_published(tx, &city, number).await?;
        let message = format!("generation {number} of {city}");
        self.note(tx, job, EventKind::Published, About { message: Some(&message), ..About::default() }).await?;
        Ok(Published::Generation(number))
    }

    /// Whether a city has these buildings and the files that a job made already; reports do not count, for they tell times.
    async fn is_unchanged(
        &self,
        tx: &mut Tx,
        city: &str,
        job: &str,
        buildings: &[CityBuilding],
    ) -> Result<bool, JobStoreError> {
        let rows = sqlx::query("SELECT id, hash, tile FROM building WHERE city = $1 AND until IS NULL")
            .bind(city)
            .fetch_all(&mut **tx)
            .await?;
        let mut before = BTreeSet::new();
        for row in &rows {
            before.insert((
                row.try_get::<&str, _>("id")?,
                row.try_get::<&str, _>("hash")?,
                row.try_get::<&str, _>("tile")?,
            ));
        }
        let now: BTreeSet<_> = buildings.iter().map(|b| (b.id.as_str(), b.hash.as_str(), b.tile.as_str())).collect();
        if now != before {
            return Ok(false);
        }
        let made = "SELECT path, blob, bytes FROM artifact WHERE job = $1 AND SUBSTR(path, 1, LENGTH($2)) = $2";
        let made = sqlx::query(made).bind(job).bind(RESULT).fetch_all(&mut **tx).await?;
        let known = "SELECT path, blob, bytes FROM city_file WHERE city = $1 AND until IS NULL";
        let known = sqlx::query(known).bind(city).fetch_all(&mut **tx).await?;
        let counted = |rows: &[AnyRow]| -> Result<BTreeSet<(String, crate::BlobId)>, JobStoreError> {
            let mut files = BTreeSet::new();
            for row in rows {
                let file = Artifact::read(row)?;
                let path = file.path.strip_prefix(RESULT).unwrap_or(&file.path).to_owned();
                if !matches!(path.as_str(), "report.html" | "report.json") {
                    files.insert((path, file.blob));
                }
            }
            Ok(files)
        };
        Ok(counted(&made)? == counted(&known)?)
    }

    /// Ends what no longer holds and adds what is new; returns how many were added, removed and changed.
    async fn replace_buildings(
        &self,
        tx: &mut Tx,
        city: &str,
        number: i64,
        buildings: &[CityBuilding],
    ) -> Result<[i64; 3], JobStoreError> {
        let rows = sqlx::query("SELECT id, hash, tile FROM building WHERE city = $1 AND until IS NULL")
            .bind(city)
            .fetch_all(&mut **tx)
            .await?;
        let mut before: BTreeMap<String, (String, String)> = BTreeMap::new();
        for row in &rows {
            before.insert(row.try_get("id")?, (row.try_get("hash")?, row.try_get("tile")?));
        }
        let [mut added, mut changed] = [0, 0];
        let (mut new, mut over) = (Vec::new(), Vec::new());
        for building in buildings {
            match before.remove(&building.id) {
                None => {
                    added += 1;
                    new.push(building);
                }
                Some((hash, tile)) if hash != building.hash || tile != building.tile => {
                    changed += i64::from(hash != building.hash);
                    over.push(building.id.clone());
                    new.push(building);
                }
                Some(_) => {}
            }
        }
        let removed = before.len() as i64;
        over.extend(before.into_keys());
        self.end_rows(tx, "building", "id", city, number, &over).await?;
        for some in new.chunks(ROWS) {
            let statement = format!(
                "INSERT INTO building (city, since, id, hash, tile, west, south, east, north, lod, roof_type, height, area, \
                 attributes) VALUES {}",
                places(some.len(), 12)
            );
            let mut query = sqlx::query(AssertSqlSafe(statement)).bind(city).bind(number);
            for b in some {
                query = query.bind(&b.id).bind(&b.hash).bind(&b.tile);
                for side in b.bbox {
                    query = query.bind(side);
                }
                query = query.bind(&b.lod).bind(&b.roof_type).bind(b.height).bind(b.area).bind(&b.attributes);
            }
            query.execute(&mut **tx).await?;
        }
        Ok([added, removed, changed])
    }

    /// The same for the files of the job's result.
    async fn replace_files(&self, tx: &mut Tx, city: &str, number: i64, job: &str) -> Result<(), JobStoreError> {
        let rows = sqlx::query(
            "SELECT path, blob, bytes FROM artifact WHERE job = $1 AND SUBSTR(path, 1, LENGTH($2)) = $2 ORDER BY path",
        )
        .bind(job)
        .bind(RESULT)
        .fetch_all(&mut **tx)
        .await?;
        let made = rows.iter().map(Artifact::read).collect::<Result<Vec<_>, _>>()?;
        let rows = sqlx::query("SELECT path, blob, bytes FROM city_file WHERE city = $1 AND until IS NULL")
            .bind(city)
            .fetch_all(&mut **tx)
            .await?;
        let before = rows.iter().map(Artifact::read).collect::<Result<Vec<_>, _>>()?;
        let name = |a: &Artifact| (a.path.strip_prefix(RESULT).unwrap_or(&a.path).to_owned(), a.blob);
        let now: BTreeSet<_> = made.iter().map(name).collect();
        let was: BTreeSet<_> = before.iter().map(name).collect();
        let over: Vec<String> = was.difference(&now).map(|(path, _)| path.clone()).collect();
        self.end_rows(tx, "city_file", "path", city, number, &over).await?;
        let new: Vec<&Artifact> = made.iter().filter(|a| !was.contains(&name(a))).collect();
        for some in new.chunks(ROWS) {
            let statement =
                format!("INSERT INTO city_file (city, since, path, blob, bytes) VALUES {}", places(some.len(), 3));
            let mut query = sqlx::query(AssertSqlSafe(statement)).bind(city).bind(number);
            for file in some {
                let (path, blob) = name(file);
                query = query.bind(path).bind(blob.to_string()).bind(file.bytes as i64);
            }
            query.execute(&mut **tx).await?;
        }
        Ok(())
    }

    /// Lets rows hold no longer from a generation on.
    async fn end_rows(
        &self,
        tx: &mut Tx,
        table: &'static str,
        key: &'static str,
        city: &str,
        number: i64,
        over: &[String],
    ) -> Result<(), JobStoreError> {
        for some in over.chunks(ROWS) {
            let names: Vec<String> = (3..some.len() + 3).map(|i| format!("${i}")).collect();
            let statement = format!(
                "UPDATE {table} SET until = $2 WHERE city = $1 AND until IS NULL AND {key} IN ({})",
                names.join(", ")
            );
            let mut query = sqlx::query(AssertSqlSafe(statement)).bind(city).bind(number);
            for name in some {
                query = query.bind(name);
            }
            query.execute(&mut **tx).await?;
        }
        Ok(())
    }
}

fn city(row: &AnyRow) -> Result<City, JobStoreError> {
    Ok(City { name: row.try_get("name")?, generation: row.try_get("generation")?, created: row.try_get("created")? })
}

/// Places of values for rows that all begin with `$1` and `$2`, and have `columns` more.
fn places(rows: usize, columns: usize) -> String {
    let row = |r: usize| {
        let own: Vec<String> = (0..columns).map(|c| format!("${}", 3 + r * columns + c)).collect();
        format!("($1, $2, {})", own.join(", "))
    };
    (0..rows).map(row).collect::<Vec<_>>().join(", ")
}
