//! The files of a city: of the generation that readers see, or of an earlier one.

use super::cities::chosen;
use super::files::{self, FileView};
use crate::extract::Query;
use crate::problem::Refused;
use crate::rights::OfCity;
use crate::{Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use gable_job_store::Artifact;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::{IntoParams, ToSchema};

/// Folder of the tiles.
const TILES: &str = "tiles/";

/// Which state of the city.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct GenerationQuery {
    /// Number of the generation; by default the one that readers see.
    generation: Option<i64>,
}

/// Which files.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct FilesQuery {
    /// Number of the generation; by default the one that readers see.
    generation: Option<i64>,
    /// Only those whose paths begin with this.
    #[serde(default)]
    prefix: String,
}

/// The files of a city, of one generation.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct CityFiles {
    generation: i64,
    /// By path.
    files: Vec<FileView>,
}

/// The tiles of a city, of one generation.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct CityTiles {
    generation: i64,
    /// By column and row.
    tiles: Vec<TileView>,
}

/// A tile.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct TileView {
    /// Column and row, joined by `_`.
    #[schema(example = "3_7")]
    name: String,
    column: u32,
    row: u32,
    /// Its files by format: `city.json` for CityJSON, `gml` for CityGML.
    files: BTreeMap<String, FileView>,
}

/// The tiles of a city
#[utoipa::path(
    get, path = "/cities/{city}/tiles", tag = "cities",
    params(("city" = String, Path, description = "Name of the city"), GenerationQuery),
    responses((status = 200, description = "The tiles", body = CityTiles), Refused<404>)
)]
pub(crate) async fn tiles(
    State(service): State<Coordinator>,
    _: OfCity,
    Path(city): Path<String>,
    Query(query): Query<GenerationQuery>,
) -> Result<Json<CityTiles>, Problem> {
    let (generation, files) = listed(&service, &city, query.generation, TILES).await?;
    let mut tiles: BTreeMap<(u32, u32), TileView> = BTreeMap::new();
    for file in files {
        let Some((name, format)) = file.path[TILES.len()..].split_once('.') else { continue };
        let Some((Ok(column), Ok(row))) = name.split_once('_').map(|(x, y)| (x.parse(), y.parse())) else { continue };
        let new = || TileView { name: name.to_owned(), column, row, files: BTreeMap::new() };
        let tile = tiles.entry((column, row)).or_insert_with(new);
        tile.files.insert(format.to_owned(), FileView::of(&file));
    }
    Ok(Json(CityTiles { generation, tiles: tiles.into_values().collect() }))
}

/// The files of a city
#[utoipa::path(
    get, path = "/cities/{city}/files", tag = "cities",
    params(("city" = String, Path, description = "Name of the city"), FilesQuery),
    responses((status = 200, description = "The files", body = CityFiles), Refused<404>)
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: OfCity,
    Path(city): Path<String>,
    Query(query): Query<FilesQuery>,
) -> Result<Json<CityFiles>, Problem> {
    let (generation, found) = listed(&service, &city, query.generation, &query.prefix).await?;
    Ok(Json(CityFiles { generation, files: found.iter().map(FileView::of).collect() }))
}

/// A file of a city
///
/// `Range: bytes=…` gives a part of it. The ETag is the hash of the content, the same in all generations that have it.
#[utoipa::path(
    get, path = "/cities/{city}/files/{*path}", tag = "cities",
    params(
        ("city" = String, Path, description = "Name of the city"),
        ("path" = String, Path, description = "Path, as the list of files has it"),
        GenerationQuery,
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
    _: OfCity,
    headers: HeaderMap,
    Path((city, path)): Path<(String, String)>,
    Query(query): Query<GenerationQuery>,
) -> Result<Response, Problem> {
    let file = named(&service, &city, query.generation, &path).await?;
    files::send(&service, &headers, &path, &file).await
}

/// The files of a city whose paths begin with this, and the number of the generation: that one, or the one that readers see.
pub(super) async fn listed(
    service: &Coordinator,
    city: &str,
    generation: Option<i64>,
    prefix: &str,
) -> Result<(i64, Vec<Artifact>), Problem> {
    let generation = chosen(service, city, generation).await?.number;
    Ok((generation, service.store.city_files(city, generation, prefix).await?))
}

/// A file of a city, of that generation or the one that readers see.
pub(super) async fn named(
    service: &Coordinator,
    city: &str,
    generation: Option<i64>,
    path: &str,
) -> Result<Artifact, Problem> {
    let generation = chosen(service, city, generation).await?.number;
    let file = service.store.city_file(city, generation, path).await?;
    file.ok_or_else(|| Problem::not_found(format!("generation {generation} of {city:?} has no file {path:?}")))
}
