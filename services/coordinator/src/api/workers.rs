//! The workers.

use crate::pages::time;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::State;
use serde::Serialize;
use utoipa::ToSchema;

/// A worker.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct WorkerView {
    id: String,
    host: String,
    pid: i64,
    version: String,
    /// When it was first seen, RFC 3339.
    started: String,
    /// When it was last seen.
    seen: String,
    /// What it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    task: Option<String>,
    /// Memory in use, bytes.
    memory: i64,
}

/// The workers, those seen last first
#[utoipa::path(
    get, path = "/workers", tag = "service",
    responses(
        (status = 200, description = "The workers", body = Vec<WorkerView>),
    )
)]
pub(crate) async fn list(State(service): State<Coordinator>, _: Caller) -> Result<Json<Vec<WorkerView>>, Problem> {
    let workers = service.store.workers().await?;
    let view = workers.into_iter().map(|w| WorkerView {
        id: w.id,
        host: w.host,
        pid: w.pid,
        version: w.version,
        started: time(w.started),
        seen: time(w.seen),
        task: w.task,
        memory: w.memory,
    });
    Ok(Json(view.collect()))
}
