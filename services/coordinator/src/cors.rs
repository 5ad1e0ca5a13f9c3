//! Pages of other sites: none may use the service, unless the operator names its site.

use axum::http::{HeaderName, HeaderValue, Method, header};
use std::time::Duration;
use tower_http::cors::{AllowOrigin, CorsLayer};

/// A site, as browsers name it in the header `Origin`.
pub type Origin = HeaderValue;

/// How long a browser remembers what it may ask.
const REMEMBERED: Duration = Duration::from_secs(3600);

/// An origin such as `https://viewer.example`, as browsers send it.
///
/// # Errors
/// Says what is wrong with it, if it is none.
pub fn checked_origin(text: &str) -> Result<Origin, String> {
    let host = text.strip_prefix("https://").or_else(|| text.strip_prefix("http://"));
    let plain = |host: &str| {
        !host.is_empty() && host.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || ".-:[]".contains(c))
    };
    let right = host.is_some_and(plain);
    let value = HeaderValue::from_str(text).ok().filter(|_| right);
    value.ok_or_else(|| {
        "give an origin as browsers send it: https://HOST or https://HOST:PORT, in small letters, without a path"
            .to_owned()
    })
}

/// Answers browsers that ask whether pages of these origins may use the service. Tokens are in a header that such a page has to know, so
/// nothing that a browser keeps by itself is sent.
pub(crate) fn layer(origins: &[HeaderValue]) -> CorsLayer {
    CorsLayer::new()
        .allow_origin(AllowOrigin::list(origins.iter().cloned()))
        .allow_methods([Method::GET, Method::HEAD, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers([
            header::AUTHORIZATION,
            header::CONTENT_TYPE,
            header::RANGE,
            header::IF_NONE_MATCH,
            HeaderName::from_static("content-digest"),
            HeaderName::from_static("idempotency-key"),
            HeaderName::from_static("last-event-id"),
        ])
        .expose_headers([
            header::ETAG,
            header::LOCATION,
            header::CONTENT_RANGE,
            header::ACCEPT_RANGES,
            header::RETRY_AFTER,
        ])
        .max_age(REMEMBERED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_are_as_browsers_send_them() {
        for good in ["https://viewer.example", "http://localhost:3000", "https://[::1]:8443"] {
            assert!(checked_origin(good).is_ok(), "{good}");
        }
        for bad in
            ["*", "viewer.example", "https://viewer.example/", "https://", "null", "https://A.example", "https://a b"]
        {
            assert!(checked_origin(bad).is_err(), "{bad}");
        }
    }
}
