//! What is asked of the provider: what it says of itself, its keys, an ID token for a code, and more claims.

use super::claims::Claims;
use super::discovery::{Provider, Said};
use super::signatures::SIGNED;
use super::{SignIn, is_safe};
use crate::pages::escaped;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use jsonwebtoken::jwk::{Jwk, JwkSet};
use jsonwebtoken::{DecodingKey, Validation, decode, decode_header};
use reqwest::RequestBuilder;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Why the provider could not say who somebody is.
#[derive(Debug, thiserror::Error)]
pub(super) enum ProviderFault {
    /// It does not answer.
    #[error("the provider does not answer: {0}")]
    Away(#[from] reqwest::Error),
    /// It answers with something else than is asked for.
    #[error("{what} of the provider: {why}")]
    Answer {
        /// What was asked for.
        what: &'static str,
        /// What is wrong with it.
        why: String,
    },
    /// The ID token does not hold.
    #[error("the ID token does not hold: {0}")]
    Token(String),
}

/// How long what a provider says of itself is believed, and how soon it may be asked again.
const BELIEVED: Duration = Duration::from_secs(3600);
const AGAIN: Duration = Duration::from_secs(10);

/// Largest answer that is read, bytes.
const LARGEST: usize = 1 << 20;

/// By how much the clocks of provider and service may differ, seconds.
const LEEWAY: u64 = 60;

/// What is given for a code.
#[derive(Deserialize)]
struct Tokens {
    id_token: String,
    access_token: Option<String>,
}

impl SignIn {
    /// The provider; asked again from time to time, and when it may have new keys.
    pub(super) async fn provider(&self, new_keys: bool) -> Result<Arc<Provider>, ProviderFault> {
        let mut known = self.provider.lock().await;
        let most = if new_keys { AGAIN } else { BELIEVED };
        if let Some(provider) = known.as_ref().filter(|provider| provider.asked.elapsed() < most) {
            return Ok(Arc::clone(provider));
        }
        let issuer = &self.settings.issuer;
        let place = format!("{}/.well-known/openid-configuration", issuer.trim_end_matches('/'));
        let what = "the description";
        let said: Said = read(self.client.get(&place), what).await?;
        if said.issuer != *issuer {
            let why = format!("it calls itself {:?}: give that as --oidc-issuer, not {issuer:?}", said.issuer);
            return Err(ProviderFault::Answer { what, why });
        }
        let places = [&said.authorization_endpoint, &said.token_endpoint, &said.jwks_uri];
        if let Some(open) = places.into_iter().chain(&said.userinfo_endpoint).find(|place| !is_safe(place)) {
            return Err(ProviderFault::Answer { what, why: format!("it names {open:?}, which is not https") });
        }
        let keys = read(self.client.get(&said.jwks_uri), "the keys").await?;
        let provider = Arc::new(Provider { said, keys, asked: Instant::now() });
        *known = Some(Arc::clone(&provider));
        Ok(provider)
    }

    /// The claims about whoever has been given a code.
    pub(super) async fn claims(
        &self,
        code: &str,
        redirect: &str,
        verifier: &str,
        nonce: &str,
    ) -> Result<Claims, ProviderFault> {
        let provider = self.provider(false).await?;
        let tokens = self.exchange(&provider.said, code, redirect, verifier).await?;
        let mut claims = self.checked(provider, &tokens.id_token, nonce).await?;
        if !self.settings.grants.are_told_by(&claims)
            && let Some(access) = &tokens.access_token
            && let Some(place) = &self.provider(false).await?.said.userinfo_endpoint
        {
            let more: Claims = read(self.client.get(place).bearer_auth(access), "what it knows of somebody").await?;
            if more.get("sub") != claims.get("sub") {
                return Err(ProviderFault::Token("the provider tells of somebody else".to_owned()));
            }
            // What is signed counts.
            for (name, value) in more {
                claims.entry(name).or_insert(value);
            }
        }
        Ok(claims)
    }

    /// Changes a code for tokens.
    async fn exchange(&self, said: &Said, code: &str, redirect: &str, verifier: &str) -> Result<Tokens, ProviderFault> {
        let client = &self.settings.client;
        let mut form = vec![
            ("grant_type", "authorization_code"),
            ("code", code),
            ("redirect_uri", redirect),
            ("code_verifier", verifier),
            ("client_id", client),
        ];
        let mut request = self.client.post(&said.token_endpoint);
        if let Some(secret) = &self.settings.secret {
            let methods = &said.token_endpoint_auth_methods_supported;
            let by_header = methods.is_empty() || methods.iter().any(|method| method == "client_secret_basic");
            if by_header {
                let shown = STANDARD.encode(format!("{}:{}", escaped(client), escaped(secret)));
                request = request.header("authorization", format!("Basic {shown}"));
            } else {
                form.push(("client_secret", secret));
            }
        }
        let body: Vec<String> = form.iter().map(|(name, value)| format!("{name}={}", escaped(value))).collect();
        let request = request.header("content-type", "application/x-www-form-urlencoded").body(body.join("&"));
        read(request.header("accept", "application/json"), "the answer to a code").await
    }

    /// The claims of an ID token that holds.
    async fn checked(&self, provider: Arc<Provider>, token: &str, nonce: &str) -> Result<Claims, ProviderFault> {
        let fault = |why: &str| ProviderFault::Token(why.to_owned());
        let header = decode_header(token).map_err(|e| ProviderFault::Token(e.to_string()))?;
        if !SIGNED.contains(&header.alg) {
            return Err(ProviderFault::Token(format!("it is signed by {:?}, which is not taken", header.alg)));
        }
        let key = match key(&provider.keys, header.kid.as_deref()) {
            Some(key) => key,
            None => {
                let again = self.provider(true).await?;
                key(&again.keys, header.kid.as_deref())
                    .ok_or_else(|| fault("the provider does not have the key that it names"))?
            }
        };
        let key = DecodingKey::from_jwk(&key).map_err(|e| ProviderFault::Token(e.to_string()))?;
        let mut validation = Validation::new(header.alg);
        validation.leeway = LEEWAY;
        validation.validate_nbf = true;
        validation.set_issuer(&[&self.settings.issuer]);
        validation.set_audience(&[&self.settings.client]);
        validation.set_required_spec_claims(&["exp", "iss", "aud", "sub"]);
        let claims: Claims = decode(token, &key, &validation).map_err(|e| ProviderFault::Token(e.to_string()))?.claims;
        if claims.get("nonce").and_then(Value::as_str) != Some(nonce) {
            return Err(fault("it was not made for this login (nonce)"));
        }
        // Made for several, it has to say for whom.
        let several = claims.get("aud").and_then(Value::as_array).is_some_and(|all| all.len() > 1);
        let party = claims.get("azp").and_then(Value::as_str);
        if party.map_or(several, |party| party != self.settings.client) {
            return Err(fault("it was made for another service (azp)"));
        }
        Ok(claims)
    }
}

/// The key of this name; without a name, the only one.
fn key(keys: &JwkSet, name: Option<&str>) -> Option<Jwk> {
    match (name, keys.keys.as_slice()) {
        (Some(name), _) => keys.find(name).cloned(),
        (None, [only]) => Some(only.clone()),
        (None, _) => None,
    }
}

/// The answer to a request, as JSON.
async fn read<T: DeserializeOwned>(request: RequestBuilder, what: &'static str) -> Result<T, ProviderFault> {
    let wrong = |why: String| ProviderFault::Answer { what, why };
    let mut answer = request.send().await?;
    let status = answer.status();
    let mut body = Vec::new();
    while let Some(piece) = answer.chunk().await? {
        body.extend_from_slice(&piece);
        if body.len() > LARGEST {
            return Err(wrong(format!("it has more than {LARGEST} bytes")));
        }
    }
    if !status.is_success() {
        // RFC 6749, 5.2: the kind of the fault, which is no secret.
        let said = serde_json::from_slice::<Value>(&body).ok();
        let kind = said.as_ref().and_then(|said| said.get("error")).and_then(Value::as_str).unwrap_or_default();
        return Err(wrong(format!("{status} {kind:?}")));
    }
    serde_json::from_slice(&body).map_err(|e| wrong(e.to_string()))
}
