//! What every request handler needs.

use crate::Feed;
use gable_job_store::{Blobs, Store};
use std::path::PathBuf;
use std::time::Duration;

/// The service's parts. Clones share them.
#[derive(Clone, Debug)]
pub struct Coordinator {
    /// Jobs and tasks.
    pub store: Store,
    /// Contents of artefacts.
    pub blobs: Blobs,
    /// Folders, absolute and without links, whose files may be sources of jobs.
    pub roots: Vec<PathBuf>,
    /// What a request may take.
    pub limits: Limits,
    /// The jobs whose events are streamed.
    pub feed: Feed,
}

/// What a request may take.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest body of a request, bytes.
    pub body: usize,
    /// Longest time for a request other than a stream of events.
    pub time: Duration,
    /// Most entries on a page.
    pub page: i64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { body: 1 << 20, time: Duration::from_secs(30), page: 1000 }
    }
}
