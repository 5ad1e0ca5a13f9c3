//! Where the buildings of a job cross the borders of blocks.

use crate::problem::Refused;
use crate::rights::OfJob;
use crate::{Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use gable_job_store::JobStoreError;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The artefact that the stitching leaves.
const SEAMS: &str = "seams.json";

/// Blocks that have buildings in common.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct SeamView {
    /// The blocks, columns and rows joined by `_`.
    #[schema(example = json!(["3_7", "4_7"]))]
    blocks: Vec<String>,
    /// The tile that models the buildings: its unit of the stage `model` tells how far they are.
    #[schema(example = "3_7")]
    owner: String,
    /// How many buildings.
    buildings: u64,
}

/// The seams of a job
///
/// Which blocks have buildings in common is known when the job was stitched; before, and in a job that was not, there is none.
#[utoipa::path(
    get, path = "/jobs/{id}/seams", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    responses(
        (status = 200, description = "The seams, from south to north", body = Vec<SeamView>),
        Refused<404>,
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: OfJob,
    Path(id): Path<String>,
) -> Result<Json<Vec<SeamView>>, Problem> {
    service.store.job(&id).await?;
    let found = service.store.artifacts(&id, SEAMS).await?;
    let Some(artifact) = found.into_iter().find(|a| a.path == SEAMS) else { return Ok(Json(Vec::new())) };
    let content = service.blobs.get(artifact.blob).await?;
    serde_json::from_slice(&content).map(Json).map_err(|_| JobStoreError::DamagedBlob(artifact.blob.to_string()).into())
}
