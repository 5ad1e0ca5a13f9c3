//! The connection, and the little in which the two databases differ.

use crate::JobStoreError;
use sqlx::any::{AnyPoolOptions, AnyQueryResult};
use sqlx::migrate::MigrateError;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{Any, AnyPool, AssertSqlSafe, Connection, Executor, Transaction};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

static MIGRATIONS: sqlx::migrate::Migrator = sqlx::migrate!("../../migrations");

/// How long to wait for a connection, and on SQLite for another writer.
const PATIENCE: Duration = Duration::from_secs(10);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Dialect {
    Sqlite,
    Postgres,
}

impl Dialect {
    /// Milliseconds since 1970 by the database's clock, so that the clocks of workers do not matter.
    fn now(self) -> &'static str {
        match self {
            Self::Sqlite => "CAST(unixepoch('subsec') * 1000 AS BIGINT)",
            Self::Postgres => "CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT)",
        }
    }

    /// SQLite: take the write lock at once, for a transaction that reads first cannot always get it later.
    fn begin(self) -> &'static str {
        match self {
            Self::Sqlite => "BEGIN IMMEDIATE",
            Self::Postgres => "BEGIN",
        }
    }
}

/// Jobs and tasks in a database. Clones share one pool of connections.
#[derive(Clone, Debug)]
pub struct Store {
    pub(crate) pool: AnyPool,
    dialect: Dialect,
    writes: Arc<AtomicU64>,
}

pub(crate) type Tx = Transaction<'static, Any>;

impl Store {
    /// Opens the database at `sqlite:FILE` (made if it is not there) or `postgres://USER:PASSWORD@HOST/NAME`, and brings
    /// its tables up to date.
    ///
    /// # Errors
    /// If the address names no supported database, it does not answer, or its tables are of a newer version.
    pub async fn connect(address: &str) -> Result<Self, JobStoreError> {
        sqlx::any::install_default_drivers();
        let (dialect, address, connections) = if address.starts_with("sqlite:") {
            let made = if address.contains('?') { address.to_owned() } else { format!("{address}?mode=rwc") };
            (Dialect::Sqlite, made, 4)
        } else if address.starts_with("postgres:") || address.starts_with("postgresql:") {
            (Dialect::Postgres, address.to_owned(), 8)
        } else {
            let scheme = address.split(':').next().unwrap_or_default();
            return Err(JobStoreError::Address(scheme.to_owned()));
        };
        // Held until the tables are there.
        let _alone = if dialect == Dialect::Sqlite { alone(&address).await? } else { None };
        let pool = AnyPoolOptions::new()
            .max_connections(connections)
            .acquire_timeout(PATIENCE)
            .after_connect(move |connection, _| {
                Box::pin(async move {
                    if dialect == Dialect::Sqlite {
                        // WAL: readers do not wait for writers. FULL: what was said to be committed survives power loss.
                        let pragmas = AssertSqlSafe(format!(
                            "PRAGMA busy_timeout = {}; PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; \
                             PRAGMA foreign_keys = ON",
                            PATIENCE.as_millis()
                        ));
                        connection.execute(sqlx::raw_sql(pragmas)).await?;
                    }
                    Ok(())
                })
            })
            // After an error inside a transaction, such as that of a full disk, SQLite may have ended the transaction while its connection
            // takes it for open: it could begin none any more.
            .after_release(|connection, _| {
                Box::pin(async move {
                    // What was to be rolled back is, from here on.
                    connection.ping().await?;
                    Ok(!connection.is_in_transaction())
                })
            })
            .connect(&address)
            .await?;
        MIGRATIONS.run(&pool).await.map_err(newer)?;
        Ok(Self { pool, dialect, writes: Arc::default() })
    }

    /// Closes all connections.
    pub async fn close(&self) {
        self.pool.close().await;
    }

    /// Whether the database answers.
    ///
    /// # Errors
    /// If it does not.
    pub async fn ping(&self) -> Result<(), JobStoreError> {
        sqlx::query("SELECT 1").execute(&self.pool).await?;
        Ok(())
    }

    /// The statement with `{now}` replaced by the database's clock and `{job}` by the columns of a job. Statements are
    /// constants of this crate: values are always bound.
    pub(crate) fn sql(&self, statement: &'static str) -> AssertSqlSafe<String> {
        AssertSqlSafe(statement.replace("{now}", self.dialect.now()).replace("{job}", crate::Job::COLUMNS))
    }

    /// The database's clock in a statement.
    pub(crate) fn now(&self) -> &'static str {
        self.dialect.now()
    }

    /// A transaction that will write.
    pub(crate) async fn begin(&self) -> Result<Tx, JobStoreError> {
        Ok(self.pool.begin_with(self.dialect.begin()).await?)
    }

    /// Carries out what a transaction does for a client, who is to see it at once.
    pub(crate) async fn commit(&self, tx: Tx) -> Result<(), JobStoreError> {
        tx.commit().await?;
        self.note_write();
        Ok(())
    }

    /// To be called when a client has changed something.
    pub(crate) fn note_write(&self) {
        self.writes.fetch_add(1, Ordering::SeqCst);
    }

    /// How often clients have changed jobs or tokens through this store and its clones: what was read before the number rose may not
    /// hold any more. What workers do is not counted, for it comes all the time, and nor is what other processes do.
    #[must_use]
    pub fn writes(&self) -> u64 {
        self.writes.load(Ordering::SeqCst)
    }
}

/// Waits until no other process brings the tables of a SQLite database up to date, and keeps others from it until the lock is
/// dropped: SQLite itself lets two of them begin, and one fail. Postgres has a lock of its own for it. None for a database in memory.
async fn alone(address: &str) -> Result<Option<File>, JobStoreError> {
    let options: SqliteConnectOptions = address.parse()?;
    let database = options.get_filename();
    if address.contains(":memory:") || address.contains("mode=memory") {
        return Ok(None);
    }
    let mut name = database.as_os_str().to_owned();
    name.push(".lock");
    let path = PathBuf::from(name);
    let locked = tokio::task::spawn_blocking(move || lock(&path));
    let locked = locked.await.map_err(|_| sqlx::Error::WorkerCrashed)?;
    Ok(Some(locked?))
}

fn lock(path: &Path) -> Result<File, JobStoreError> {
    let wrong = |source| JobStoreError::File { path: path.to_owned(), source };
    let file = File::options().write(true).create(true).truncate(false).open(path).map_err(wrong)?;
    file.lock().map_err(wrong)?;
    Ok(file)
}

/// Tables that this program does not know are of a newer one.
fn newer(error: MigrateError) -> JobStoreError {
    match error {
        MigrateError::VersionMissing(found) => {
            let known = MIGRATIONS.iter().map(|migration| migration.version).max().unwrap_or(0);
            JobStoreError::NewerTables { found, known }
        }
        other => other.into(),
    }
}

/// Whether exactly one row was changed.
pub(crate) fn one_row(result: &AnyQueryResult) -> bool {
    result.rows_affected() == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{JobStoreError, NewJob};

    async fn submit(store: &Store, bytes: usize) -> Result<(), JobStoreError> {
        let new = NewJob {
            city: "delft".to_owned(),
            owner: "ann".to_owned(),
            request: "x".repeat(bytes),
            ..NewJob::default()
        };
        store.submit(&new).await.map(drop)
    }

    /// A disk that is full for a while: no connection may make the file longer.
    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn after_a_full_disk_the_store_goes_on() {
        let folder = tempfile::tempdir().expect("a folder");
        let address = format!("sqlite:{}", folder.path().join("jobs.db").display());
        let store = Store::connect(&address).await.expect("opens");
        submit(&store, 10).await.expect("there is room");
        let mut all = Vec::new();
        for _ in 0..4 {
            let mut connection = store.pool.acquire().await.expect("a connection");
            let limit: i64 =
                sqlx::query_scalar("PRAGMA max_page_count = 1").fetch_one(&mut *connection).await.expect("limited");
            assert!(limit < 1000, "{limit} pages, as there are already");
            all.push(connection);
        }
        drop(all);
        // SQLite has ended these transactions by itself, so none of the four connections can be used again. New ones have room.
        for _ in 0..4 {
            let full = submit(&store, 1 << 20).await.expect_err("there is no room");
            assert!(full.to_string().contains("full"), "{full}");
        }
        for _ in 0..8 {
            submit(&store, 1 << 20).await.expect("there is room again");
        }
    }
}
