//! Putting the parts of an upload together.

use super::parts::{OpenUploadView, none, own, view};
use super::uploads::{UploadView, no_room, quota, take_in, too_large};
use crate::extract::Body as JsonBody;
use crate::problem::Refused;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use futures_util::TryStreamExt as _;
use gable_job_store::{OpenUpload, Upload, UploadPart};
use serde::Deserialize;
use std::convert::Infallible;
use std::time::Duration;
use tokio::io::AsyncWriteExt as _;
use utoipa::ToSchema;

/// How long a request for completion is kept waiting before it is told to ask again.
const PATIENCE: Duration = Duration::from_secs(20);

/// How long a coordinator that puts an upload together holds it, without saying that it goes on.
const LEASE: Duration = Duration::from_secs(60);

/// All parts of an upload.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Completion {
    /// In order, from number 1.
    #[schema(min_items = 1, max_items = 10000)]
    parts: Vec<NamedPart>,
}

/// A part as its sender knows it.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NamedPart {
    #[schema(minimum = 1, maximum = 10000)]
    number: i64,
    /// Hexadecimal.
    #[schema(min_length = 64, max_length = 64)]
    sha256: String,
}

/// Complete an upload in parts
///
/// All parts are named, and put together. A mesh of many gigabytes takes longer than a request may: then the answer is 202, and the same
/// request again is answered as soon as the upload is there, as often as it is asked.
#[utoipa::path(
    post, path = "/open-uploads/{id}/complete", tag = "uploads",
    params(("id" = String, Path, description = "Id of the upload in parts")),
    request_body = Completion,
    responses(
        (status = 201, description = "It is an upload", body = UploadView),
        (status = 202, description = "It is being put together: ask again", body = OpenUploadView),
        Refused<404>,
        Refused<409>,
        Refused<413>,
        Refused<415>,
        Refused<422>,
    )
)]
pub(crate) async fn complete(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(id): Path<String>,
    JsonBody(Completion { parts: named }): JsonBody<Completion>,
) -> Result<Response, Problem> {
    let open = own(&service, &caller, &id).await?;
    if let Some(answer) = ended(&service, &open).await? {
        return Ok(answer);
    }
    if !service.store.hold_open_upload(&id, false, LEASE).await? {
        return Ok((StatusCode::ACCEPTED, Json(view(&service, &id).await?)).into_response());
    }
    // Asked for once it is held: from here on no part changes.
    let parts = service.store.upload_parts(&id).await?;
    let parts = match all_there(parts, &named) {
        Ok(parts) => parts,
        Err(problem) => {
            service.store.let_go_of_open_upload(&id, None).await?;
            return Err(problem);
        }
    };
    // It goes on though the client may go away.
    let (worker, upload) = (service.clone(), open.clone());
    let work = tokio::spawn(async move { put_together(&worker, &upload, &parts).await });
    match tokio::time::timeout(PATIENCE, work).await {
        Ok(Ok(done)) => done?,
        Ok(Err(e)) => return Err(no_room(&e.into())),
        Err(_) => {}
    }
    let open = service.store.find_open_upload(&id).await?.ok_or_else(|| none(&id))?;
    match ended(&service, &open).await? {
        Some(answer) => Ok(answer),
        None => Ok((StatusCode::ACCEPTED, Json(view(&service, &id).await?)).into_response()),
    }
}

/// What is answered about an upload in parts that is over.
async fn ended(service: &Coordinator, open: &OpenUpload) -> Result<Option<Response>, Problem> {
    if let Some(problem) = &open.problem {
        return Err(Problem::invalid(problem));
    }
    let Some(id) = &open.upload else { return Ok(None) };
    let made = service.store.upload(id).await?.ok_or_else(|| Problem::not_found("the upload was removed"))?;
    Ok(Some(UploadView::created(made)))
}

/// The parts that the sender names, from the first to the last; an error unless all are here. Further ones, of an attempt that was given
/// up, do not count.
fn all_there(mut parts: Vec<UploadPart>, named: &[NamedPart]) -> Result<Vec<UploadPart>, Problem> {
    let wrong = |detail: String| Problem::new(StatusCode::CONFLICT, "parts", "The parts are not complete", detail);
    for (position, name) in named.iter().enumerate() {
        let number = position as i64 + 1;
        if name.number != number {
            return Err(wrong(format!("part {number} is missing in the list, which has {} there", name.number)));
        }
        match parts.get(position).filter(|part| part.number == number) {
            None => return Err(wrong(format!("part {number} has not come: send it"))),
            Some(part) if !part.sha256.eq_ignore_ascii_case(&name.sha256) => {
                return Err(wrong(format!("part {number} is another than the list has: send it again")));
            }
            Some(_) => {}
        }
    }
    if named.is_empty() {
        return Err(wrong("the list is empty".to_owned()));
    }
    parts.truncate(named.len());
    Ok(parts)
}

/// Makes an upload of all parts; says from time to time that it goes on.
async fn put_together(service: &Coordinator, open: &OpenUpload, parts: &[UploadPart]) -> Result<(), Problem> {
    let made = tokio::select! {
        made = assemble(service, open, parts) => made,
        never = keep_held(service, &open.id) => match never {},
    };
    if let Err(problem) = &made {
        // What the service could not do it may do another time; what is wrong with the mesh stays wrong.
        let for_good = problem.status < 500 && problem.kind != "quota";
        service.store.let_go_of_open_upload(&open.id, for_good.then_some(problem.detail.as_str())).await?;
    }
    made
}

/// Holds an upload for as long as it is put together.
async fn keep_held(service: &Coordinator, id: &str) -> Infallible {
    loop {
        tokio::time::sleep(LEASE / 3).await;
        // If the database stays away, the hold runs out, and another begins anew: the first that is done counts.
        if let Err(e) = service.store.hold_open_upload(id, true, LEASE).await {
            tracing::warn!(upload = id, "the upload is not held any longer: {e}");
        }
    }
}

async fn assemble(service: &Coordinator, open: &OpenUpload, parts: &[UploadPart]) -> Result<(), Problem> {
    let most = service.limits.upload;
    if parts.iter().map(|p| p.bytes).sum::<u64>() > most {
        return Err(too_large("an upload", most));
    }
    let folder = tempfile::tempdir_in(&service.folder).map_err(|e| no_room(&e))?;
    let file = folder.path().join("body");
    let mut whole = tokio::fs::File::create(&file).await.map_err(|e| no_room(&e))?;
    for part in parts {
        let mut pieces = service.blobs.stream(part.blob).await?;
        while let Some(piece) = pieces.try_next().await? {
            whole.write_all(&piece).await.map_err(|e| no_room(&e))?;
        }
    }
    whole.flush().await.map_err(|e| no_room(&e))?;
    let (upload, files) = take_in(service, &open.owner, &open.name, folder.path(), &file).await?;
    let upload = Upload { city: open.city.clone(), ..upload };
    service.store.complete_upload(&open.id, &upload, &files, quota(service)).await?;
    Ok(())
}
