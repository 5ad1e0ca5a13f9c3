//! Errors as `application/problem+json` (RFC 9457).

use axum::Json;
use axum::extract::rejection::{JsonRejection, QueryRejection};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::JobStoreError;
use serde::Serialize;
use utoipa::ToSchema;

/// What went wrong with a request, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct Problem {
    /// Kind of the problem; a name that programs can tell apart.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// The same in words.
    pub title: &'static str,
    /// HTTP status.
    pub status: u16,
    /// What is wrong with this request.
    pub detail: String,
}

impl Problem {
    pub(crate) fn new(status: StatusCode, kind: &'static str, title: &'static str, detail: impl Into<String>) -> Self {
        Self { kind, title, status: status.as_u16(), detail: detail.into() }
    }

    pub(crate) fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, "not-found", "There is no such thing", detail)
    }

    pub(crate) fn invalid(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "invalid", "The request cannot be carried out", detail)
    }

    pub(crate) fn unauthorised(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNAUTHORIZED, "unauthorised", "A valid token is needed", detail)
    }

    pub(crate) fn forbidden(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, "forbidden", "The token does not allow this", detail)
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = (status, Json(self)).into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        if status == StatusCode::SERVICE_UNAVAILABLE {
            headers.insert(header::RETRY_AFTER, HeaderValue::from_static("5"));
        }
        response
    }
}

impl From<JobStoreError> for Problem {
    fn from(error: JobStoreError) -> Self {
        let detail = error.to_string();
        match error {
            JobStoreError::NoJob(_) => Self::not_found(detail),
            JobStoreError::State { .. } => {
                Self::new(StatusCode::CONFLICT, "state", "The job's state does not allow this", detail)
            }
            JobStoreError::KeyReused { .. } => {
                Self::new(StatusCode::CONFLICT, "key-reused", "The idempotency key was used before", detail)
            }
            other => {
                // The cause is for the log: it may hold addresses.
                tracing::error!(error = %other, "the job store failed");
                if other.is_transient() {
                    let detail = "the database or the object store does not answer: try again";
                    Self::new(StatusCode::SERVICE_UNAVAILABLE, "unavailable", "The service is not ready", detail)
                } else {
                    let detail = "this is a fault of the service; its log tells more";
                    Self::new(StatusCode::INTERNAL_SERVER_ERROR, "internal", "The service failed", detail)
                }
            }
        }
    }
}

impl From<JsonRejection> for Problem {
    fn from(rejection: JsonRejection) -> Self {
        Self::new(rejection.status(), "body", "The body cannot be read", rejection.body_text())
    }
}

impl From<QueryRejection> for Problem {
    fn from(rejection: QueryRejection) -> Self {
        Self::new(rejection.status(), "query", "The query cannot be read", rejection.body_text())
    }
}
