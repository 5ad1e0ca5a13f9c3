//! What a provider says of itself, and its keys.

use jsonwebtoken::jwk::JwkSet;
use serde::Deserialize;
use std::time::Instant;

/// What a provider says of itself.
#[derive(Debug)]
pub(super) struct Provider {
    pub(super) said: Said,
    pub(super) keys: JwkSet,
    pub(super) asked: Instant,
}

/// OpenID Connect Discovery 1.0.
#[derive(Debug, Deserialize)]
pub(super) struct Said {
    pub(super) issuer: String,
    pub(super) authorization_endpoint: String,
    pub(super) token_endpoint: String,
    pub(super) jwks_uri: String,
    pub(super) userinfo_endpoint: Option<String>,
    #[serde(default)]
    pub(super) token_endpoint_auth_methods_supported: Vec<String>,
}
