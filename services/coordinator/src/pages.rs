//! What answers have in common: times, tags for polling, pages.

use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// A time as RFC 3339, from milliseconds since 1970.
pub(crate) fn time(milliseconds: i64) -> String {
    jiff::Timestamp::from_millisecond(milliseconds).map(|t| t.to_string()).unwrap_or_default()
}

/// The body, or 304 if the client has this state already. `state` changes whenever the body does.
pub(crate) fn tagged(headers: &HeaderMap, state: &str, body: impl FnOnce() -> Response) -> Response {
    let tag = format!("\"{state}\"");
    let known = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|v| v.to_str().ok());
    let known = known.flat_map(|v| v.split(',')).any(|v| matches!(v.trim(), v if v == tag || v == "*"));
    let mut response = if known { StatusCode::NOT_MODIFIED.into_response() } else { body() };
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        response.headers_mut().insert(header::ETAG, tag);
    }
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_rfc_3339() {
        assert_eq!(time(0), "1970-01-01T00:00:00Z");
        assert_eq!(time(1_795_000_000_123), "2026-11-18T11:06:40.123Z");
    }

    #[test]
    fn a_known_state_is_not_sent_again() {
        let mut headers = HeaderMap::new();
        let body = || "body".into_response();
        assert_eq!(tagged(&headers, "7", body).status(), StatusCode::OK);
        headers.insert(header::IF_NONE_MATCH, HeaderValue::from_static("\"6\", \"7\""));
        let same = tagged(&headers, "7", body);
        assert_eq!(same.status(), StatusCode::NOT_MODIFIED);
        assert_eq!(same.headers()[header::ETAG], "\"7\"");
        assert_eq!(tagged(&headers, "8", body).status(), StatusCode::OK);
    }
}
