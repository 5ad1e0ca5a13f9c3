//! The units of a job: blocks, patches, tiles.

use super::jobs::{seconds, stage_name};
use crate::pages::{polled, time};
use crate::problem::Refused;
use crate::rights::OfJob;
use crate::{Coordinator, Problem};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::{Task, TaskLog};
use gable_pipeline::Stage;
use serde::Serialize;
use utoipa::ToSchema;

/// One unit of one stage of a job.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct BlockView {
    #[schema(example = "sample")]
    stage: &'static str,
    /// What it is: `block`, a part of the mesh; `patch`, a part of the lattice on which labels are found; `tile`, a part of the result, in the
    /// place of the block of the same name; `scene`, the whole mesh; `city`, the whole city. `/jobs/{id}/map` tells where they lie.
    #[schema(example = "block")]
    kind: &'static str,
    /// Its name. Column and row, joined by `_`, of blocks and tiles; `patch_` before those of patches.
    #[schema(example = "3_7")]
    unit: String,
    /// ready, running, done, reused, failed or cancelled.
    #[schema(example = "done")]
    state: &'static str,
    /// How often it was begun.
    attempts: i64,
    /// Who does it, or did it last.
    #[serde(skip_serializing_if = "Option::is_none")]
    worker: Option<String>,
    /// How far its worker is.
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<String>,
    /// Why the last attempt failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    /// When the last attempt began, RFC 3339.
    #[serde(skip_serializing_if = "Option::is_none")]
    started: Option<String>,
    /// How long the last attempt took.
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
}

impl BlockView {
    fn of(task: Task) -> Self {
        Self {
            stage: stage_name(task.stage),
            kind: kind_of(task.stage),
            seconds: seconds(&task),
            state: task.state.name(),
            attempts: task.attempts,
            started: task.started.map(time),
            unit: task.unit,
            worker: task.worker,
            phase: task.phase,
            reason: task.reason,
        }
    }
}

/// What the units of a stage are.
pub(super) fn kind_of(stage: i64) -> &'static str {
    match usize::try_from(stage).ok().and_then(|n| Stage::ALL.get(n)) {
        Some(Stage::Split) => "scene",
        Some(Stage::Sample) => "block",
        Some(Stage::Segment) => "patch",
        Some(Stage::Model | Stage::Write) => "tile",
        Some(Stage::Terrain | Stage::Stitch | Stage::Report) => "city",
        None => "unknown",
    }
}

/// The units of a job: blocks, patches, tiles and what there is once, by stage and name
///
/// To poll them, send the ETag of the last answer as If-None-Match: nothing new is answered by 304.
#[utoipa::path(
    get, path = "/jobs/{id}/blocks", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    responses(
        (status = 200, description = "The units", body = Vec<BlockView>, headers(("ETag" = String, description = "Their state"))),
        (status = 304, description = "Nothing new"),
        Refused<404>,
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: OfJob,
    headers: HeaderMap,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let blocks = async || {
        let tasks = service.store.tasks(&id).await?;
        Ok(tasks.into_iter().map(BlockView::of).collect::<Vec<_>>())
    };
    polled(&service.answers.blocks, &service.store, &id, &headers, blocks).await
}

/// What the programs of a unit said
///
/// The last lines of the last attempt, of a block and of the tile in its place stage by stage, with the seconds since the attempt began: 200
/// lines and 16 KB at most. For all units that `/blocks` lists, under their names there. There is none of units that were not begun.
#[utoipa::path(
    get, path = "/jobs/{id}/blocks/{unit}/log", tag = "jobs",
    params(
        ("id" = String, Path, description = "Id of the job"),
        ("unit" = String, Path, description = "The unit, as `/blocks` names it"),
    ),
    responses(
        (status = 200, description = "The lines, as text", body = String, content_type = "text/plain"),
        Refused<404>,
    )
)]
pub(crate) async fn log(
    State(service): State<Coordinator>,
    _: OfJob,
    Path((id, unit)): Path<(String, String)>,
) -> Result<impl IntoResponse, Problem> {
    let logs = service.store.logs(&id, &unit).await?;
    if logs.is_empty() {
        return Err(Problem::not_found(format!("nothing of {unit} has ended yet, or the job has no such unit")));
    }
    let part = |log: &TaskLog| format!("{}, attempt {}\n{}", stage_name(log.stage), log.attempt, log.text);
    let text = logs.iter().map(part).collect::<Vec<_>>().join("\n");
    Ok(([(header::CONTENT_TYPE, "text/plain; charset=utf-8")], text))
}
