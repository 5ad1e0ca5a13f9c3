//! Errors as `application/problem+json` (RFC 9457).

use axum::Json;
use axum::extract::rejection::{JsonRejection, QueryRejection};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::JobStoreError;
use serde::Serialize;
use std::collections::BTreeMap;
use utoipa::openapi::{ContentBuilder, Ref, RefOr, ResponseBuilder};
use utoipa::{IntoResponses, ToSchema};

/// Media type of a [`Problem`].
const MEDIA_TYPE: &str = "application/problem+json";

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

    /// A source that the service cannot read.
    pub(crate) fn source(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "source", "The source cannot be read", detail)
    }

    pub(crate) fn query(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, "query", "The query cannot be read", detail)
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
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
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
            JobStoreError::Quota { .. } => {
                Self::new(StatusCode::TOO_MANY_REQUESTS, "quota", "Too many jobs under way", detail)
            }
            JobStoreError::OpenUploads { .. } => {
                Self::new(StatusCode::TOO_MANY_REQUESTS, "quota", "Too many uploads under way", detail)
            }
            JobStoreError::UploadBytes { .. } => {
                Self::new(StatusCode::PAYLOAD_TOO_LARGE, "quota", "The token may keep no more", detail)
            }
            JobStoreError::NotAnEditor { .. } => Self::forbidden(detail),
            JobStoreError::LastOwner { .. } => {
                Self::new(StatusCode::CONFLICT, "owner", "A city has to have an owner", detail)
            }
            JobStoreError::Current { .. } | JobStoreError::InUse { .. } => {
                Self::new(StatusCode::CONFLICT, "in-use", "It is in use", detail)
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

/// What any operation may answer, whatever it does.
pub(crate) fn refused_anyway() -> BTreeMap<String, RefOr<utoipa::openapi::Response>> {
    let all = [
        Refused::<400>::responses(),
        Refused::<401>::responses(),
        Refused::<403>::responses(),
        Refused::<408>::responses(),
        Refused::<500>::responses(),
        Refused::<503>::responses(),
    ];
    all.into_iter().flatten().collect()
}

/// A refusal with this status, for the description of an operation.
pub(crate) struct Refused<const STATUS: u16>;

impl<const STATUS: u16> IntoResponses for Refused<STATUS> {
    fn responses() -> BTreeMap<String, RefOr<utoipa::openapi::Response>> {
        let description = match STATUS {
            400 => "The path, the query or the body cannot be read",
            401 => "No valid token",
            403 => "The token does not allow it",
            404 => "There is no such thing",
            406 => "It cannot be had in this form",
            408 => "It took too long",
            409 => "The present state does not allow it",
            413 => "The body is too large",
            415 => "The body is not said to be JSON",
            416 => "The file has no such part",
            422 => "What is asked for cannot be done",
            429 => "Too many jobs or uploads under way",
            503 => "The database or the object store does not answer",
            _ => "A fault of the service",
        };
        let content = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).build();
        let response = ResponseBuilder::new().description(description).content(MEDIA_TYPE, content).build();
        BTreeMap::from([(STATUS.to_string(), response.into())])
    }
}

/// Refusals that come from below the handlers, such as that of a body that is too large, get the form of all others.
pub(crate) async fn in_one_form(response: Response) -> Response {
    let status = response.status();
    let told = response.headers().get(header::CONTENT_TYPE).is_some_and(|t| t == MEDIA_TYPE);
    if told || !(status.is_client_error() || status.is_server_error()) {
        return response;
    }
    let (kind, title, detail) = match status {
        StatusCode::BAD_REQUEST => ("path", "The path cannot be read", "what is escaped by % has to be UTF-8"),
        StatusCode::REQUEST_TIMEOUT => ("timeout", "The request took too long", "ask for less, or try again"),
        StatusCode::PAYLOAD_TOO_LARGE => ("body", "The body is too large", "this service takes no body of this size"),
        StatusCode::NOT_FOUND => ("not-found", "There is no such thing", "/docs lists all addresses"),
        _ => ("refused", "The request was refused", status.canonical_reason().unwrap_or_default()),
    };
    Problem::new(status, kind, title, detail).into_response()
}
