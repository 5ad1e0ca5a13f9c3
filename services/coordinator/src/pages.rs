//! What answers have in common: times, tags for polling, pages.

use crate::Problem;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// A time as RFC 3339, from milliseconds since 1970.
#[must_use]
pub fn time(milliseconds: i64) -> String {
    jiff::Timestamp::from_millisecond(milliseconds).map(|t| t.to_string()).unwrap_or_default()
}

/// A text as a part of a path or a query.
#[must_use]
pub fn escaped(text: &str) -> String {
    text.bytes().fold(String::new(), |mut escaped, byte| {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            escaped.push(char::from(byte));
        } else {
            escaped += &format!("%{byte:02X}");
        }
        escaped
    })
}

/// Entries on a page if the request does not say.
const PAGE: i64 = 100;

/// The number of entries that a page is to have.
pub(crate) fn limit(wanted: Option<i64>, most: i64) -> Result<i64, Problem> {
    let limit = wanted.unwrap_or(PAGE.min(most));
    if (1..=most).contains(&limit) { Ok(limit) } else { Err(Problem::query(format!("limit has to be 1 to {most}"))) }
}

/// Cuts a list, of which one entry more than the limit was asked for, to a page; gives what `next` says of its last entry if
/// others follow.
pub(crate) fn cut<T, N>(list: &mut Vec<T>, limit: i64, next: impl Fn(&T) -> N) -> Option<N> {
    let limit = usize::try_from(limit).unwrap_or(usize::MAX);
    let more = list.len() > limit;
    list.truncate(limit);
    list.last().filter(|_| more).map(next)
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
