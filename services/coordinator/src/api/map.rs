//! Where the units of a job lie, and what the mesh looks like from above.

use crate::problem::Refused;
use crate::rights::OfJob;
use crate::{Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use gable_job_store::{Artifact, JobStoreError};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Folder of the artefacts of the map.
const FOLDER: &str = "map/";
/// Where the blocks are, left by the split.
const BLOCKS: &str = "map/blocks.json";
/// Where the patches are, left when all blocks are sampled.
const PATCHES: &str = "map/patches.json";
/// The mesh from above, left with the patches.
const PICTURE: &str = "map/picture.jpg";

/// The map of a job.
#[derive(Clone, Debug, Default, Serialize, ToSchema)]
pub(crate) struct MapView {
    /// Reference system of the coordinates; absent as long as the mesh is not split.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "EPSG:7415")]
    crs: Option<String>,
    /// West, south, east, north of all blocks, metres; absent as long as the mesh is not split.
    #[serde(skip_serializing_if = "Option::is_none")]
    bbox: Option<[f64; 4]>,
    /// Whether there is a picture of the mesh from above, over just that extent.
    picture: bool,
    /// The blocks when the mesh is split, then the patches when all blocks are sampled. Tiles lie where the blocks of the same name lie.
    units: Vec<ExtentView>,
}

/// Where a unit lies.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct ExtentView {
    /// What it is: block or patch.
    #[schema(example = "block")]
    kind: &'static str,
    /// Its name.
    #[schema(example = "3_7")]
    unit: String,
    /// West, south, east, north, metres.
    bbox: [f64; 4],
}

/// What the pipeline leaves.
#[derive(Deserialize)]
struct Extents {
    crs: String,
    bbox: [f64; 4],
    units: Vec<Extent>,
}

#[derive(Deserialize)]
struct Extent {
    unit: String,
    bbox: [f64; 4],
}

/// The map of a job: where its blocks and patches lie
#[utoipa::path(
    get, path = "/jobs/{id}/map", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    responses(
        (status = 200, description = "What is known of it so far", body = MapView),
        Refused<404>,
    )
)]
pub(crate) async fn show(
    State(service): State<Coordinator>,
    _: OfJob,
    Path(id): Path<String>,
) -> Result<Json<MapView>, Problem> {
    service.store.job(&id).await?;
    let found = service.store.artifacts(&id, FOLDER).await?;
    let mut map = MapView { picture: found.iter().any(|a| a.path == PICTURE), ..MapView::default() };
    for (path, kind) in [(BLOCKS, "block"), (PATCHES, "patch")] {
        let Some(artifact) = found.iter().find(|a| a.path == path) else { continue };
        let Extents { crs, bbox, units } = read(&service, artifact).await?;
        map.crs = Some(crs);
        map.bbox = Some(bbox);
        map.units.extend(units.into_iter().map(|Extent { unit, bbox }| ExtentView { kind, unit, bbox }));
    }
    Ok(Json(map))
}

async fn read(service: &Coordinator, artifact: &Artifact) -> Result<Extents, Problem> {
    let content = service.blobs.get(artifact.blob).await?;
    serde_json::from_slice(&content).map_err(|_| JobStoreError::DamagedBlob(artifact.blob.to_string()).into())
}

/// The mesh of a job from above, over the extent of its map
#[utoipa::path(
    get, path = "/jobs/{id}/map/picture", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    responses(
        (status = 200, description = "The picture", content_type = "image/jpeg"),
        (status = 206, description = "A part of it", content_type = "image/jpeg"),
        (status = 304, description = "Nothing new"),
        Refused<404>,
        Refused<416>,
    )
)]
pub(crate) async fn picture(
    State(service): State<Coordinator>,
    _: OfJob,
    headers: HeaderMap,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    service.store.job(&id).await?;
    let found = service.store.artifacts(&id, PICTURE).await?;
    let none = || Problem::not_found("there is no picture as long as not all blocks are sampled");
    let artifact = found.into_iter().find(|a| a.path == PICTURE).ok_or_else(none)?;
    super::files::send(&service, &headers, PICTURE, &artifact).await
}
