//! Signing in at the dashboard through a provider of OpenID Connect (`gable serve --oidc-issuer`).
//!
//! The authorization-code flow with PKCE, state and nonce:
//!
//! 1. `/auth/login` gives the browser a signed cookie with a random seed, and sends it to the provider. State, nonce and the verifier of
//!    PKCE are made of the seed under a secret that the coordinators of a database share, so nothing is kept until somebody has signed in.
//! 2. The provider sends the browser to `/auth/callback` with a code. What it says as state has to be that of the cookie's seed.
//! 3. The code is changed for an ID token at the provider, whose signature, issuer, audience, time and nonce are checked.
//! 4. Its claims say who that is, and by groups what they may do; a session begins, of which the database has a hash.
//!
//! Programs go on to show tokens. What a browser sends by itself is a cookie, so writes that show one have to come from a page of this
//! service: see [`session`].

mod claims;
mod discovery;
mod flow;
mod provider;
mod session;
mod signatures;

pub use claims::{Grants, PERSON, RoleOfGroup};
pub(crate) use flow::router;
pub(crate) use session::{SESSION, from_own_page, shown};

use discovery::Provider;
use reqwest::{Client, Url};
use std::fmt;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;

/// Longest time for an answer of the provider.
const TIME: Duration = Duration::from_secs(10);

/// Which provider is asked, and what it says is worth.
#[derive(Clone)]
pub struct SignInSettings {
    /// Its address, as it says it itself.
    pub issuer: String,
    /// The name under which the provider knows this service.
    pub client: String,
    /// What shows that it is this service; none where the provider wants none.
    pub secret: Option<String>,
    /// What is asked for besides `openid`.
    pub scopes: Vec<String>,
    /// What is made of claims.
    pub grants: Grants,
    /// How long a session holds.
    pub time: Duration,
}

impl fmt::Debug for SignInSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Without the secret.
        f.debug_struct("SignInSettings")
            .field("issuer", &self.issuer)
            .field("client", &self.client)
            .finish_non_exhaustive()
    }
}

/// Why nobody can sign in with these settings.
#[derive(Debug, thiserror::Error)]
pub enum SignInRefused {
    /// Not the address of a provider.
    #[error(
        "{0:?} is no address of a provider: give https://HOST/PATH as the provider names itself; http only on this machine"
    )]
    Issuer(String),
    /// The system has no certificates.
    #[error("requests to the provider cannot be made: {0}")]
    Client(#[from] reqwest::Error),
}

/// The way to sign in.
#[derive(Debug)]
pub struct SignIn {
    settings: SignInSettings,
    client: Client,
    /// What the provider has said of itself.
    provider: Mutex<Option<Arc<Provider>>>,
}

impl SignIn {
    /// A way to sign in. The provider is asked when the first comes.
    ///
    /// # Errors
    /// If the address is none, or no request can be made at all.
    pub fn new(settings: SignInSettings) -> Result<Self, SignInRefused> {
        if !is_safe(&settings.issuer) {
            return Err(SignInRefused::Issuer(settings.issuer));
        }
        // An error means that it was said already.
        let _ = rustls::crypto::ring::default_provider().install_default();
        signatures::install();
        let client = Client::builder()
            .redirect(reqwest::redirect::Policy::none())
            .connect_timeout(TIME / 2)
            .timeout(TIME)
            .user_agent(concat!("gable/", env!("CARGO_PKG_VERSION")))
            .build()?;
        Ok(Self { settings, client, provider: Mutex::new(None) })
    }

    /// The provider, as people know it: its host.
    pub(crate) fn name(&self) -> String {
        Url::parse(&self.settings.issuer).ok().and_then(|url| url.host_str().map(str::to_owned)).unwrap_or_default()
    }
}

/// Whether what is said to an address is said to its host alone: https, or http on this machine.
fn is_safe(address: &str) -> bool {
    let Ok(url) = Url::parse(address) else { return false };
    let local = matches!(url.host_str(), Some("localhost" | "127.0.0.1" | "[::1]"));
    let plain = url.username().is_empty() && url.password().is_none() && url.fragment().is_none();
    plain && (url.scheme() == "https" || url.scheme() == "http" && local)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn providers_are_asked_in_secret() {
        for good in
            ["https://id.example", "https://id.example/realms/city", "http://127.0.0.1:9", "http://localhost:9/x"]
        {
            assert!(is_safe(good), "{good}");
        }
        for bad in
            ["http://id.example", "id.example", "https://me:pw@id.example", "ftp://id.example", "https://id.example/#x"]
        {
            assert!(!is_safe(bad), "{bad}");
        }
    }
}
