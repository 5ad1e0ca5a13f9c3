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
    /// What may be sources of jobs: folders, absolute and without links, and places such as `s3://BUCKET/PREFIX`.
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
    /// Largest upload, bytes.
    pub upload: u64,
    /// Most that an upload may unpack to, bytes.
    pub unpacked: u64,
    /// Most files in an upload.
    pub files: usize,
    /// Whether webhooks may be at addresses that are not public.
    pub private_webhooks: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            body: 1 << 20,
            time: Duration::from_secs(30),
            page: 1000,
            upload: 16 << 30,
            unpacked: 64 << 30,
            files: 100_000,
            private_webhooks: false,
        }
    }
}
