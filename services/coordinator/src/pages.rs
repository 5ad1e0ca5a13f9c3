//! What answers have in common: times, tags for polling, pages.

use crate::Problem;
use crate::shared::Shared;
use axum::body::Bytes;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::Store;
use serde::Serialize;

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

/// Makes a page of a list, of which one entry more than the limit was asked for: what is shown of each entry, and what `next`
/// says of the last one if others follow.
pub(crate) fn page<T, V, N>(
    mut list: Vec<T>,
    limit: i64,
    next: impl Fn(&T) -> N,
    view: impl FnMut(T) -> V,
) -> (Vec<V>, Option<N>) {
    let next = cut(&mut list, limit, next);
    (list.into_iter().map(view).collect(), next)
}

/// Cuts a list, of which one entry more than the limit was asked for, to a page; gives what `next` says of its last entry if
/// others follow.
pub(crate) fn cut<T, N>(list: &mut Vec<T>, limit: i64, next: impl Fn(&T) -> N) -> Option<N> {
    let limit = usize::try_from(limit).unwrap_or(usize::MAX);
    let more = list.len() > limit;
    list.truncate(limit);
    list.last().filter(|_| more).map(next)
}

/// The answer to the removal of a thing that was there, or was not.
pub(crate) fn removed(was_there: bool, none: impl FnOnce() -> Problem) -> Result<StatusCode, Problem> {
    if was_there { Ok(StatusCode::NO_CONTENT) } else { Err(none()) }
}

/// What is shown of a job as of one of its events, written once for all who poll it.
#[derive(Clone, Debug)]
pub(crate) struct Snapshot {
    event: i64,
    body: Bytes,
}

/// What is shown of a job, or 304 if the client has it already. However many poll, the database is asked for the number of the
/// job's last event by one of them at a time, and `make` is called when it has changed.
pub(crate) async fn polled<V: Serialize, M: Future<Output = Result<V, Problem>>>(
    snapshots: &Shared<Snapshot>,
    store: &Store,
    job: &str,
    headers: &HeaderMap,
    make: impl FnOnce() -> M,
) -> Result<Response, Problem> {
    let found = snapshots.get(job, |before| async move {
        // The number before the content: what changes between the two is then sent once more, not missed.
        let event = store.last_event(job).await?;
        match before.filter(|b: &Snapshot| b.event == event) {
            Some(before) => Ok::<_, Problem>(before),
            None => Ok(Snapshot { event, body: Bytes::from(json(&make().await?)?) }),
        }
    });
    let found = found.await?;
    let body = || ([(header::CONTENT_TYPE, "application/json")], found.body.clone()).into_response();
    Ok(tagged(headers, &found.event.to_string(), body))
}

fn json(value: &impl Serialize) -> Result<Vec<u8>, Problem> {
    serde_json::to_vec(value).map_err(|e| {
        tracing::error!("an answer cannot be written as JSON: {e}");
        let detail = "this is a fault of the service; its log tells more";
        Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "internal", "The service failed", detail)
    })
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
