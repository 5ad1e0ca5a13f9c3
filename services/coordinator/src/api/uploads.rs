//! Uploads: meshes that users send.

use super::jobs::checked_city;
use crate::extract::Query;
use crate::pages::{removed, time};
use crate::problem::Refused;
use crate::receiving::{Allowed, store_body};
use crate::unpack::{ARCHIVES, UnpackError, unpack};
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::{Artifact, BlobId, JobStoreError, Role, Scope, Upload, UploadQuota};
use serde::{Deserialize, Serialize};
use std::path::Path as FilePath;
use std::time::Duration;
use utoipa::{IntoParams, ToSchema};

/// How long contents are held before their upload is complete.
const HOLD: Duration = Duration::from_secs(24 * 3600);

/// Uploads on a page.
const PAGE: i64 = 1000;

/// What a mesh that is one file may be named like.
const MESHES: [&str; 4] = ["ply", "off", "glb", "obj"];

/// What a name may have besides letters and digits: none of it means anything in a path.
const NAMES: &str = "._- ()[]{},;'+&!#@=~^%$";

/// How an upload is to be taken.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct UploadQuery {
    /// Name of the file: a .zip, .7z, .tar, .tar.gz or .tar.zst of a folder of tiles, or a mesh in one file (.ply, .off, .glb, .obj).
    #[param(min_length = 5, max_length = 200)]
    name: String,
    /// The city whose editors may use it as a source; if not given, only who sends it may.
    #[param(max_length = 200)]
    city: Option<String>,
}

/// A mesh that was sent.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct UploadView {
    id: String,
    /// What a job names as its source.
    #[schema(example = "upload:0198c0de")]
    source: String,
    /// Who has sent it.
    owner: String,
    /// The city whose editors may use it, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    city: Option<String>,
    name: String,
    /// Size of its files.
    bytes: u64,
    /// Number of its files.
    files: u64,
    created: String,
}

impl UploadView {
    fn of(upload: Upload) -> Self {
        Self {
            source: format!("upload:{}", upload.id),
            id: upload.id,
            owner: upload.owner,
            city: upload.city,
            name: upload.name,
            bytes: upload.bytes,
            files: upload.files,
            created: time(upload.created),
        }
    }
}

impl UploadView {
    /// The answer to whoever has sent it.
    pub(super) fn created(upload: Upload) -> Response {
        let place = format!("/api/v1/uploads/{}", upload.id);
        (StatusCode::CREATED, [(header::LOCATION, place)], Json(Self::of(upload))).into_response()
    }
}

/// Send a mesh
///
/// The body is the file. The mesh is the source `upload:ID` of jobs then, and is kept until no job has read it for long.
#[utoipa::path(
    post, path = "/uploads", tag = "uploads", params(UploadQuery),
    request_body(content = String, content_type = "application/octet-stream", description = "The file"),
    responses(
        (status = 201, description = "It is here", body = UploadView),
        Refused<413>,
        Refused<422>,
        Refused<429>,
    )
)]
pub(crate) async fn receive(
    State(service): State<Coordinator>,
    caller: Caller,
    Query(UploadQuery { name, city }): Query<UploadQuery>,
    body: Body,
) -> Result<Response, Problem> {
    caller.needs(Scope::Submitter)?;
    checked_name(&name)?;
    may_send_for(&service, &caller, city.as_deref()).await?;
    let quota = quota(&service);
    let left = quota.bytes.saturating_sub(service.store.sent_bytes(&caller.name).await?);
    if left == 0 {
        return Err(JobStoreError::UploadBytes { owner: caller.name, most: quota.bytes }.into());
    }
    let mut incoming = service.receiving.begin(&caller.name, quota.open)?;
    let folder = tempfile::tempdir_in(&service.folder).map_err(|e| no_room(&e))?;
    let file = folder.path().join("body");
    let limits = &service.limits;
    let allowed = Allowed { limits, bytes: limits.upload.min(left), left, what: "an upload" };
    store_body(body, &file, &mut incoming, allowed).await?;
    let (upload, files) = take_in(&service, &caller.name, &name, folder.path(), &file).await?;
    let upload = Upload { city, ..upload };
    service.store.add_upload(&upload, &files, quota).await?;
    let made = service.store.upload(&upload.id).await?.ok_or_else(|| none(&upload.id))?;
    Ok(UploadView::created(made))
}

/// Send a mesh, as `curl -T` does
///
/// The same as by POST.
#[utoipa::path(
    put, path = "/uploads", tag = "uploads", params(UploadQuery),
    request_body(content = String, content_type = "application/octet-stream", description = "The file"),
    responses(
        (status = 201, description = "It is here", body = UploadView),
        Refused<413>,
        Refused<422>,
        Refused<429>,
    )
)]
pub(crate) async fn put(
    service: State<Coordinator>,
    caller: Caller,
    query: Query<UploadQuery>,
    body: Body,
) -> Result<Response, Problem> {
    receive(service, caller, query, body).await
}

/// An error unless the caller may send a mesh for the editors of a city to use. A city that is nobody's yet is that of whoever submits its
/// first job.
pub(super) async fn may_send_for(service: &Coordinator, caller: &Caller, city: Option<&str>) -> Result<(), Problem> {
    let Some(city) = city else { return Ok(()) };
    checked_city(city)?;
    if service.store.is_claimed(city).await? {
        let allowed = service.needs_role(caller, city, Role::Editor).await;
        return allowed.map_err(|problem| match problem.status {
            404 => JobStoreError::NotAnEditor { city: city.to_owned() }.into(),
            _ => problem,
        });
    }
    Ok(())
}

/// What a caller may have on the service at a time.
pub(super) fn quota(service: &Coordinator) -> UploadQuota {
    UploadQuota { open: service.limits.open_uploads, bytes: service.limits.uploads }
}

/// The end of a name that a mesh may have.
pub(super) fn checked_name(name: &str) -> Result<String, Problem> {
    let end = name.rsplit_once('.').map(|(_, end)| end.to_ascii_lowercase()).unwrap_or_default();
    let plain = |c: char| c.is_alphanumeric() || NAMES.contains(c);
    if name.len() > 200 || name.starts_with('.') || !name.chars().all(plain) {
        return Err(Problem::invalid(format!(
            "name has to be that of a file: letters, digits, spaces, and any of {NAMES}"
        )));
    }
    let lower = name.to_lowercase();
    if let Some(end) = ARCHIVES.iter().find(|end| lower.ends_with(&format!(".{end}"))) {
        return Ok((*end).to_owned());
    }
    if !MESHES.contains(&&*end) {
        return Err(Problem::invalid(format!(
            "name {name:?} has to end with .zip, .7z, .tar, .tar.gz, .tgz, .tar.zst, .tzst, .ply, .off, .glb or .obj"
        )));
    }
    Ok(end)
}

/// Takes in a file that was sent: unpacks it, and puts what is in it into the object store. The upload is not in the database yet.
pub(super) async fn take_in(
    service: &Coordinator,
    owner: &str,
    name: &str,
    folder: &FilePath,
    file: &FilePath,
) -> Result<(Upload, Vec<Artifact>), Problem> {
    let files = folder.join("files");
    let paths = if ARCHIVES.contains(&&*checked_name(name)?) {
        let (limits, to) = (service.limits, files.clone());
        let archive = std::fs::File::open(file).map_err(|e| no_room(&e))?;
        let unpacked = tokio::task::spawn_blocking(move || unpack(archive, &to, &limits)).await;
        match unpacked.map_err(|e| no_room(&e.into()))? {
            Ok(paths) => paths,
            Err(UnpackError::File { source, .. }) => return Err(no_room(&source)),
            Err(e) => return Err(Problem::invalid(e.to_string())),
        }
    } else {
        tokio::fs::create_dir(&files).await.map_err(|e| no_room(&e))?;
        tokio::fs::rename(file, files.join(name)).await.map_err(|e| no_room(&e))?;
        vec![name.to_owned()]
    };
    let kept = keep(service, &files, paths).await?;
    let upload = Upload {
        id: uuid::Uuid::now_v7().to_string(),
        owner: owner.to_owned(),
        city: None,
        name: name.to_owned(),
        bytes: kept.iter().map(|f| f.bytes).sum(),
        files: kept.len() as u64,
        created: 0,
    };
    Ok((upload, kept))
}

fn none(id: &str) -> Problem {
    Problem::not_found(format!("there is no upload {id:?}"))
}

/// The local disk is full, or broken.
pub(crate) fn no_room(error: &std::io::Error) -> Problem {
    tracing::error!("an upload cannot be kept: {error}");
    let detail = "the service has no room for the file now: try again later";
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, "unavailable", "The service is not ready", detail)
}

/// What was sent is larger than it may be.
pub(crate) fn too_large(what: &str, most: u64) -> Problem {
    let detail = format!(
        "{what} may have {} MB: start the service with --upload-size and --upload-quota to allow more",
        most >> 20
    );
    Problem::new(StatusCode::PAYLOAD_TOO_LARGE, "body", "The body is too large", detail)
}

/// Puts files into the object store.
async fn keep(service: &Coordinator, folder: &FilePath, paths: Vec<String>) -> Result<Vec<Artifact>, JobStoreError> {
    let mut kept = Vec::new();
    for path in paths {
        let (blob, bytes) = BlobId::of_file(&folder.join(&path)).await?;
        kept.push(Artifact { path, blob, bytes });
    }
    hold(service, &kept.iter().map(|f| f.blob).collect::<Vec<_>>()).await?;
    for file in &kept {
        service.blobs.put_file(file.blob, &folder.join(&file.path)).await?;
    }
    Ok(kept)
}

/// Keeps contents from being collected before something refers to them.
pub(super) async fn hold(service: &Coordinator, blobs: &[BlobId]) -> Result<(), JobStoreError> {
    // What is being removed just now is gone soon.
    while !service.store.hold(blobs, HOLD).await? {
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    Ok(())
}

/// List uploads, newest first
#[utoipa::path(
    get, path = "/uploads", tag = "uploads",
    responses(
        (status = 200, description = "At most 1000 of them", body = Vec<UploadView>),
    )
)]
pub(crate) async fn list(State(service): State<Coordinator>, caller: Caller) -> Result<Json<Vec<UploadView>>, Problem> {
    let all = service.store.uploads(caller.sees().as_deref(), PAGE).await?;
    Ok(Json(all.into_iter().map(UploadView::of).collect()))
}

/// Remove an upload; jobs that were submitted with it and have not begun will fail
#[utoipa::path(
    delete, path = "/uploads/{id}", tag = "uploads",
    params(("id" = String, Path, description = "Id of the upload")),
    responses(
        (status = 204, description = "Removed"),
        Refused<404>,
    )
)]
pub(crate) async fn remove(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<StatusCode, Problem> {
    caller.needs(Scope::Submitter)?;
    let upload = service.store.upload(&id).await?.ok_or_else(|| none(&id))?;
    if upload.owner != caller.name {
        // Others of its city see it, and only its owners may do this.
        let city = upload.city.as_deref().unwrap_or_default();
        service.needs_role(&caller, city, Role::Owner).await.map_err(|problem| match problem.status {
            404 => none(&id),
            _ => problem,
        })?;
    }
    removed(service.store.remove_upload(&id).await?, || none(&id))
}
