//! The addresses of the flow: `/auth/login`, `/auth/callback`, `/auth/logout`.

use super::SignIn;
use super::claims::NotLetIn;
use super::provider::ProviderFault;
use super::session::{LOGIN, SESSION, from_own_page, given, shown};
use crate::access::Asking;
use crate::auth::{hash, random};
use crate::base::Base;
use crate::extract::Query;
use crate::pages::escaped;
use crate::shared::Freshness;
use crate::{Coordinator, Problem};
use axum::Router;
use axum::extract::{Extension, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use gable_job_store::Session;
use hmac::{Hmac, KeyInit as _, Mac as _};
use serde::Deserialize;
use sha2::{Digest as _, Sha256};
use std::time::Duration;

/// How long somebody has for signing in at the provider.
const PATIENCE: Duration = Duration::from_secs(600);

/// Name of what logins are signed with.
const SECRET: &str = "logins";

/// Where the provider sends browsers.
const CALLBACK: &str = "/auth/callback";

/// The addresses of the flow. They are for browsers alone, and not in the description of the API.
pub(crate) fn router() -> Router<Coordinator> {
    Router::new().route("/auth/login", get(login)).route(CALLBACK, get(callback)).route("/auth/logout", post(logout))
}

/// What a login is known by: all of it is made of a random seed under a secret of the service.
struct Login<'a> {
    seed: &'a str,
    secret: &'a str,
}

impl Login<'_> {
    /// A text that only who knows the secret can make of the seed.
    fn made(&self, what: &str) -> Option<String> {
        Some(URL_SAFE_NO_PAD.encode(self.mac(what)?.finalize().into_bytes()))
    }

    fn mac(&self, what: &str) -> Option<Hmac<Sha256>> {
        let mut mac = Hmac::<Sha256>::new_from_slice(self.secret.as_bytes()).ok()?;
        mac.update(format!("{what} {}", self.seed).as_bytes());
        Some(mac)
    }

    /// Whether a text is the one that is made of the seed. Takes the same time wherever the first difference is.
    fn has_made(&self, what: &str, text: &str) -> bool {
        let given = URL_SAFE_NO_PAD.decode(text).ok();
        given.zip(self.mac(what)).is_some_and(|(given, mac)| mac.verify_slice(&given).is_ok())
    }
}

/// What a browser keeps while somebody signs in: the seed, when that ends, and a signature of both.
fn kept(seed: &str, until: i64, secret: &str) -> Option<String> {
    let text = format!("{seed}.{until}");
    let tag = Login { seed: &text, secret }.made("kept")?;
    Some(format!("{text}.{tag}"))
}

/// The seed of what a browser shows, if it was given to it and has not ended.
fn seed_of<'a>(shown: &'a str, now: i64, secret: &str) -> Option<&'a str> {
    let (text, tag) = shown.rsplit_once('.')?;
    let (seed, until) = text.split_once('.')?;
    let right = Login { seed: text, secret }.has_made("kept", tag);
    (right && until.parse::<i64>().ok()? > now).then_some(seed)
}

/// What logins are signed with.
async fn secret(service: &Coordinator) -> Result<String, Problem> {
    let freshness = Freshness::lately(service.store.writes());
    let ask = async |_: Option<String>| service.store.secret(SECRET, &random()?).await;
    Ok(service.answers.secrets.get(SECRET, freshness, ask).await?)
}

fn sign_in(service: &Coordinator) -> Result<&SignIn, Problem> {
    let none = || Problem::not_found("nobody signs in at this service: it asks for tokens");
    service.sign_in.as_deref().ok_or_else(none)
}

fn now() -> i64 {
    jiff::Timestamp::now().as_millisecond()
}

/// Sends a browser elsewhere.
fn sent_to(place: &str, cookies: &[String]) -> Response {
    let mut response =
        (StatusCode::SEE_OTHER, [(header::LOCATION, place), (header::CACHE_CONTROL, "no-store")]).into_response();
    for cookie in cookies {
        if let Ok(value) = cookie.parse() {
            response.headers_mut().append(header::SET_COOKIE, value);
        }
    }
    response
}

/// Sends a browser to the provider.
async fn login(State(service): State<Coordinator>, base: Base) -> Result<Response, Problem> {
    let sign_in = sign_in(&service)?;
    let provider = match sign_in.provider(false).await {
        Ok(provider) => provider,
        Err(fault) => return Ok(refused(&base, &Refused::Provider(fault))),
    };
    let (seed, secret) = (random()?, secret(&service).await?);
    let login = Login { seed: &seed, secret: &secret };
    let internal = || Problem::invalid("the login cannot be signed");
    let [state, nonce, verifier] = ["state", "nonce", "verifier"].map(|what| login.made(what));
    let (state, nonce, verifier) =
        (state.ok_or_else(internal)?, nonce.ok_or_else(internal)?, verifier.ok_or_else(internal)?);
    let challenge = URL_SAFE_NO_PAD.encode(Sha256::digest(verifier.as_bytes()));
    let scopes = std::iter::once("openid").chain(sign_in.settings.scopes.iter().map(String::as_str));
    let asked = [
        ("response_type", "code"),
        ("client_id", &sign_in.settings.client),
        ("redirect_uri", &base.href(CALLBACK)),
        ("scope", &scopes.collect::<Vec<_>>().join(" ")),
        ("state", &state),
        ("nonce", &nonce),
        ("code_challenge", &challenge),
        ("code_challenge_method", "S256"),
    ];
    let asked: Vec<String> = asked.iter().map(|(name, value)| format!("{name}={}", escaped(value))).collect();
    let at = &provider.said.authorization_endpoint;
    let place = format!("{at}{}{}", if at.contains('?') { '&' } else { '?' }, asked.join("&"));
    let until = now() + i64::try_from(PATIENCE.as_millis()).unwrap_or_default();
    let kept = kept(&seed, until, &secret).ok_or_else(internal)?;
    Ok(sent_to(&place, &[given(&base, LOGIN, Some((&kept, PATIENCE)))]))
}

/// What the provider says through the browser.
#[derive(Deserialize)]
struct Answer {
    code: Option<String>,
    state: Option<String>,
    error: Option<String>,
    /// RFC 9207.
    iss: Option<String>,
}

/// Why somebody is not signed in.
#[derive(Debug, thiserror::Error)]
enum Refused {
    #[error("the login was not begun in this browser, or took longer than ten minutes")]
    Unknown,
    #[error("the provider refused: {0}")]
    Denied(String),
    #[error("{0}")]
    Provider(#[from] ProviderFault),
    #[error("{0}")]
    NotLetIn(#[from] NotLetIn),
}

impl Refused {
    /// The name under which the dashboard has words for it.
    fn name(&self) -> &'static str {
        match self {
            Self::Unknown => "expired",
            Self::Denied(_) => "denied",
            Self::Provider(_) => "failed",
            Self::NotLetIn(NotLetIn::NoRole(..)) => "no-role",
            Self::NotLetIn(_) => "no-name",
        }
    }
}

/// Sends a browser back to the dashboard, which says why; the log has it in full.
fn refused(base: &Base, why: &Refused) -> Response {
    tracing::warn!("somebody could not sign in: {why}");
    sent_to(&format!("/#/jobs?sign-in={}", why.name()), &[given(base, LOGIN, None)])
}

/// Takes somebody back from the provider.
async fn callback(
    State(service): State<Coordinator>,
    Extension(asking): Extension<Asking>,
    base: Base,
    headers: HeaderMap,
    Query(answer): Query<Answer>,
) -> Result<Response, Problem> {
    let sign_in = sign_in(&service)?;
    let secret = secret(&service).await?;
    let seed = shown(&headers, &base, LOGIN).and_then(|shown| seed_of(shown, now(), &secret));
    let Some(seed) = seed else { return Ok(refused(&base, &Refused::Unknown)) };
    let login = Login { seed, secret: &secret };
    let known = answer.state.as_deref().is_some_and(|state| login.has_made("state", state));
    if !known || answer.iss.as_ref().is_some_and(|iss| *iss != sign_in.settings.issuer) {
        return Ok(refused(&base, &Refused::Unknown));
    }
    let code = match (answer.code, answer.error) {
        (Some(code), None) => code,
        (_, error) => {
            let said: String = error.unwrap_or_default().chars().filter(|c| c.is_ascii_graphic()).take(100).collect();
            return Ok(refused(&base, &Refused::Denied(said)));
        }
    };
    let internal = || Problem::invalid("the login cannot be signed");
    let verifier = login.made("verifier").ok_or_else(internal)?;
    let nonce = login.made("nonce").ok_or_else(internal)?;
    let claims = sign_in.claims(&code, &base.href(CALLBACK), &verifier, &nonce).await.map_err(Refused::from);
    let person = claims.and_then(|claims| Ok(sign_in.settings.grants.person(&claims)?));
    let person = match person {
        Ok(person) => person,
        Err(why) => return Ok(refused(&base, &why)),
    };
    // Whoever knew the cookie of a session before does not know this one.
    let cookie = random()?;
    let time = sign_in.settings.time;
    let (name, scope) = (person.name.clone(), person.scope.name());
    let session =
        Session { hash: hash(&cookie), name: person.name, scope: person.scope, groups: person.groups, expires: 0 };
    service.store.add_session(&session, time).await?;
    asking.set(&name);
    tracing::info!(name, scope, "signed in");
    Ok(sent_to("/", &[given(&base, SESSION, Some((&cookie, time))), given(&base, LOGIN, None)]))
}

/// Ends the session of a browser.
async fn logout(
    State(service): State<Coordinator>,
    Extension(asking): Extension<Asking>,
    base: Base,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    sign_in(&service)?;
    from_own_page(&headers, &base)?;
    if let Some(cookie) = shown(&headers, &base, SESSION) {
        let hash = hash(cookie);
        if let Some(session) = service.store.session(&hash).await? {
            asking.set(&session.name);
        }
        service.store.remove_session(&hash).await?;
    }
    Ok((StatusCode::NO_CONTENT, [(header::SET_COOKIE, given(&base, SESSION, None))]).into_response())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_given_to_a_browser_is_taken_from_it() {
        let kept = kept("seed", 1000, "secret").unwrap();
        assert_eq!(seed_of(&kept, 999, "secret"), Some("seed"));
        assert_eq!(seed_of(&kept, 1000, "secret"), None, "it has ended");
        assert_eq!(seed_of(&kept, 999, "other"), None);
        let tag = kept.rsplit('.').next().unwrap();
        for forged in [
            format!("seed.9999.{tag}"),
            format!("sead.1000.{tag}"),
            "seed.1000.".to_owned(),
            "seed.1000".to_owned(),
            String::new(),
        ] {
            assert_eq!(seed_of(&forged, 999, "secret"), None, "{forged}");
        }
        let login = Login { seed: "seed", secret: "secret" };
        let made = login.made("state").unwrap();
        assert!(login.has_made("state", &made) && !login.has_made("nonce", &made) && !login.has_made("state", ""));
        assert!(!Login { seed: "other", secret: "secret" }.has_made("state", &made));
    }
}
