//! A service on another machine, asked over HTTP.

use crate::cli::RemoteArgs;
use crate::exit::UsageError;
use serde_json::Value;
use std::io::Read;
use std::time::Duration;
use ureq::http::{Request, Response};
use ureq::{Agent, Body};

/// Longest time for an answer to begin, and for one that is no file to end.
const PATIENCE: Duration = Duration::from_secs(60);

/// How often an unreachable service is asked again, and how long is waited before.
const AGAIN: [Duration; 3] = [Duration::from_millis(300), Duration::from_secs(1), Duration::from_secs(3)];

/// Largest answer that is no file, bytes.
const LARGEST: u64 = 256 << 20;

/// Why a service did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RemoteError {
    /// It refuses: the request has to be another one.
    #[error("the service refuses: {0}")]
    Refused(String),
    /// It could not.
    #[error("the service failed with status {status}: {detail}")]
    Failed {
        /// HTTP status.
        status: u16,
        /// What it says.
        detail: String,
    },
    /// It does not answer.
    #[error("{url} does not answer ({reason}): is the service running, and is GABLE_URL or --url right?")]
    Unreachable {
        /// Its address.
        url: String,
        /// What happened.
        reason: String,
    },
    /// It answers something else than this version understands.
    #[error("{url} answers what this version does not understand: {reason}")]
    Unreadable {
        /// What was asked for.
        url: String,
        /// What is wrong with it.
        reason: String,
    },
}

impl RemoteError {
    /// Whether the same request may succeed later.
    pub(crate) fn is_transient(&self) -> bool {
        matches!(self, Self::Unreachable { .. } | Self::Failed { .. })
    }
}

/// A service.
pub(crate) struct Remote {
    agent: Agent,
    /// Without a slash at its end.
    url: String,
    token: Option<String>,
}

impl Remote {
    /// The service that the arguments name.
    pub(crate) fn new(args: &RemoteArgs) -> Result<Self, UsageError> {
        let url = args.url.trim().trim_end_matches('/').to_owned();
        if !url.starts_with("http://") {
            return Err(UsageError(format!("--url {url}: give http://HOST:PORT; TLS is not spoken by these commands")));
        }
        let agent = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_connect(Some(Duration::from_secs(10)))
            .timeout_recv_response(Some(PATIENCE))
            .user_agent(concat!("gable/", env!("CARGO_PKG_VERSION")))
            .build()
            .into();
        Ok(Self { agent, url, token: args.token.clone() })
    }

    /// What is at an address under `/api/v1`.
    pub(crate) fn get(&self, path: &str) -> Result<Value, RemoteError> {
        self.json("GET", path, &[], None)
    }

    /// Tells the service something. What is told twice by mistake must not matter.
    pub(crate) fn post(
        &self,
        path: &str,
        headers: &[(&str, &str)],
        body: Option<&Value>,
    ) -> Result<Value, RemoteError> {
        self.json("POST", path, headers, body)
    }

    /// Puts something at an address.
    pub(crate) fn put(&self, path: &str, body: &Value) -> Result<Value, RemoteError> {
        self.json("PUT", path, &[], Some(body))
    }

    /// Removes what is at an address.
    pub(crate) fn delete(&self, path: &str) -> Result<(), RemoteError> {
        self.ask("DELETE", path, &[], None).map(drop)
    }

    /// What is at an address, if it has changed since `tag`; with its tag.
    pub(crate) fn changed(&self, path: &str, tag: &str) -> Result<Option<(Value, String)>, RemoteError> {
        let mut response = self.ask("GET", path, &[("if-none-match", tag)], None)?;
        if response.status() == 304 {
            return Ok(None);
        }
        let tag = response.headers().get("etag").and_then(|v| v.to_str().ok()).unwrap_or_default().to_owned();
        Ok(Some((self.read(path, &mut response)?, tag)))
    }

    /// A file, as a stream.
    pub(crate) fn file(&self, path: &str) -> Result<impl Read + use<>, RemoteError> {
        Ok(self.ask("GET", path, &[], None)?.into_body().into_reader())
    }

    fn json(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: Option<&Value>,
    ) -> Result<Value, RemoteError> {
        let mut response = self.ask(method, path, headers, body)?;
        self.read(path, &mut response)
    }

    fn read(&self, path: &str, response: &mut Response<Body>) -> Result<Value, RemoteError> {
        let wrong = |reason: String| RemoteError::Unreadable { url: format!("{}{path}", self.url), reason };
        let text = response.body_mut().with_config().limit(LARGEST).read_to_vec().map_err(|e| wrong(e.to_string()))?;
        serde_json::from_slice(&text).map_err(|e| wrong(e.to_string()))
    }

    /// An answer that is no refusal.
    fn ask(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: Option<&Value>,
    ) -> Result<Response<Body>, RemoteError> {
        let mut pauses = AGAIN.iter();
        loop {
            match self.ask_once(method, path, headers, body) {
                Err(e) if e.is_transient() => match pauses.next() {
                    Some(pause) => {
                        tracing::debug!("trying again: {e}");
                        std::thread::sleep(*pause);
                    }
                    None => return Err(e),
                },
                result => return result,
            }
        }
    }

    fn ask_once(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: Option<&Value>,
    ) -> Result<Response<Body>, RemoteError> {
        let unreachable = |reason: String| RemoteError::Unreachable { url: self.url.clone(), reason };
        let mut request = Request::builder().method(method).uri(format!("{}/api/v1{path}", self.url));
        if let Some(token) = &self.token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        if body.is_some() {
            request = request.header("content-type", "application/json");
        }
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let body = body.map(Value::to_string).unwrap_or_default();
        let request = request.body(body).map_err(|e| unreachable(e.to_string()))?;
        let mut response = self.agent.run(request).map_err(|e| unreachable(e.to_string()))?;
        let status = response.status().as_u16();
        if status < 400 {
            return Ok(response);
        }
        let told = response.body_mut().with_config().limit(1 << 20).read_to_string().unwrap_or_default();
        let detail = serde_json::from_str::<Value>(&told).ok().and_then(|p| p["detail"].as_str().map(str::to_owned));
        let detail = detail.unwrap_or_else(|| told.lines().next().unwrap_or_default().to_owned());
        match status {
            400..=499 => Err(RemoteError::Refused(detail)),
            _ => Err(RemoteError::Failed { status, detail }),
        }
    }
}
