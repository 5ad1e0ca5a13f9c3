//! What answers have in common: times, tags for polling, pages.

use crate::Problem;
use crate::shared::{Freshness, Shared};
use axum::body::Bytes;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;
use gable_job_store::Store;
use serde::Serialize;
use std::io::Write as _;
use std::sync::{Arc, OnceLock};

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

/// What is shown of a job as of one of its events, written and packed once for all who poll it.
#[derive(Clone, Debug)]
pub(crate) struct Snapshot(Arc<Written>);

#[derive(Debug)]
struct Written {
    event: i64,
    body: Bytes,
    packed: OnceLock<Option<Bytes>>,
}

impl Snapshot {
    fn new(event: i64, body: Vec<u8>) -> Self {
        Self(Arc::new(Written { event, body: body.into(), packed: OnceLock::new() }))
    }

    /// The answer with it.
    fn response(&self, headers: &HeaderMap) -> Response {
        const TYPE: (HeaderName, &str) = (header::CONTENT_TYPE, "application/json");
        if self.0.body.len() >= PACKED_FROM
            && takes_gzip(headers)
            && let Some(packed) = self.0.packed.get_or_init(|| packed(&self.0.body).ok())
        {
            let told = [TYPE, (header::CONTENT_ENCODING, "gzip"), (header::VARY, "accept-encoding")];
            return (told, packed.clone()).into_response();
        }
        ([TYPE], self.0.body.clone()).into_response()
    }
}

/// Smallest body that is worth packing, bytes.
const PACKED_FROM: usize = 1000;

fn packed(body: &[u8]) -> std::io::Result<Bytes> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::default());
    packer.write_all(body)?;
    Ok(packer.finish()?.into())
}

/// Whether a client can unpack gzip.
fn takes_gzip(headers: &HeaderMap) -> bool {
    let all =
        headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|v| v.to_str().ok()).flat_map(|v| v.split(','));
    let mut codings = all.map(|v| v.split_once(';').unwrap_or((v, "")));
    codings.any(|(name, weight)| {
        let weight = weight.trim().strip_prefix("q=").map_or(Ok(1.0), str::parse);
        name.trim().eq_ignore_ascii_case("gzip") && weight.is_ok_and(|q: f64| q > 0.0)
    })
}

/// What is shown of a job, or 304 if the client has it already. `make` is called when the job's last event has another number. Clients
/// that poll are answered from memory, by what was known a moment ago; but never by less than what they know.
pub(crate) async fn polled<V: Serialize, M: Future<Output = Result<V, Problem>>>(
    snapshots: &Shared<Snapshot>,
    store: &Store,
    job: &str,
    headers: &HeaderMap,
    make: impl Fn() -> M,
) -> Result<Response, Problem> {
    let ask = async |before: Option<Snapshot>| {
        // The number before the content: what changes between the two is then sent once more, not missed.
        let event = store.last_event(job).await?;
        match before.filter(|b| b.0.event == event) {
            Some(before) => Ok::<_, Problem>(before),
            None => Ok(Snapshot::new(event, json(&make().await?)?)),
        }
    };
    // Another coordinator may have told the client of later events than this one has heard of.
    let newest = tags(headers).filter_map(|tag| tag.trim_matches('"').parse::<i64>().ok()).max();
    let lately = match newest {
        Some(newest) => {
            let found = snapshots.get(job, Freshness::lately(store.writes()), &ask).await?;
            Some(found).filter(|found| found.0.event >= newest)
        }
        None => None,
    };
    let found = match lately {
        Some(found) => found,
        None => snapshots.get(job, Freshness::now(store.writes()), &ask).await?,
    };
    Ok(tagged(headers, &found.0.event.to_string(), || found.response(headers)))
}

/// The tags of what a client has.
fn tags(headers: &HeaderMap) -> impl Iterator<Item = &str> {
    let all = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|v| v.to_str().ok());
    all.flat_map(|v| v.split(',')).map(str::trim)
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
    let known = tags(headers).any(|v| v == tag || v == "*");
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
    fn bodies_are_packed_for_those_who_can_unpack_them() {
        let snapshot = Snapshot::new(1, vec![b' '; 5000]);
        let encoding = |accepted: &'static str| {
            let headers = HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_static(accepted))]);
            snapshot.response(&headers).headers().get(header::CONTENT_ENCODING).cloned()
        };
        for accepted in ["gzip", "br, gzip;q=0.5", "GZIP; q=1, identity"] {
            assert_eq!(encoding(accepted), Some(HeaderValue::from_static("gzip")), "{accepted}");
        }
        for accepted in ["br", "gzip;q=0", "br, gzip; q=0.0", "gzip;q=much"] {
            assert_eq!(encoding(accepted), None, "{accepted}");
        }
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
