//! What can go wrong.

use std::error::Error;

/// An error with its causes, as far as it does not tell them itself.
#[must_use]
pub fn with_causes(error: &dyn Error) -> String {
    let (mut text, mut cause) = (error.to_string(), error.source());
    while let Some(error) = cause {
        let told = error.to_string();
        if !text.contains(&told) {
            text += &format!(": {told}");
        }
        cause = error.source();
    }
    text
}

/// A failure of the job store.
#[derive(Debug, thiserror::Error)]
pub enum JobStoreError {
    /// The address names no database that is supported.
    #[error("{0:?} is no database: give sqlite:FILE or postgres://USER:PASSWORD@HOST/NAME")]
    Address(String),
    /// The place names no store of artefacts that is supported.
    #[error("{0:?} is no place for artefacts: give a folder or s3://BUCKET/PREFIX")]
    Place(String),
    /// There is no such job.
    #[error("there is no job {0}")]
    NoJob(String),
    /// The job's state does not allow it.
    #[error("job {job} is {state}: {wanted} is not possible")]
    State {
        /// Id of the job.
        job: String,
        /// Its state.
        state: String,
        /// What was asked for.
        wanted: &'static str,
    },
    /// The idempotency key was used before, for something else.
    #[error("idempotency key {key:?} was used for another request, job {job}: use a new key")]
    KeyReused {
        /// The key.
        key: String,
        /// The job that was submitted with it.
        job: String,
    },
    /// The owner has as many jobs under way as they may.
    #[error("{owner} may have {most} jobs under way: wait for one, or cancel one")]
    Quota {
        /// Whose jobs.
        owner: String,
        /// How many.
        most: i64,
    },
    /// The owner has as many uploads under way as they may.
    #[error("{owner} may have {most} uploads under way: complete one, or give one up")]
    OpenUploads {
        /// Whose uploads.
        owner: String,
        /// How many.
        most: i64,
    },
    /// The owner has sent as many bytes as they may.
    #[error("uploads of {owner} may have {} MB in all: remove some that no job needs any more", most >> 20)]
    UploadBytes {
        /// Whose uploads.
        owner: String,
        /// How many bytes.
        most: u64,
    },
    /// A city of others.
    #[error("city {city:?} is of others: ask one of its owners to make you an editor, or take another name")]
    NotAnEditor {
        /// The city.
        city: String,
    },
    /// A city has to have an owner.
    #[error("city {city:?} would be left without an owner: make someone else its owner first")]
    LastOwner {
        /// The city.
        city: String,
    },
    /// Readers see this generation.
    #[error("generation {number} of {city:?} is the one that readers see: publish or roll back to another one first")]
    Current {
        /// The city.
        city: String,
        /// The generation.
        number: i64,
    },
    /// Something goes on with a city.
    #[error("city {city:?} is in use: {by} first")]
    InUse {
        /// The city.
        city: String,
        /// By what, and what to do.
        by: String,
    },
    /// The task is held by someone else, or by no one: the result must be thrown away.
    #[error("task {unit} of stage {stage} of job {job} is no longer held under fence {fence}")]
    Lost {
        /// Id of the job.
        job: String,
        /// Stage of the task.
        stage: i64,
        /// Unit of the task.
        unit: String,
        /// The fence it was claimed under.
        fence: i64,
    },
    /// A task asked for tasks of a stage that is over or under way.
    #[error("task {unit} of stage {stage} adds tasks to stage {added}, which is not later")]
    StageOrder {
        /// Unit of the task.
        unit: String,
        /// Stage of the task.
        stage: i64,
        /// Stage of what it adds.
        added: i64,
    },
    /// A result that was to be taken over was forgotten in the meantime.
    #[error("the outcome {key} that task {unit} takes over is not kept any more")]
    NoOutcome {
        /// Unit of the task.
        unit: String,
        /// Key of the outcome.
        key: String,
    },
    /// What is stored is not what this version writes.
    #[error("{what} in the database cannot be read: {value:?}")]
    Stored {
        /// Column.
        what: &'static str,
        /// Its content.
        value: String,
    },
    /// The content of a blob is not what its name says.
    #[error("blob {0} is damaged: its content has another hash")]
    DamagedBlob(String),
    /// A file that goes into or comes out of the object store.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: std::path::PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The database.
    #[error("database: {}", with_causes(.0))]
    Database(#[from] sqlx::Error),
    /// The tables are of a newer version of the program.
    #[error(
        "the database was brought up to date by a newer gable: it has tables of version {found}, and this program knows them up to {known}. \
         Start that program here, too; to go back to this one, restore the database as it was before the upgrade"
    )]
    NewerTables {
        /// A version that is not known here.
        found: i64,
        /// The last that is known.
        known: i64,
    },
    /// The tables could not be brought up to date.
    #[error("migrating the database: {}", with_causes(.0))]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A source in an object store.
    #[error("{place}: {why}")]
    Fetch {
        /// The source.
        place: String,
        /// What is wrong with it.
        why: String,
    },
    /// What names and opens the object store is missing, or it does not take it.
    #[error("{0}")]
    Credentials(String),
    /// The object store.
    #[error("object store: {}", with_causes(.0))]
    Objects(#[from] object_store::Error),
}

impl JobStoreError {
    /// Whether the same call may succeed later: the database or the object store was away.
    #[must_use]
    pub fn is_transient(&self) -> bool {
        match self {
            Self::Database(e) => match e {
                sqlx::Error::Io(_)
                | sqlx::Error::PoolTimedOut
                | sqlx::Error::PoolClosed
                | sqlx::Error::WorkerCrashed => true,
                // Postgres: connection exceptions, serialisation and deadlock, shutdown; SQLite: busy and locked.
                sqlx::Error::Database(e) => e.code().is_some_and(|c| {
                    c.starts_with("08")
                        || c.starts_with("40")
                        || c.starts_with("57P")
                        || matches!(&*c, "5" | "6" | "517")
                }),
                _ => false,
            },
            Self::Objects(e) => !matches!(
                e,
                object_store::Error::NotFound { .. }
                    | object_store::Error::InvalidPath { .. }
                    | object_store::Error::NotSupported { .. }
                    | object_store::Error::NotImplemented { .. }
                    | object_store::Error::UnknownConfigurationKey { .. }
            ),
            _ => false,
        }
    }

    /// Whether the object store answers, and refuses whoever asks.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        let Self::Objects(e) = self else { return false };
        matches!(e, object_store::Error::PermissionDenied { .. } | object_store::Error::Unauthenticated { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("builder error")]
    struct Outer(#[source] Inner);

    #[derive(Debug, thiserror::Error)]
    #[error("no certificates were found")]
    struct Inner;

    #[test]
    fn causes_are_told_once() {
        assert_eq!(with_causes(&Outer(Inner)), "builder error: no certificates were found");
        let quoted = std::io::Error::other(Inner);
        assert_eq!(with_causes(&quoted), "no certificates were found");
        let store = object_store::Error::Generic { store: "S3", source: Box::new(Outer(Inner)) };
        let told = JobStoreError::from(store).to_string();
        assert!(told.contains("builder error") && told.ends_with("no certificates were found"), "{told}");
    }
}
