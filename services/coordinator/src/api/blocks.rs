//! The units of a job: blocks, patches, tiles.

use super::jobs::{seconds, stage_name};
use crate::pages::{polled, time};
use crate::problem::Refused;
use crate::{Caller, Coordinator, Problem};
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use gable_job_store::Task;
use serde::Serialize;
use utoipa::ToSchema;

/// One unit of one stage of a job.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct BlockView {
    #[schema(example = "sample")]
    stage: &'static str,
    /// Column and row of the block, joined by `_`; other names for what concerns the whole city.
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

/// The blocks of a job, by stage and unit
///
/// To poll them, send the ETag of the last answer as If-None-Match: nothing new is answered by 304.
#[utoipa::path(
    get, path = "/jobs/{id}/blocks", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    responses(
        (status = 200, description = "The blocks", body = Vec<BlockView>, headers(("ETag" = String, description = "Their state"))),
        (status = 304, description = "Nothing new"),
        Refused<404>,
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: Caller,
    headers: HeaderMap,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let blocks = async || {
        let tasks = service.store.tasks(&id).await?;
        Ok(tasks.into_iter().map(BlockView::of).collect::<Vec<_>>())
    };
    polled(&service.answers.blocks, &service.store, &id, &headers, blocks).await
}
