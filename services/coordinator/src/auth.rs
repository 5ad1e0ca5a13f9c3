//! Who asks, and what they may do.
//!
//! Callers show a bearer token; people who have signed in at the dashboard show the cookie of their session. A service that was started to be open, and for which no token was made, takes requests without one
//! as well, from the people at its own machine: only under a loopback name, from its own pages, and not from a proxy that says that it
//! is one, so that no page of another site can reach it through a browser on that machine. A proxy that does not say so cannot be told
//! from a person, which is why nothing is open by itself.

use crate::access::Asking;
use crate::base::Base;
use crate::shared::Freshness;
use crate::sign_in::{self, SESSION};
use crate::{Coordinator, Problem};
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, header};
use gable_job_store::{BlobId, JobStoreError, Scope, Session, Store, TokenRecord};
use std::time::Duration;

/// Who asks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Caller {
    /// Name of the token; `user:NAME` for somebody who has signed in; `local` for a caller without either at a service that is open.
    pub name: String,
    /// What they may do.
    pub scope: Scope,
    /// Their groups.
    pub groups: Vec<String>,
    /// Most jobs under way; none for no limit.
    pub max_jobs: Option<i64>,
    /// When what they have shown ends, milliseconds since 1970; none for never.
    pub ends: Option<i64>,
    /// Whether they have signed in, rather than shown a token.
    pub signed_in: bool,
}

impl From<TokenRecord> for Caller {
    fn from(token: TokenRecord) -> Self {
        let TokenRecord { name, scope, groups, max_jobs, expires, .. } = token;
        Self { name, scope, groups, max_jobs, ends: expires, signed_in: false }
    }
}

impl From<Session> for Caller {
    fn from(session: Session) -> Self {
        let Session { name, scope, groups, expires, .. } = session;
        Self { name, scope, groups, max_jobs: None, ends: Some(expires), signed_in: true }
    }
}

impl Caller {
    /// Whoever asks a service that is open.
    pub(crate) fn local() -> Self {
        Self {
            name: "local".to_owned(),
            scope: Scope::Operator,
            groups: Vec::new(),
            max_jobs: None,
            ends: None,
            signed_in: false,
        }
    }

    /// An error unless the caller has at least this scope.
    pub(crate) fn needs(&self, scope: Scope) -> Result<(), Problem> {
        if self.scope >= scope {
            return Ok(());
        }
        let of = if self.signed_in { "somebody" } else { "a token" };
        let (wanted, found) = (scope.name(), self.scope.name());
        Err(Problem::forbidden(format!("this needs {of} of scope {wanted}, yours is {found}")))
    }
}

impl FromRequestParts<Coordinator> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Coordinator) -> Result<Self, Problem> {
        let session = signed_in(parts, service).await?;
        if let Some(caller) = session {
            Asking::note(parts, &caller.name);
            return Ok(caller);
        }
        let shown = parts.headers.get(header::AUTHORIZATION).and_then(|v| v.to_str().ok()).and_then(bearer);
        let hash = shown.map(hash).unwrap_or_default();
        let writes = service.store.writes();
        // Looking may go on for a moment after a token was taken away; doing may not.
        let freshness = if parts.method.is_safe() { Freshness::lately(writes) } else { Freshness::now(writes) };
        let access = service.answers.access.get(&hash, freshness, |_| Access::find(service, &hash));
        let caller = match access.await? {
            Access::Open => {
                from_this_machine(&parts.headers)?;
                Self::local()
            }
            Access::Token(found) => found.into(),
            Access::Closed if shown.is_none() => {
                let what = "send the header Authorization: Bearer TOKEN; gable token create makes a token";
                return Err(Problem::unauthorised(what));
            }
            Access::Closed => return Err(Problem::unauthorised("this token is not known, or has ended")),
        };
        Asking::note(parts, &caller.name);
        Ok(caller)
    }
}

/// Who has signed in, if a browser shows a session that has not ended, and no token.
async fn signed_in(parts: &mut Parts, service: &Coordinator) -> Result<Option<Caller>, Problem> {
    if service.sign_in.is_none() || parts.headers.contains_key(header::AUTHORIZATION) {
        return Ok(None);
    }
    let Ok(base) = Base::from_request_parts(parts, service).await;
    let Some(cookie) = sign_in::shown(&parts.headers, &base, SESSION) else { return Ok(None) };
    let hash = hash(cookie);
    let writes = service.store.writes();
    let freshness = if parts.method.is_safe() { Freshness::lately(writes) } else { Freshness::now(writes) };
    let session = service.answers.sessions.get(&hash, freshness, |_| service.store.session(&hash)).await?;
    let session = session.ok_or_else(|| Problem::unauthorised("your session has ended: sign in again"))?;
    if !parts.method.is_safe() {
        sign_in::from_own_page(&parts.headers, &base)?;
    }
    Ok(Some(session.into()))
}

/// The token in a header that shows one.
fn bearer(header: &str) -> Option<&str> {
    header.split_once(' ').filter(|(kind, _)| kind.eq_ignore_ascii_case("bearer")).map(|(_, token)| token.trim())
}

/// What a hash of a token opens.
#[derive(Clone, Debug)]
pub(crate) enum Access {
    /// The service is open, and no token was made yet.
    Open,
    /// The token is known.
    Token(TokenRecord),
    /// The service asks for a token, and this is none that it knows.
    Closed,
}

impl Access {
    /// Asks the database.
    async fn find(service: &Coordinator, hash: &str) -> Result<Self, JobStoreError> {
        if !hash.is_empty()
            && let Some(found) = service.store.token(hash).await?
        {
            return Ok(Self::Token(found));
        }
        let open = service.open && !service.store.has_tokens().await?;
        Ok(if open { Self::Open } else { Self::Closed })
    }
}

/// What proxies say of those for whom they ask.
const FORWARDED: [&str; 7] =
    ["forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-forwarded-prefix", "x-forwarded-proto", "x-real-ip"];

/// An error unless the request was made under a loopback name, and neither by a page of another site nor by a proxy that says so.
fn from_this_machine(headers: &HeaderMap) -> Result<(), Problem> {
    let text = |name| headers.get(name).and_then(|v: &header::HeaderValue| v.to_str().ok());
    let host = text(header::HOST).unwrap_or_default();
    let name =
        host.rsplit_once(':').filter(|(_, port)| port.bytes().all(|b| b.is_ascii_digit())).map_or(host, |(n, _)| n);
    if !matches!(name, "localhost" | "127.0.0.1" | "[::1]") {
        return Err(Problem::unauthorised(
            "this service is open to its own machine only, so only requests to localhost are answered: gable token create",
        ));
    }
    if let Some(header) = FORWARDED.into_iter().find(|name| headers.contains_key(*name)) {
        return Err(Problem::unauthorised(format!(
            "this service is open to its own machine only, and the header {header} says that a proxy asks for others: gable token create"
        )));
    }
    match text(header::ORIGIN) {
        Some(origin) if origin.strip_prefix("http://") != Some(host) => {
            Err(Problem::forbidden(format!("pages of {origin} may not use this service")))
        }
        _ => Ok(()),
    }
}

pub(crate) fn hash(token: &str) -> String {
    BlobId::of(token.as_bytes()).to_string()
}

/// What a new token is to allow.
#[derive(Clone, Debug)]
pub struct NewToken {
    /// Whose it is; unique.
    pub name: String,
    /// What it allows.
    pub scope: Scope,
    /// Groups of its holder.
    pub groups: Vec<String>,
    /// Most jobs under way; none for no limit.
    pub max_jobs: Option<i64>,
    /// When it ends, milliseconds since 1970; none for never.
    pub expires: Option<i64>,
}

/// Makes a token and gives it; it is not kept, only its hash. None if the name is taken.
///
/// # Errors
/// If the database does not answer.
pub async fn create_token(store: &Store, new: &NewToken) -> Result<Option<String>, JobStoreError> {
    let (token, record) = draw(new)?;
    Ok(store.add_token(&record).await?.then_some(token))
}

/// Puts a new token in the place of the one of this name, and gives it; the one before opens for `grace` more. Scope, groups, limits and
/// memberships stay. None if there is no such token.
///
/// # Errors
/// If the database does not answer.
pub async fn rotate_token(store: &Store, name: &str, grace: Duration) -> Result<Option<String>, JobStoreError> {
    let token = random()?;
    Ok(store.rotate_token(name, &hash(&token), grace).await?.then_some(token))
}

/// Name of the token that a service makes for whoever starts it first.
const FIRST: &str = "operator";

/// Makes the first token of a database, an operator's, and gives it; it is not kept, only its hash. None if there is any token. Of
/// several coordinators that start at once, one makes it.
///
/// # Errors
/// If the database does not answer.
pub async fn create_first_token(store: &Store) -> Result<Option<String>, JobStoreError> {
    if store.has_tokens().await? {
        return Ok(None);
    }
    let new =
        NewToken { name: FIRST.to_owned(), scope: Scope::Operator, groups: Vec::new(), max_jobs: None, expires: None };
    let (token, record) = draw(&new)?;
    Ok(store.add_first_token(&record).await?.then_some(token))
}

/// A token that nobody can guess, and what is kept of it.
fn draw(new: &NewToken) -> Result<(String, TokenRecord), JobStoreError> {
    let token = random()?;
    let record = TokenRecord {
        hash: hash(&token),
        name: new.name.clone(),
        scope: new.scope,
        groups: new.groups.clone(),
        max_jobs: new.max_jobs,
        expires: new.expires,
        created: 0,
    };
    Ok((token, record))
}

/// A text that nobody can guess.
pub(crate) fn random() -> Result<String, JobStoreError> {
    let mut secret = [0_u8; 32];
    getrandom::fill(&mut secret).map_err(|e| JobStoreError::File {
        path: "/dev/urandom".into(),
        source: std::io::Error::other(e.to_string()),
    })?;
    Ok(format!("gable_{}", secret.iter().map(|b| format!("{b:02x}")).collect::<String>()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn asked(host: &'static str, origin: Option<&'static str>) -> Result<(), u16> {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, HeaderValue::from_static(host));
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, HeaderValue::from_static(origin));
        }
        from_this_machine(&headers).map_err(|p| p.status)
    }

    #[test]
    fn an_open_service_answers_its_own_machine_only() {
        assert_eq!(asked("localhost:8080", None), Ok(()));
        assert_eq!(asked("127.0.0.1:8080", Some("http://127.0.0.1:8080")), Ok(()));
        assert_eq!(asked("[::1]:8080", None), Ok(()));
        assert_eq!(asked("[::1]", None), Ok(()));
        assert_eq!(asked("gable.example:8080", None), Err(401), "a name that another site made point here");
        assert_eq!(asked("localhost:8080", Some("http://evil.example")), Err(403));
        assert_eq!(asked("localhost:8080", Some("null")), Err(403));
        assert_eq!(asked("localhost:8080", Some("http://localhost:9999")), Err(403));
        for name in FORWARDED {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_static("127.0.0.1:8080"));
            headers.insert(name, HeaderValue::from_static("203.0.113.7"));
            assert_eq!(from_this_machine(&headers).map_err(|p| p.status), Err(401), "{name}");
        }
    }
}
