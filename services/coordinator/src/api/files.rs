//! What a job made: the files of its result.

use crate::pages::tagged;
use crate::problem::Refused;
use crate::rights::OfJob;
use crate::{Coordinator, Problem};
use axum::Json;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::Artifact;
use serde::Serialize;
use utoipa::ToSchema;

/// Artefacts under this path are for users; others are for later stages.
const RESULT: &str = "result/";

/// A file of a job's result.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct FileView {
    /// Path within the result.
    #[schema(example = "tiles/3_7.city.json")]
    path: String,
    /// Size.
    bytes: u64,
    /// BLAKE3 hash of its content, hexadecimal.
    hash: String,
}

impl FileView {
    pub(super) fn of(artifact: &Artifact) -> Self {
        Self { path: artifact.path.clone(), bytes: artifact.bytes, hash: artifact.blob.to_string() }
    }
}

/// The files of a job's result
#[utoipa::path(
    get, path = "/jobs/{id}/files", tag = "results",
    params(("id" = String, Path, description = "Id of the job")),
    responses(
        (status = 200, description = "The files, by path", body = Vec<FileView>),
        Refused<404>,
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: OfJob,
    Path(id): Path<String>,
) -> Result<Json<Vec<FileView>>, Problem> {
    Ok(Json(listed(&service, &id, "").await?.iter().map(FileView::of).collect()))
}

/// A file of a job's result
///
/// `Range: bytes=…` gives a part of it.
#[utoipa::path(
    get, path = "/jobs/{id}/files/{*path}", tag = "results",
    params(
        ("id" = String, Path, description = "Id of the job"),
        ("path" = String, Path, description = "Path within the result, as the list of files has it"),
    ),
    responses(
        (status = 200, description = "Its content", content_type = "*/*"),
        (status = 206, description = "A part of it", content_type = "*/*"),
        (status = 304, description = "Nothing new"),
        Refused<404>,
        Refused<416>,
    )
)]
pub(crate) async fn content(
    State(service): State<Coordinator>,
    _: OfJob,
    headers: HeaderMap,
    Path((id, path)): Path<(String, String)>,
) -> Result<Response, Problem> {
    let file = named(&service, &id, &path).await?;
    send(&service, &headers, &path, &file).await
}

/// The files of a job's result whose paths begin with this; paths are within the result.
pub(super) async fn listed(service: &Coordinator, id: &str, prefix: &str) -> Result<Vec<Artifact>, Problem> {
    service.store.job(id).await?;
    let found = service.store.artifacts(id, &format!("{RESULT}{prefix}")).await?;
    Ok(found.into_iter().map(|a| Artifact { path: a.path[RESULT.len()..].to_owned(), ..a }).collect())
}

/// A file of a job's result, by its path within the result.
pub(super) async fn named(service: &Coordinator, id: &str, path: &str) -> Result<Artifact, Problem> {
    service.store.job(id).await?;
    let full = format!("{RESULT}{path}");
    // A folder gives what is in it.
    let found = service.store.artifacts_at(id, std::slice::from_ref(&full)).await?.into_iter().find(|a| a.path == full);
    found.ok_or_else(|| Problem::not_found(format!("job {id} has no file {path:?}")))
}

/// The content of a file, or the part of it that is asked for.
pub(super) async fn send(
    service: &Coordinator,
    headers: &HeaderMap,
    path: &str,
    file: &Artifact,
) -> Result<Response, Problem> {
    let part = match headers.get(header::RANGE).map(|v| range(v.to_str().unwrap_or_default(), file.bytes)) {
        None | Some(Range::Whole) => None,
        Some(Range::Part(first, last)) => Some((first, last)),
        Some(Range::Outside) => {
            let detail = format!("the file has {} bytes", file.bytes);
            let problem = Problem::new(StatusCode::RANGE_NOT_SATISFIABLE, "range", "The file has no such part", detail);
            let mut response = problem.into_response();
            if let Ok(v) = HeaderValue::from_str(&format!("bytes */{}", file.bytes)) {
                response.headers_mut().insert(header::CONTENT_RANGE, v);
            }
            return Ok(response);
        }
    };
    let state = file.blob.to_string();
    let known = tagged(headers, &state, || StatusCode::OK.into_response());
    if known.status() == StatusCode::NOT_MODIFIED {
        return Ok(known);
    }
    let (status, length, pieces) = match part {
        None => (StatusCode::OK, file.bytes, service.blobs.stream(file.blob).await?),
        Some((first, last)) => {
            let pieces = service.blobs.part(file.blob, first..last + 1).await?;
            (StatusCode::PARTIAL_CONTENT, last + 1 - first, pieces)
        }
    };
    // What goes wrong on the way cuts the answer off, which the client sees by its length.
    let mut response = (status, Body::from_stream(pieces)).into_response();
    let fields = response.headers_mut();
    fields.insert(header::CONTENT_LENGTH, length.into());
    fields.insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type(path)));
    fields.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(crate::headers::RESULT));
    fields.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    if let Some((first, last)) = part
        && let Ok(v) = HeaderValue::from_str(&format!("bytes {first}-{last}/{}", file.bytes))
    {
        fields.insert(header::CONTENT_RANGE, v);
    }
    for name in [header::ETAG, header::CACHE_CONTROL] {
        fields.extend(known.headers().get(&name).map(|v| (name, v.clone())));
    }
    Ok(response)
}

/// What a range asks for.
#[derive(Debug, PartialEq, Eq)]
enum Range {
    /// The whole content: a range that is not understood, or of several parts, is not heeded.
    Whole,
    /// First and last byte.
    Part(u64, u64),
    /// Nothing of the content.
    Outside,
}

fn range(text: &str, size: u64) -> Range {
    let Some((first, last)) = text.strip_prefix("bytes=").and_then(|t| t.trim().split_once('-')) else {
        return Range::Whole;
    };
    match (first.parse::<u64>(), last.parse::<u64>()) {
        (Ok(first), _) if first >= size => Range::Outside,
        (Ok(first), Ok(last)) if first <= last => Range::Part(first, last.min(size - 1)),
        (Ok(first), Err(_)) if last.is_empty() => Range::Part(first, size - 1),
        (Err(_), Ok(0)) if first.is_empty() => Range::Outside,
        (Err(_), Ok(tail)) if first.is_empty() && size > 0 => Range::Part(size.saturating_sub(tail), size - 1),
        (Err(_), Ok(_)) if first.is_empty() => Range::Outside,
        _ => Range::Whole,
    }
}

fn media_type(path: &str) -> &'static str {
    match path.rsplit_once('.').map_or("", |(_, end)| end) {
        "json" => "application/json",
        "jsonl" => "application/json-seq",
        "gml" => "application/gml+xml",
        "html" => "text/html; charset=utf-8",
        "glb" => "model/gltf-binary",
        "png" => "image/png",
        "svg" => "image/svg+xml",
        "jpg" => "image/jpeg",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_as_the_standard_says() {
        assert_eq!(range("bytes=0-3", 10), Range::Part(0, 3));
        assert_eq!(range("bytes=4-", 10), Range::Part(4, 9));
        assert_eq!(range("bytes=-3", 10), Range::Part(7, 9));
        assert_eq!(range("bytes=-30", 10), Range::Part(0, 9));
        assert_eq!(range("bytes=8-99", 10), Range::Part(8, 9));
        assert_eq!(range("bytes=10-", 10), Range::Outside);
        assert_eq!(range("bytes=-0", 10), Range::Outside);
        assert_eq!(range("bytes=0-", 0), Range::Outside);
        assert_eq!(range("bytes=-1", 0), Range::Outside);
        for odd in ["bytes=3-2", "bytes=1-2,4-5", "lines=1-2", "bytes=a-b", ""] {
            assert_eq!(range(odd, 10), Range::Whole, "{odd}");
        }
    }
}
