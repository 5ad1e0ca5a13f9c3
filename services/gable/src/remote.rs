//! A service on another machine, asked over HTTP.

use crate::cli::RemoteArgs;
use crate::exit::UsageError;
use serde_json::Value;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use ureq::http::{Request, Response};
use ureq::tls::{PemItem, RootCerts, TlsConfig, parse_pem};
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
    /// It cannot see the mesh.
    #[error("the service refuses: {0}")]
    NotSeen(String),
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
    /// What answers cannot show that it is the service.
    #[error(
        "{url} cannot be trusted ({reason}): if a private authority vouches for it, name its certificate by --ca-file"
    )]
    Untrusted {
        /// Its address.
        url: String,
        /// What is wrong with its certificate.
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

/// What is asked of a service.
#[derive(Clone, Copy)]
struct Call<'a> {
    method: &'a str,
    /// Under `/api/v1`.
    path: &'a str,
    headers: &'a [(&'a str, &'a str)],
    body: Option<&'a Value>,
    /// A body that is no JSON.
    content: Option<&'a [u8]>,
}

impl<'a> Call<'a> {
    fn new(method: &'a str, path: &'a str) -> Self {
        Self { method, path, headers: &[], body: None, content: None }
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
        let Some(place) = url.strip_prefix("http://").or_else(|| url.strip_prefix("https://")) else {
            return Err(UsageError(format!("--url {url}: give http://HOST:PORT or https://HOST")));
        };
        if place.split('/').next().is_some_and(|host| host.contains('@')) {
            return Err(UsageError("--url has a user or a password: leave it out, and give --token".to_owned()));
        }
        let roots = match &args.ca_file {
            Some(file) => authorities(file)?,
            None => RootCerts::PlatformVerifier,
        };
        Ok(Self { agent: agent(roots, None), url, token: args.token.clone() })
    }

    /// What is at an address under `/api/v1`.
    pub(crate) fn get(&self, path: &str) -> Result<Value, RemoteError> {
        self.json(Call::new("GET", path))
    }

    /// Tells the service something. What is told twice by mistake must not matter.
    pub(crate) fn post(
        &self,
        path: &str,
        headers: &[(&str, &str)],
        body: Option<&Value>,
    ) -> Result<Value, RemoteError> {
        self.json(Call { headers, body, ..Call::new("POST", path) })
    }

    /// Puts something at an address.
    pub(crate) fn put(&self, path: &str, body: &Value) -> Result<Value, RemoteError> {
        self.json(Call { body: Some(body), ..Call::new("PUT", path) })
    }

    /// Puts a content at an address.
    pub(crate) fn put_bytes(&self, path: &str, headers: &[(&str, &str)], content: &[u8]) -> Result<Value, RemoteError> {
        self.json(Call { headers, content: Some(content), ..Call::new("PUT", path) })
    }

    /// Whether it is asked under an address of this machine.
    pub(crate) fn is_here(&self) -> bool {
        let place = self.url.split_once("://").map_or("", |(_, place)| place);
        let host = place.split('/').next().unwrap_or_default();
        let port = |port: &str| port.bytes().all(|b| b.is_ascii_digit());
        let name = host.rsplit_once(':').filter(|(_, number)| port(number)).map_or(host, |(name, _)| name);
        matches!(name, "localhost" | "127.0.0.1" | "[::1]")
    }

    /// Removes what is at an address.
    pub(crate) fn delete(&self, path: &str) -> Result<(), RemoteError> {
        self.ask(Call::new("DELETE", path)).map(drop)
    }

    /// What is at an address, if it has changed since `tag`; with its tag.
    pub(crate) fn changed(&self, path: &str, tag: &str) -> Result<Option<(Value, String)>, RemoteError> {
        let mut response = self.ask(Call { headers: &[("if-none-match", tag)], ..Call::new("GET", path) })?;
        if response.status() == 304 {
            return Ok(None);
        }
        let tag = response.headers().get("etag").and_then(|v| v.to_str().ok()).unwrap_or_default().to_owned();
        Ok(Some((self.read(path, &mut response)?, tag)))
    }

    /// A file, as a stream.
    pub(crate) fn file(&self, path: &str) -> Result<impl Read + use<>, RemoteError> {
        Ok(self.ask(Call::new("GET", path))?.into_body().into_reader())
    }

    fn json(&self, call: Call<'_>) -> Result<Value, RemoteError> {
        let mut response = self.ask(call)?;
        self.read(call.path, &mut response)
    }

    fn read(&self, path: &str, response: &mut Response<Body>) -> Result<Value, RemoteError> {
        let wrong = |reason: String| RemoteError::Unreadable { url: format!("{}{path}", self.url), reason };
        let text = response.body_mut().with_config().limit(LARGEST).read_to_vec().map_err(|e| wrong(e.to_string()))?;
        serde_json::from_slice(&text).map_err(|e| wrong(e.to_string()))
    }

    /// An answer that is no refusal.
    fn ask(&self, call: Call<'_>) -> Result<Response<Body>, RemoteError> {
        let mut pauses = AGAIN.iter();
        loop {
            match self.ask_once(call) {
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

    fn ask_once(&self, call: Call<'_>) -> Result<Response<Body>, RemoteError> {
        let unreachable = |reason: String| RemoteError::Unreachable { url: self.url.clone(), reason };
        let mut request = Request::builder().method(call.method).uri(format!("{}/api/v1{}", self.url, call.path));
        if let Some(token) = &self.token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        if call.body.is_some() {
            request = request.header("content-type", "application/json");
        }
        for (name, value) in call.headers {
            request = request.header(*name, *value);
        }
        let json = call.body.map(Value::to_string).unwrap_or_default();
        let body = call.content.unwrap_or(json.as_bytes());
        if call.content.is_some() {
            request = request.header("content-type", "application/octet-stream");
        }
        let request = request.body(body).map_err(|e| unreachable(e.to_string()))?;
        let mut response = self.agent.run(request).map_err(|e| match untrusted(&e) {
            Some(reason) => RemoteError::Untrusted { url: self.url.clone(), reason },
            None => unreachable(e.to_string()),
        })?;
        let status = response.status().as_u16();
        if status < 300 || status == 304 {
            return Ok(response);
        }
        if status < 400 {
            let to = response.headers().get("location").and_then(|v| v.to_str().ok()).unwrap_or("nowhere");
            return Err(RemoteError::Refused(format!("it sends elsewhere, to {to}: give its own address as --url")));
        }
        let told = response.body_mut().with_config().limit(1 << 20).read_to_string().unwrap_or_default();
        let problem = serde_json::from_str::<Value>(&told).unwrap_or_default();
        let detail = problem["detail"].as_str().map(str::to_owned);
        let detail = detail.unwrap_or_else(|| told.lines().next().unwrap_or_default().to_owned());
        match status {
            401 if self.token.is_none() => {
                Err(RemoteError::Refused(format!("it asks for a token: set GABLE_TOKEN, or give --token ({detail})")))
            }
            422 if problem["type"] == "source" => Err(RemoteError::NotSeen(detail)),
            // It took too long on its way: the same again may do better.
            408 => Err(RemoteError::Failed { status, detail }),
            400..=499 => Err(RemoteError::Refused(detail)),
            _ => Err(RemoteError::Failed { status, detail }),
        }
    }
}

/// A client of a server that these vouch for; `most` is the longest time for a whole request.
pub(crate) fn agent(roots: RootCerts, most: Option<Duration>) -> Agent {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let tls = TlsConfig::builder().unversioned_rustls_crypto_provider(provider).root_certs(roots).build();
    Agent::config_builder()
        .http_status_as_error(false)
        // A redirect would carry the token elsewhere.
        .max_redirects(0)
        .max_redirects_will_error(false)
        .timeout_connect(Some(Duration::from_secs(10)))
        .timeout_recv_response(Some(PATIENCE))
        .timeout_global(most)
        .tls_config(tls)
        .user_agent(concat!("gable/", env!("CARGO_PKG_VERSION")))
        .build()
        .into()
}

/// The authorities whose certificates are in a file.
fn authorities(file: &Path) -> Result<RootCerts, UsageError> {
    let wrong = |why: String| UsageError(format!("--ca-file {}: {why}", file.display()));
    let text = std::fs::read(file).map_err(|e| wrong(e.to_string()))?;
    let mut found = Vec::new();
    for item in parse_pem(&text) {
        if let PemItem::Certificate(certificate) = item.map_err(|e| wrong(e.to_string()))? {
            found.push(certificate);
        }
    }
    if found.is_empty() {
        return Err(wrong("there is no certificate in it; it has to be PEM".to_owned()));
    }
    Ok(RootCerts::new_with_certs(&found))
}

/// What is wrong with the certificate of the server, if that is why it was not asked.
fn untrusted(error: &ureq::Error) -> Option<String> {
    let error = match error {
        ureq::Error::Rustls(e) => e,
        ureq::Error::Io(e) => e.get_ref()?.downcast_ref::<rustls::Error>()?,
        _ => return None,
    };
    matches!(error, rustls::Error::InvalidCertificate(_)).then(|| error.to_string())
}
