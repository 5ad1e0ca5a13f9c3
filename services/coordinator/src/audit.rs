//! The audit log: who did, steered and downloaded what.
//!
//! Each request that is to change something is noted before it is answered, also one that was refused to a known caller. Downloads are
//! many: they are gathered for a moment, and those of the tiles of one tileset are one entry that says how often.

use crate::Coordinator;
use crate::access::{Asking, without_secrets};
use axum::body::Body;
use axum::extract::{MatchedPath, Request, State};
use axum::http::request::Parts;
use axum::http::{Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use gable_job_store::{AuditEntry, JobStoreError};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;
use tokio::sync::watch;

/// How long downloads are gathered.
const PACE: Duration = Duration::from_secs(2);

/// Most entries that are gathered; whoever adds more writes them.
const GATHERED: usize = 1000;

/// Longest address that is kept, bytes.
const LONGEST: usize = 1000;

/// What gives results away.
const DOWNLOADS: [&str; 7] = [
    "/api/v1/jobs/{id}/files/{*path}",
    "/api/v1/jobs/{id}/map/picture",
    "/api/v1/cities/{city}/files/{*path}",
    "/api/v1/cities/{city}/buildings",
    "/api/v1/cities/{city}/buildings/{id}",
    "/api/v1/jobs/{id}/blocks/{unit}/log",
    "/api/v1/links/{link}/files/{*path}",
];

/// Where somebody who signs in comes back to, who is not known before.
const SIGNS_IN: &str = "/auth/callback";

/// What comes many times in what is noted as a whole.
const PARTS: &str = "/api/v1/open-uploads/{id}/parts/{number}";

/// Which city a request is about, once that is known.
#[derive(Clone, Debug, Default)]
pub(crate) struct About(Arc<OnceLock<String>>);

impl About {
    /// Notes the city that a request is about.
    pub(crate) fn note(parts: &Parts, city: &str) {
        if let Some(about) = parts.extensions.get::<Self>() {
            // It is found out once.
            let _ = about.0.set(city.to_owned());
        }
    }

    /// The city, for a handler that finds out later.
    pub(crate) fn set(&self, city: &str) {
        let _ = self.0.set(city.to_owned());
    }
}

/// Entries that are not written yet. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Gathered(Arc<Mutex<Vec<AuditEntry>>>);

impl Gathered {
    /// Adds an entry to those that wait, and gives how many wait.
    fn add(&self, entry: AuditEntry) -> usize {
        let mut waiting = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |other: &AuditEntry| AuditEntry { times: 1, ..other.clone() } == entry;
        match waiting.iter_mut().rev().find(|other| same(other)) {
            Some(other) => other.times += 1,
            None => waiting.push(entry),
        }
        waiting.len()
    }

    /// Writes what waits. What cannot be written waits on.
    pub(crate) async fn write(&self, service: &Coordinator) -> Result<(), JobStoreError> {
        let entries = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        if entries.is_empty() {
            return Ok(());
        }
        let written = service.store.add_audit(&entries).await;
        if written.is_err() {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).splice(0..0, entries);
        }
        written
    }
}

/// Writes down what was downloaded, until `stop` becomes true.
pub async fn keep_audit(service: &Coordinator, mut stop: watch::Receiver<bool>) {
    loop {
        let stopped = tokio::select! {
            () = tokio::time::sleep(PACE) => false,
            _ = stop.wait_for(|&s| s) => true,
        };
        if let Err(e) = service.gathered.write(service).await {
            tracing::error!("the audit log cannot be written, and waits: {e}");
        }
        if stopped {
            return;
        }
    }
}

/// Answers a request, and notes it if it is one to be noted.
pub(crate) async fn note(State(service): State<Coordinator>, mut request: Request<Body>, next: Next) -> Response {
    let kind = request.extensions().get::<MatchedPath>().map(|path| path.as_str().to_owned());
    let Some(kind) = kind else { return next.run(request).await };
    let changes = (!request.method().is_safe() && kind != PARTS) || kind == SIGNS_IN;
    let downloads = request.method() == Method::GET && DOWNLOADS.contains(&kind.as_str());
    if !changes && !downloads {
        return next.run(request).await;
    }
    let about = About::default();
    request.extensions_mut().insert(about.clone());
    let asking = request.extensions().get::<Asking>().cloned().unwrap_or_default();
    let (method, target) = (request.method().clone(), shortened(&without_secrets(request.uri().path())));
    let response = next.run(request).await;
    // Whom nobody knows would fill the log.
    let Some(who) = asking.who() else { return response };
    let status = response.status();
    if downloads && (status == StatusCode::NOT_MODIFIED || !status.is_success()) {
        return response;
    }
    let made = response.headers().get(header::LOCATION).and_then(|v| v.to_str().ok()).map(shortened);
    let target = if downloads { whole(target) } else { target };
    let entry = AuditEntry {
        who: who.to_owned(),
        address: asking.address(),
        action: format!("{method} {kind}"),
        target,
        status: status.as_u16().into(),
        city: about.0.get().cloned(),
        made,
        times: 1,
        ..AuditEntry::default()
    };
    let waiting = service.gathered.add(entry);
    if (changes || waiting > GATHERED)
        && let Err(e) = service.gathered.write(&service).await
    {
        tracing::error!("the audit log cannot be written, and waits: {e}");
    }
    response
}

/// A tileset instead of one of its tiles.
fn whole(target: String) -> String {
    for folder in ["/files/3dtiles/", "/files/tiles/"] {
        if let Some(at) = target.find(folder) {
            return target[..at + folder.len()].to_owned();
        }
    }
    target
}

fn shortened(text: &str) -> String {
    let mut end = text.len().min(LONGEST);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text[..end].to_owned()
}
