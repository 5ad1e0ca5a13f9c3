//! What every request handler needs.

use crate::auth::Access;
use crate::pages::Snapshot;
use crate::shared::Shared;
use crate::sign_in::SignIn;
use crate::{Feed, Gathered, Receiving, TrustedProxy};
use axum::http::HeaderValue;
use gable_files::SourceRoots;
use gable_job_store::{Blobs, Role, Session, Store};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::Mutex;

/// The service's parts. Clones share them.
#[derive(Clone, Debug)]
pub struct Coordinator {
    /// Jobs and tasks.
    pub store: Store,
    /// Contents of artefacts.
    pub blobs: Blobs,
    /// What may be sources of jobs of everybody.
    pub roots: SourceRoots,
    /// What may be sources of jobs of the members of a group besides, by its name.
    pub group_roots: BTreeMap<String, SourceRoots>,
    /// What a request may take.
    pub limits: Limits,
    /// Where what is sent lies until it is in the object store; by default the system's folder for temporary files, which may be in memory.
    pub folder: PathBuf,
    /// Whether, as long as no token was made, whoever asks from this machine is operator.
    pub open: bool,
    /// The jobs whose events are streamed.
    pub feed: Feed,
    /// Proxies whose word is taken for from where a request comes.
    pub proxies: Vec<TrustedProxy>,
    /// Sites whose pages may use the service; by default none but its own.
    pub origins: Vec<HeaderValue>,
    /// How people sign in; none if tokens are all that is taken.
    pub sign_in: Option<Arc<SignIn>>,
    /// What many ask for at the same time.
    pub answers: Answers,
    /// The uploads that are being received.
    pub receiving: Receiving,
    /// What is to be written to the audit log.
    pub gathered: Gathered,
}

impl Coordinator {
    /// A coordinator over these, for callers with tokens.
    #[must_use]
    pub fn new(store: Store, blobs: Blobs, roots: SourceRoots, limits: Limits) -> Self {
        let folder = std::env::temp_dir();
        Self {
            store,
            blobs,
            roots,
            group_roots: BTreeMap::new(),
            limits,
            folder,
            open: false,
            feed: Feed::default(),
            proxies: Vec::new(),
            origins: Vec::new(),
            sign_in: None,
            answers: Answers::default(),
            receiving: Receiving::default(),
            gathered: Gathered::default(),
        }
    }
}

/// Answers that are shared by all who ask for the same at the same time.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    /// Jobs by id, as JSON.
    pub(crate) jobs: Shared<Snapshot>,
    /// Their blocks.
    pub(crate) blocks: Shared<Snapshot>,
    /// Who asks, by the hash of the token that is shown.
    pub(crate) access: Shared<Access>,
    /// Who has signed in, by the hash of what their browser shows.
    pub(crate) sessions: Shared<Option<Session>>,
    /// The roles of callers in cities, by the names of the caller and that of the city.
    pub(crate) roles: Shared<Option<Role>>,
    /// What is signed with, by name.
    pub(crate) secrets: Shared<String>,
    /// The cities of jobs.
    pub(crate) cities: Shared<String>,
    /// What was wrong with the object store and the folder when that was last looked at.
    pub(crate) ready: Arc<Mutex<Option<(Instant, Option<String>)>>>,
    /// Bytes of all that is kept, and when they were counted.
    pub(crate) stored: Arc<Mutex<Option<(Instant, i64)>>>,
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
    /// Most that the uploads of one token may have together, bytes.
    pub uploads: u64,
    /// Most uploads in parts that one token may have under way; and most bodies of uploads and parts that it may send at a time.
    pub open_uploads: i64,
    /// Least that has to come of the body of an upload in each window while the service waits for it, bytes.
    pub upload_least: u64,
    /// The window.
    pub upload_window: Duration,
    /// Longest time for the body of an upload.
    pub upload_time: Duration,
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
            // The list of the parts of an upload has up to 10,000 entries.
            body: 2 << 20,
            time: Duration::from_secs(30),
            page: 1000,
            upload: 16 << 30,
            uploads: 64 << 30,
            open_uploads: 16,
            // 4 KiB a second.
            upload_least: 120 << 10,
            upload_window: Duration::from_secs(30),
            upload_time: Duration::from_secs(24 * 3600),
            unpacked: 64 << 30,
            files: 100_000,
            private_webhooks: false,
        }
    }
}
