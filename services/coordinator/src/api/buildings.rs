//! The buildings of a city, by place and attributes: as GeoJSON, or as CityJSONSeq with all their geometries.

use super::cities::chosen;
use crate::extract::Query;
use crate::pages::{cut, escaped, limit};
use crate::problem::Refused;
use crate::rights::OfCity;
use crate::tile::Tile;
use crate::{Coordinator, Problem};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::{BuildingFilter, CityBuilding, Generation, JobStoreError};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use utoipa::{IntoParams, ToSchema};

const GEO_JSON: &str = "application/geo+json";
const CITY_JSON_SEQ: &str = "application/city+json-seq";

/// In which form buildings are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Form {
    /// Footprints with attributes.
    #[serde(alias = "json")]
    GeoJson,
    /// All geometries, one building a line.
    CityJsonSeq,
}

/// Which buildings.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct BuildingsQuery {
    /// Only those whose boxes meet this one: west,south,east,north in the city's reference system, metres.
    #[param(example = "84900,446000,85100,446200", pattern = r"^\s*-?[0-9.]+(,\s*-?[0-9.]+){3}\s*$")]
    bbox: Option<String>,
    /// Only of this best LOD.
    #[param(example = "lod2")]
    lod: Option<String>,
    /// Only of this roof type.
    roof_type: Option<String>,
    /// Only of at least this height, metres.
    min_height: Option<f64>,
    /// Only of at most this height, metres.
    max_height: Option<f64>,
    /// Only of at least this area, m².
    min_area: Option<f64>,
    /// Only of at most this area, m².
    max_area: Option<f64>,
    /// Number of the generation; by default the one that readers see.
    generation: Option<i64>,
    /// Only those whose ids sort after this one.
    after: Option<String>,
    /// Most buildings on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
    /// `geojson` or `cityjsonseq`, instead of the header Accept.
    #[param(inline)]
    f: Option<Form>,
}

/// In which form and of which generation a building is wanted.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct BuildingQuery {
    /// Number of the generation; by default the one that readers see.
    generation: Option<i64>,
    /// `geojson` or `cityjsonseq`, instead of the header Accept.
    #[param(inline)]
    f: Option<Form>,
}

/// The form that a request asks for.
fn form(given: Option<Form>, headers: &HeaderMap) -> Result<Form, Problem> {
    if let Some(given) = given {
        return Ok(given);
    }
    let accept = headers.get_all(header::ACCEPT).iter().filter_map(|v| v.to_str().ok());
    let kinds: Vec<&str> =
        accept.flat_map(|v| v.split(',')).map(|kind| kind.split(';').next().unwrap_or(kind).trim()).collect();
    let known = kinds.iter().find_map(|kind| match *kind {
        GEO_JSON | "application/json" | "application/*" | "*/*" => Some(Form::GeoJson),
        CITY_JSON_SEQ => Some(Form::CityJsonSeq),
        _ => None,
    });
    match known {
        Some(known) => Ok(known),
        None if kinds.is_empty() => Ok(Form::GeoJson),
        None => {
            let detail = format!("buildings can be had as {GEO_JSON} and as {CITY_JSON_SEQ}");
            Err(Problem::new(StatusCode::NOT_ACCEPTABLE, "form", "This form cannot be had", detail))
        }
    }
}

fn filter(query: &BuildingsQuery) -> Result<BuildingFilter, Problem> {
    let bbox = query.bbox.as_ref().map(|text| {
        let parts: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
        let sides: Option<[f64; 4]> = parts.ok().and_then(|p| p.try_into().ok());
        sides.filter(|[w, s, e, n]| w <= e && s <= n && [w, s, e, n].iter().all(|side| side.is_finite()))
    });
    if bbox == Some(None) {
        return Err(Problem::query("bbox has to be four numbers: west,south,east,north"));
    }
    let numbers = [query.min_height, query.max_height, query.min_area, query.max_area];
    if numbers.iter().flatten().any(|n| !n.is_finite()) {
        return Err(Problem::query("heights and areas have to be numbers"));
    }
    Ok(BuildingFilter {
        bbox: bbox.flatten(),
        lod: query.lod.clone(),
        roof_type: query.roof_type.clone(),
        min_height: query.min_height,
        max_height: query.max_height,
        min_area: query.min_area,
        max_area: query.max_area,
        id: None,
        after: query.after.clone(),
    })
}

/// The buildings of a city, by id
///
/// GeoJSON (the default) has the footprints, in the city's own reference system, which its member `crs` names; CityJSONSeq has
/// all geometries. If others follow, the header `Link` has the address of the next page, and so has GeoJSON's member `links`.
#[utoipa::path(
    get, path = "/cities/{city}/buildings", tag = "cities",
    params(("city" = String, Path, description = "Name of the city"), BuildingsQuery),
    responses(
        (status = 200, description = "A page", headers(("Link" = String, description = "The next page")), content(
            (Value = "application/geo+json"), (String = "application/city+json-seq"),
        )),
        Refused<404>,
        Refused<406>,
        Refused<409>,
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: OfCity,
    address: Uri,
    headers: HeaderMap,
    Path(city): Path<String>,
    Query(query): Query<BuildingsQuery>,
) -> Result<Response, Problem> {
    let form = form(query.f, &headers)?;
    let limit = limit(query.limit, service.limits.page)?;
    let filter = filter(&query)?;
    let generation = chosen(&service, &city, query.generation).await?;
    let mut found = service.store.buildings(&city, generation.number, &filter, limit + 1).await?;
    let next = cut(&mut found, limit, |b| b.id.clone());
    let next = next.map(|after| next_page(&city, &address, generation.number, &after));
    let tiles = tiles(&service, &generation, &found).await?;
    let mut response = match form {
        Form::CityJsonSeq => sequence(&tiles, &found),
        Form::GeoJson => {
            let mut collection = collection(&generation, &tiles, &found);
            if let Some(next) = &next {
                collection["links"] = json!([{ "rel": "next", "href": next, "type": GEO_JSON }]);
            }
            geo_json(&collection)
        }
    };
    if let Some(link) = next.and_then(|next| HeaderValue::from_str(&format!("<{next}>; rel=\"next\"")).ok()) {
        response.headers_mut().insert(header::LINK, link);
    }
    Ok(response)
}

/// A building of a city
#[utoipa::path(
    get, path = "/cities/{city}/buildings/{id}", tag = "cities",
    params(
        ("city" = String, Path, description = "Name of the city"),
        ("id" = String, Path, description = "Id of the building"),
        BuildingQuery,
    ),
    responses(
        (status = 200, description = "The building", content(
            (Value = "application/geo+json"), (String = "application/city+json-seq"),
        )),
        Refused<404>,
        Refused<406>,
        Refused<409>,
    )
)]
pub(crate) async fn show(
    State(service): State<Coordinator>,
    _: OfCity,
    headers: HeaderMap,
    Path((city, id)): Path<(String, String)>,
    Query(query): Query<BuildingQuery>,
) -> Result<Response, Problem> {
    let form = form(query.f, &headers)?;
    let generation = chosen(&service, &city, query.generation).await?;
    let filter = BuildingFilter { id: Some(id.clone()), ..BuildingFilter::default() };
    let found = service.store.buildings(&city, generation.number, &filter, 1).await?;
    let Some(building) = found.first() else {
        let number = generation.number;
        return Err(Problem::not_found(format!("generation {number} of {city:?} has no building {id:?}")));
    };
    let tiles = tiles(&service, &generation, &found).await?;
    Ok(match form {
        Form::CityJsonSeq => sequence(&tiles, &found),
        Form::GeoJson => {
            let mut feature = feature(tiles.get(&building.tile), building);
            feature["crs"] = crs(&generation.crs);
            geo_json(&feature)
        }
    })
}

/// The tiles that hold these buildings, with these buildings.
async fn tiles(
    service: &Coordinator,
    generation: &Generation,
    buildings: &[CityBuilding],
) -> Result<BTreeMap<String, Tile>, Problem> {
    let mut wanted: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for building in buildings {
        wanted.entry(&building.tile).or_default().insert(building.id.clone());
    }
    let mut tiles = BTreeMap::new();
    for (name, ids) in wanted {
        let path = format!("tiles/{name}.city.json");
        let Some(file) = service.store.city_file(&generation.city, generation.number, &path).await? else {
            let detail = format!("the city has no {path}: a job with cityjson among output.formats makes it");
            return Err(Problem::new(StatusCode::CONFLICT, "no-cityjson", "The geometries are not kept", detail));
        };
        let content = service.blobs.get(file.blob).await?;
        // A large tile takes a while, in which others should not wait.
        let read = tokio::task::spawn_blocking(move || Tile::read(&content, &ids)).await;
        let unreadable =
            |why: String| JobStoreError::Stored { what: "tile of a city", value: format!("{path}: {why}") };
        let tile = read.map_err(|e| unreadable(e.to_string()))?.map_err(|e| unreadable(e.to_string()))?;
        tiles.insert(name.to_owned(), tile);
    }
    Ok(tiles)
}

/// One building a line, after a line with what they have in common; nothing if there are none.
fn sequence(tiles: &BTreeMap<String, Tile>, buildings: &[CityBuilding]) -> Response {
    let mut text = String::new();
    if let Some((header, base)) = Tile::header(tiles.values()) {
        text = format!("{header}\n");
        let features = buildings.iter().filter_map(|b| tiles.get(&b.tile)?.feature(&b.id, &base));
        features.for_each(|feature| text += &format!("{feature}\n"));
    }
    ([(header::CONTENT_TYPE, CITY_JSON_SEQ)], text).into_response()
}

fn collection(generation: &Generation, tiles: &BTreeMap<String, Tile>, buildings: &[CityBuilding]) -> Value {
    let features: Vec<Value> = buildings.iter().map(|b| feature(tiles.get(&b.tile), b)).collect();
    json!({ "type": "FeatureCollection", "crs": crs(&generation.crs), "generation": generation.number,
        "numberReturned": features.len(), "features": features })
}

/// A building as a GeoJSON feature: its footprint, and its attributes beside what the city's index has of it.
fn feature(tile: Option<&Tile>, building: &CityBuilding) -> Value {
    let mut properties: Map<String, Value> = serde_json::from_str(&building.attributes).unwrap_or_default();
    properties.insert("lod".to_owned(), building.lod.clone().into());
    properties.insert("tile".to_owned(), building.tile.clone().into());
    properties.insert("height_m".to_owned(), building.height.into());
    properties.insert("area_m2".to_owned(), building.area.into());
    if let Some(roof) = &building.roof_type {
        properties.insert("roof_type".to_owned(), roof.clone().into());
    }
    let geometry = tile.and_then(|tile| tile.footprint(&building.id));
    let geometry = geometry.map(|coordinates| json!({ "type": "MultiPolygon", "coordinates": coordinates }));
    json!({ "type": "Feature", "id": building.id, "bbox": building.bbox, "geometry": geometry, "properties": properties })
}

/// GeoJSON's member for coordinates that are not degrees; null says that the system is not known.
fn crs(name: &str) -> Value {
    match name.strip_prefix("EPSG:") {
        Some(code) => json!({ "type": "name", "properties": { "name": format!("urn:ogc:def:crs:EPSG::{code}") } }),
        None => Value::Null,
    }
}

fn geo_json(value: &Value) -> Response {
    ([(header::CONTENT_TYPE, GEO_JSON)], value.to_string()).into_response()
}

/// The address of the page after a building, of the same generation.
fn next_page(city: &str, address: &Uri, generation: i64, after: &str) -> String {
    let kept = address.query().unwrap_or_default().split('&');
    let kept = kept.filter(|p| !p.is_empty() && !p.starts_with("after=") && !p.starts_with("generation="));
    let query: Vec<String> = kept
        .map(str::to_owned)
        .chain([format!("generation={generation}"), format!("after={}", escaped(after))])
        .collect();
    format!("/api/v1/cities/{}/buildings?{}", escaped(city), query.join("&"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_form_is_what_is_accepted_first() {
        let accept = |text: &'static str| {
            let mut headers = HeaderMap::new();
            headers.insert(header::ACCEPT, HeaderValue::from_static(text));
            form(None, &headers).map_err(|p| p.status)
        };
        assert_eq!(form(None, &HeaderMap::new()), Ok(Form::GeoJson));
        assert_eq!(accept("*/*"), Ok(Form::GeoJson));
        assert_eq!(accept("application/city+json-seq;q=0.9, */*;q=0.1"), Ok(Form::CityJsonSeq));
        assert_eq!(accept("text/html"), Err(406));
        assert_eq!(form(Some(Form::CityJsonSeq), &HeaderMap::new()), Ok(Form::CityJsonSeq));
    }

    #[test]
    fn the_next_page_keeps_the_question() {
        let address = "/buildings?min_height=3&after=a&limit=2".parse().unwrap();
        let next = next_page("delft", &address, 4, "b/1 2");
        assert_eq!(next, "/api/v1/cities/delft/buildings?min_height=3&limit=2&generation=4&after=b%2F1%202");
    }
}
