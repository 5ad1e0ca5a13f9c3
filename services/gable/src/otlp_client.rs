//! How spans get to the collector, and what is told of one that is away.

use async_trait::async_trait;
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use ureq::Agent;
use ureq::tls::RootCerts;

/// How long the collector may take for an answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// The client of the exporter, which calls it on a thread of its own: so it may block.
#[derive(Debug)]
pub(crate) struct Client {
    agent: Agent,
    away: AtomicBool,
}

impl Client {
    pub(crate) fn new() -> Self {
        Self { agent: crate::remote::agent(RootCerts::PlatformVerifier, Some(PATIENCE)), away: AtomicBool::new(false) }
    }

    /// Warns once when the collector goes away, not for every batch that is lost.
    fn note(&self, trouble: Option<String>) {
        let before = self.away.swap(trouble.is_some(), Ordering::Relaxed);
        match trouble {
            Some(why) if !before => tracing::warn!("spans are lost until the collector of traces takes them: {why}"),
            None if before => tracing::info!("the collector of traces takes spans again"),
            _ => {}
        }
    }

    fn send(&self, request: Request<Bytes>) -> Result<Response<Bytes>, ureq::Error> {
        let (head, body) = request.into_parts();
        let (head, mut body) = self.agent.run(Request::from_parts(head, &body[..]))?.into_parts();
        Ok(Response::from_parts(head, body.read_to_vec()?.into()))
    }
}

#[async_trait]
impl HttpClient for Client {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let answer = self.send(request);
        self.note(match &answer {
            Ok(answer) if answer.status().is_success() => None,
            Ok(answer) => Some(format!("it answers {}", answer.status())),
            Err(e) => Some(e.to_string()),
        });
        Ok(answer?)
    }
}
