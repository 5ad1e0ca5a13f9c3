//! What ends a worker.

use gable_job_store::JobStoreError;

/// A failure that is not one task's.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The worker's own folder.
    #[error("the worker's folder {}: {source}", path.display())]
    Folder {
        /// The folder or file.
        path: std::path::PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The program that does the tasks.
    #[error("{program} cannot be started: {source}")]
    Program {
        /// Its name.
        program: String,
        /// Why.
        source: std::io::Error,
    },
    /// The database or the object store.
    #[error(transparent)]
    Store(#[from] JobStoreError),
}
