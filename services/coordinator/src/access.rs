//! The access log: one line for each request, with who asked, and what it was answered.
//!
//! It has a target of its own, [`TARGET`], so that `RUST_LOG=info,access=off` leaves it out. Headers, queries and bodies are never in
//! it: they may hold secrets.

use crate::visitor::Visitor;
use axum::body::Body;
use axum::extract::Request;
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::Response;
use std::sync::{Arc, OnceLock};
use std::time::Instant;
use tracing::Instrument as _;

/// Target of the lines.
pub(crate) const TARGET: &str = "access";

/// Where who asks is noted, once it is known.
#[derive(Clone, Debug, Default)]
pub(crate) struct Asking {
    name: Arc<OnceLock<String>>,
    address: Option<String>,
}

impl Asking {
    /// Notes the name of the token that a request has shown.
    pub(crate) fn note(parts: &Parts, name: &str) {
        if let Some(asking) = parts.extensions.get::<Self>() {
            // A handler may ask twice who asks; the answer is the same.
            let _ = asking.name.set(name.to_owned());
        }
    }

    /// The same, for a handler that finds out later.
    pub(crate) fn set(&self, name: &str) {
        let _ = self.name.set(name.to_owned());
    }

    /// The name of the token that was shown.
    pub(crate) fn who(&self) -> Option<&str> {
        self.name.get().map(String::as_str)
    }

    /// From where the request came.
    pub(crate) fn address(&self) -> Option<String> {
        self.address.clone()
    }
}

/// An address as it may be logged: what opens a link is a secret.
pub(crate) fn without_secrets(path: &str) -> String {
    let Some((before, link)) = path.split_once("/links/") else { return path.to_owned() };
    let rest = link.find('/').map_or("", |at| &link[at..]);
    format!("{before}/links/-{rest}")
}

/// A request that is being answered. One whose client goes away before that is told of, too.
struct Line {
    method: String,
    path: String,
    begun: Instant,
    asking: Asking,
    status: Option<u16>,
}

impl Drop for Line {
    fn drop(&mut self) {
        let (method, path, status) = (&self.method, &self.path, self.status);
        let milliseconds = (self.begun.elapsed().as_secs_f64() * 10_000.0).round() / 10.0;
        let (token, address) = (self.asking.who(), self.asking.address.as_deref());
        // What asks every few seconds whether the service lives would be most of all there is.
        if matches!(path.as_str(), "/healthz" | "/readyz") && status == Some(200) {
            tracing::debug!(target: TARGET, method, path, status, milliseconds, token, address, "answered");
        } else if status.is_none() {
            tracing::info!(target: TARGET, method, path, milliseconds, token, address, "the client has gone");
        } else {
            tracing::info!(target: TARGET, method, path, status, milliseconds, token, address, "answered");
        }
    }
}

/// Answers a request, and logs that. The time is that until the answer begins: its body may be a stream.
pub(crate) async fn log(mut request: Request<Body>, next: Next) -> Response {
    let address = request.extensions().get::<Visitor>().and_then(|visitor| visitor.address);
    let asking = Asking { address: address.map(|address| address.to_string()), ..Asking::default() };
    request.extensions_mut().insert(asking.clone());
    let path = without_secrets(request.uri().path());
    let mut parts = path.split('/').skip_while(|part| *part != "jobs").skip(1);
    let job = parts.next().filter(|id| !id.is_empty());
    let method = request.method().to_string();
    let span = tracing::info_span!("request", method, path, job, status = tracing::field::Empty);
    let mut line = Line { method, path, begun: Instant::now(), asking, status: None };
    let response = next.run(request).instrument(span.clone()).await;
    let status = response.status().as_u16();
    span.record("status", status);
    line.status = Some(status);
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_not_logged() {
        assert_eq!(
            without_secrets("/api/v1/links/abc.def/files/3dtiles/tileset.json"),
            "/api/v1/links/-/files/3dtiles/tileset.json"
        );
        assert_eq!(without_secrets("/api/v1/links/abc.def"), "/api/v1/links/-");
        assert_eq!(without_secrets("/api/v1/cities/delft/links"), "/api/v1/cities/delft/links");
    }
}
