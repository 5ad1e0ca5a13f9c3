//! Uploads in parts: a mesh is sent piece by piece, so that a connection that breaks costs one piece.
//!
//! A client opens an upload, puts parts 1, 2, … in any order, and completes it with the list of them. What has come is listed at any
//! time, so a client that was cut off, or started anew, sends what is missing. Each part may come with its SHA-256.

use super::uploads::{checked_name, hold, may_send_for, no_room, quota};
use crate::extract::Body as JsonBody;
use crate::pages::{removed, time};
use crate::problem::Refused;
use crate::receiving::{Allowed, store_body};
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use gable_job_store::{BlobId, OpenUpload, Scope, UploadPart};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::io::Read as _;
use std::path::Path as FilePath;
use utoipa::ToSchema;

/// Most parts of an upload.
const PARTS: i64 = 10_000;

/// Largest part, bytes.
const LARGEST: u64 = 64 << 20;

/// What a client is told to take for a part, bytes.
const USUAL: u64 = 16 << 20;

/// Uploads on a page.
const PAGE: i64 = 1000;

/// An upload to be begun.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewOpenUpload {
    /// Name of the file: a .zip of a folder of tiles, or a mesh in one file (.ply, .off, .glb, .obj).
    #[schema(min_length = 5, max_length = 200, example = "delft.zip")]
    name: String,
    /// The city whose editors may use it as a source; if not given, only who sends it may.
    #[serde(default)]
    #[schema(max_length = 200)]
    city: Option<String>,
}

/// An upload in parts.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct OpenUploadView {
    id: String,
    /// Who sends it.
    owner: String,
    /// The city whose editors may use what it becomes.
    #[serde(skip_serializing_if = "Option::is_none")]
    city: Option<String>,
    name: String,
    created: String,
    /// When it is forgotten if nothing comes.
    expires: String,
    /// open, completing, done or failed.
    #[schema(example = "open")]
    state: &'static str,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<String>,
    /// A good size of a part, bytes.
    part_bytes: u64,
    /// Largest part, bytes.
    largest_part_bytes: u64,
    /// What has come so far, by number.
    parts: Vec<PartView>,
}

/// A part.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PartView {
    number: i64,
    bytes: u64,
    /// Hexadecimal.
    sha256: String,
}

impl OpenUploadView {
    fn of(open: OpenUpload, parts: Vec<UploadPart>) -> Self {
        let state = match (&open.upload, &open.problem, open.held) {
            (Some(_), ..) => "done",
            (_, Some(_), _) => "failed",
            (.., true) => "completing",
            _ => "open",
        };
        Self {
            id: open.id,
            owner: open.owner,
            city: open.city,
            name: open.name,
            created: time(open.created),
            expires: time(open.expires),
            state,
            problem: open.problem,
            part_bytes: USUAL,
            largest_part_bytes: LARGEST,
            parts: parts.into_iter().map(PartView::of).collect(),
        }
    }
}

impl PartView {
    fn of(part: UploadPart) -> Self {
        Self { number: part.number, bytes: part.bytes, sha256: part.sha256 }
    }
}

pub(super) fn none(id: &str) -> Problem {
    Problem::not_found(format!("there is no upload in parts {id:?}: it was given up, or has waited for too long"))
}

/// The upload, if the caller may do something with it.
pub(super) async fn own(service: &Coordinator, caller: &Caller, id: &str) -> Result<OpenUpload, Problem> {
    caller.needs(Scope::Submitter)?;
    let open = service.store.find_open_upload(id).await?.ok_or_else(|| none(id))?;
    if open.owner != caller.name && caller.scope < Scope::Operator {
        return Err(none(id));
    }
    Ok(open)
}

pub(super) async fn view(service: &Coordinator, id: &str) -> Result<OpenUploadView, Problem> {
    let open = service.store.find_open_upload(id).await?.ok_or_else(|| none(id))?;
    Ok(OpenUploadView::of(open, service.store.upload_parts(id).await?))
}

/// Begin an upload in parts
///
/// Then put its parts, and complete it. One from which nothing comes for a day is forgotten.
#[utoipa::path(
    post, path = "/open-uploads", tag = "uploads", request_body = NewOpenUpload,
    responses(
        (status = 201, description = "Begun", body = OpenUploadView, headers(("Location" = String, description = "Where it is"))),
        Refused<413>,
        Refused<415>,
        Refused<422>,
        Refused<429>,
    )
)]
pub(crate) async fn open(
    State(service): State<Coordinator>,
    caller: Caller,
    JsonBody(NewOpenUpload { name, city }): JsonBody<NewOpenUpload>,
) -> Result<Response, Problem> {
    caller.needs(Scope::Submitter)?;
    checked_name(&name)?;
    may_send_for(&service, &caller, city.as_deref()).await?;
    let id = uuid::Uuid::now_v7().to_string();
    service.store.open_upload(&id, &caller.name, &name, city.as_deref(), quota(&service)).await?;
    let place = format!("/api/v1/open-uploads/{id}");
    Ok((StatusCode::CREATED, [(header::LOCATION, place)], Json(view(&service, &id).await?)).into_response())
}

/// List the caller's uploads in parts, newest first, without their parts
#[utoipa::path(
    get, path = "/open-uploads", tag = "uploads",
    responses((status = 200, description = "At most 1000 of them", body = Vec<OpenUploadView>))
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    caller: Caller,
) -> Result<Json<Vec<OpenUploadView>>, Problem> {
    let all = service.store.open_uploads(&caller.name, PAGE).await?;
    Ok(Json(all.into_iter().map(|open| OpenUploadView::of(open, Vec::new())).collect()))
}

/// Show an upload in parts: what has come, and what became of it
#[utoipa::path(
    get, path = "/open-uploads/{id}", tag = "uploads",
    params(("id" = String, Path, description = "Id of the upload in parts")),
    responses((status = 200, description = "The upload", body = OpenUploadView), Refused<404>)
)]
pub(crate) async fn show(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<Json<OpenUploadView>, Problem> {
    own(&service, &caller, &id).await?;
    Ok(Json(view(&service, &id).await?))
}

/// Send a part
///
/// The body is the part. With its SHA-256 in the header Content-Digest (RFC 9530), what was damaged on its way is refused. A part of the
/// same number is replaced.
#[utoipa::path(
    put, path = "/open-uploads/{id}/parts/{number}", tag = "uploads",
    params(
        ("id" = String, Path, description = "Id of the upload in parts"),
        ("number" = i64, Path, minimum = 1, maximum = 10000, description = "Number of the part, in the order of the file"),
        ("Content-Digest" = Option<String>, Header, description = "sha-256=:BASE64:"),
    ),
    request_body(content = String, content_type = "application/octet-stream", description = "The part, of 1 byte to 64 MB"),
    responses(
        (status = 200, description = "It is here", body = PartView),
        Refused<404>,
        Refused<409>,
        Refused<413>,
        Refused<422>,
        Refused<429>,
    )
)]
pub(crate) async fn put(
    State(service): State<Coordinator>,
    caller: Caller,
    Path((id, number)): Path<(String, i64)>,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<PartView>, Problem> {
    let open = own(&service, &caller, &id).await?;
    if !(1..=PARTS).contains(&number) {
        return Err(Problem::invalid(format!("parts are numbered from 1 to {PARTS}")));
    }
    let quota = quota(&service);
    let left = quota.bytes.saturating_sub(service.store.sent_bytes(&open.owner).await?);
    let mut incoming = service.receiving.begin(&open.owner, quota.open)?;
    let folder = tempfile::tempdir_in(&service.folder).map_err(|e| no_room(&e))?;
    let file = folder.path().join("part");
    let allowed = Allowed { limits: &service.limits, bytes: LARGEST, left, what: "a part" };
    store_body(body, &file, &mut incoming, allowed).await?;
    let (blob, bytes) = BlobId::of_file(&file).await?;
    if bytes == 0 {
        return Err(Problem::invalid("a part has to have a byte at least"));
    }
    let sha256 = sha256_of(&file).await?;
    if let Some(said) = digest(&headers)?
        && said != sha256
    {
        let detail = format!("the part that came has the SHA-256 {sha256}, and was to have {said}: send it again");
        return Err(Problem::new(
            StatusCode::UNPROCESSABLE_ENTITY,
            "digest",
            "The part was damaged on its way",
            detail,
        ));
    }
    hold(&service, &[blob]).await?;
    service.blobs.put_file(blob, &file).await?;
    let part = UploadPart { number, blob, bytes, sha256 };
    if !service.store.add_part(&open, &part, quota).await? {
        return Err(over(&id));
    }
    Ok(Json(PartView::of(part)))
}

fn over(id: &str) -> Problem {
    let detail = format!("upload {id} is being put together, or is over");
    Problem::new(StatusCode::CONFLICT, "state", "The upload takes no more parts", detail)
}

/// The SHA-256 that a request says its body has, hexadecimal.
fn digest(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let wrong = || Problem::invalid("Content-Digest has to be sha-256=:BASE64:");
    let Some(value) = headers.get("content-digest") else { return Ok(None) };
    let text = value.to_str().map_err(|_| wrong())?;
    // Others than SHA-256 may be named beside it.
    let named = text.split(',').find_map(|item| item.trim().strip_prefix("sha-256="));
    let encoded = named.and_then(|v| v.strip_prefix(':')?.strip_suffix(':')).ok_or_else(wrong)?;
    let bytes = STANDARD.decode(encoded).map_err(|_| wrong())?;
    if bytes.len() == 32 { Ok(Some(hex(&bytes))) } else { Err(wrong()) }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The SHA-256 of a file, hexadecimal.
async fn sha256_of(file: &FilePath) -> Result<String, Problem> {
    let file = file.to_owned();
    let read = move || -> std::io::Result<String> {
        let mut content = std::fs::File::open(file)?;
        let (mut hasher, mut piece) = (Sha256::new(), vec![0; 1 << 16]);
        loop {
            let count = content.read(&mut piece)?;
            if count == 0 {
                return Ok(hex(&hasher.finalize()));
            }
            hasher.update(&piece[..count]);
        }
    };
    tokio::task::spawn_blocking(read).await.map_err(|e| no_room(&e.into()))?.map_err(|e| no_room(&e))
}

/// Give an upload in parts up
#[utoipa::path(
    delete, path = "/open-uploads/{id}", tag = "uploads",
    params(("id" = String, Path, description = "Id of the upload in parts")),
    responses((status = 204, description = "Its parts are forgotten"), Refused<404>)
)]
pub(crate) async fn abort(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<StatusCode, Problem> {
    own(&service, &caller, &id).await?;
    removed(service.store.abort_upload(&id).await?, || none(&id))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digests_are_read() {
        let read = |text: &str| {
            let mut headers = HeaderMap::new();
            headers.insert("content-digest", text.parse().expect("a value"));
            digest(&headers).map_err(|p| p.status)
        };
        // Of nothing, as RFC 6234 has it.
        let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        let said = "sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:";
        assert_eq!(read(said), Ok(Some(empty.to_owned())));
        assert_eq!(read(&format!("md5=:AAAA:, {said}")), Ok(Some(empty.to_owned())));
        for wrong in ["", "sha-256=47DE", "sha-256=:47DE:", "sha-256=:?:", "md5=:AAAA:"] {
            assert_eq!(read(wrong), Err(422), "{wrong}");
        }
        assert_eq!(digest(&HeaderMap::new()).map_err(|p| p.status), Ok(None));
    }
}
