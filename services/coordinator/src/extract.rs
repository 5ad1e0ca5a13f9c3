//! Queries and bodies of requests, whose refusals are problems as all others.

use crate::{Coordinator, Problem};
use axum::body::Bytes;
use axum::extract::rejection::{JsonRejection, QueryRejection};
use axum::extract::{DefaultBodyLimit, FromRequest, FromRequestParts, Request};
use axum::http::request::Parts;
use axum::http::{StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::de::DeserializeOwned;
use serde_json::Value;

/// What stands behind the `?` of an address.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query<T>(pub(crate) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Query<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let read: Result<axum::extract::Query<T>, QueryRejection> =
            axum::extract::Query::from_request_parts(parts, state).await;
        Ok(Self(read?.0))
    }
}

/// A body that is JSON. It is of a limited size, and comes within a limited time, whatever route it is sent to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body<T>(pub(crate) T);

impl<T: DeserializeOwned> FromRequest<Coordinator> for Body<T> {
    type Rejection = Problem;

    async fn from_request(mut request: Request, service: &Coordinator) -> Result<Self, Problem> {
        // What is no JSON is refused unread.
        let kind = request.headers().get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or_default();
        let kind = kind.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
        if kind != "application/json" && !(kind.starts_with("application/") && kind.ends_with("+json")) {
            let detail = "send the header Content-Type: application/json";
            return Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "body", "The body cannot be read", detail));
        }
        DefaultBodyLimit::max(service.limits.body).apply(&mut request);
        let reading = tokio::time::timeout(service.limits.time, Bytes::from_request(request, service));
        let bytes = reading.await.map_err(|_| too_slow(service))?.map_err(JsonRejection::from)?;
        if has_nul(&bytes) {
            return Err(nul());
        }
        let read: Result<axum::Json<T>, JsonRejection> = axum::Json::from_bytes(&bytes);
        Ok(Self(read?.0))
    }
}

fn too_slow(service: &Coordinator) -> Problem {
    let detail = format!("the body did not come within {} s", service.limits.time.as_secs_f64());
    Problem::new(StatusCode::REQUEST_TIMEOUT, "timeout", "The request took too long", detail)
}

fn nul() -> Problem {
    let detail = "a text has the character NUL in it, which means nothing here and cannot be kept";
    Problem::new(StatusCode::BAD_REQUEST, "nul", "The request has NUL in it", detail)
}

/// Whether a text in a JSON document has NUL in it, which Postgres cannot keep. As itself it is no JSON, so it is escaped.
fn has_nul(json: &Bytes) -> bool {
    const ESCAPED: &[u8] = br"\u0000";
    // Most have none, and it may stand there as a backslash and `u0000`.
    json.windows(ESCAPED.len()).any(|part| part == ESCAPED)
        && serde_json::from_slice::<Value>(json).is_ok_and(|value| holds_nul(&value))
}

fn holds_nul(value: &Value) -> bool {
    match value {
        Value::String(text) => text.contains('\0'),
        Value::Array(items) => items.iter().any(holds_nul),
        Value::Object(members) => members.iter().any(|(name, value)| name.contains('\0') || holds_nul(value)),
        Value::Null | Value::Bool(_) | Value::Number(_) => false,
    }
}

/// Refuses addresses with NUL in them.
pub(crate) async fn without_nul(request: Request, next: Next) -> Response {
    let address = request.uri().path_and_query().map_or("", |address| address.as_str());
    if address.contains("%00") {
        return nul().into_response();
    }
    next.run(request).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nul_is_found_wherever_it_stands() {
        let found = |text: &str| has_nul(&Bytes::copy_from_slice(text.as_bytes()));
        for text in [r#"{"a":"x\u0000"}"#, r#"{"a":[{"b\u0000":1}]}"#, r#"["\\\u0000"]"#] {
            assert!(found(text), "{text}");
        }
        for text in [r#"{"a":"x\\u0000"}"#, r#"{"a":"\u00000"#, r#"{"a":"u0000"}"#, ""] {
            assert!(!found(text), "{text}");
        }
    }
}
