//! The workers.

use crate::pages::time;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::State;
use gable_job_store::Scope;
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
    /// What it does; told to operators.
    #[serde(skip_serializing_if = "Option::is_none")]
    task: Option<String>,
    /// Memory in use, bytes.
    memory: i64,
    /// Most memory that a task may use there, bytes.
    task_memory: i64,
    /// Why it takes no tasks, if it takes none.
    #[serde(skip_serializing_if = "Option::is_none")]
    trouble: Option<String>,
}

/// The workers, those seen last first
#[utoipa::path(
    get, path = "/workers", tag = "service",
    responses(
        (status = 200, description = "The workers", body = Vec<WorkerView>),
    )
)]
pub(crate) async fn list(State(service): State<Coordinator>, caller: Caller) -> Result<Json<Vec<WorkerView>>, Problem> {
    let workers = service.store.workers().await?;
    let view = workers.into_iter().map(|w| WorkerView {
        id: w.id,
        host: w.host,
        pid: w.pid,
        version: w.version,
        started: time(w.started),
        seen: time(w.seen),
        // It names jobs and cities, whosever they are.
        task: w.task.filter(|_| caller.scope == Scope::Operator),
        memory: w.memory,
        task_memory: w.task_memory,
        trouble: w.trouble,
    });
    Ok(Json(view.collect()))
}
