//! Cities, their generations, and what changed between these.

use crate::extract::Query;
use crate::pages::{limit, page, tagged, time};
use crate::problem::Refused;
use crate::rights::OfCity;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Response};
use gable_job_store::{City, Generation};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// A city.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct CityView {
    #[schema(example = "delft")]
    name: String,
    /// Number of the generation that readers see.
    #[serde(skip_serializing_if = "Option::is_none")]
    generation: Option<i64>,
    /// When it was first published, RFC 3339.
    created: String,
}

impl CityView {
    fn of(city: City) -> Self {
        Self { name: city.name, generation: city.generation, created: time(city.created) }
    }
}

/// A city with the generation that readers see.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct CityDetail {
    #[serde(flatten)]
    city: CityView,
    #[serde(skip_serializing_if = "Option::is_none")]
    current: Option<GenerationView>,
}

/// A page of cities.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct CityPage {
    /// By name.
    cities: Vec<CityView>,
    /// Give it as `after` for the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

/// A state of a city.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct GenerationView {
    /// From 1.
    number: i64,
    /// The job that made it.
    job: String,
    /// The earlier generation whose content it has anew, if the city was rolled back to that.
    #[serde(skip_serializing_if = "Option::is_none")]
    restored: Option<i64>,
    /// Whether blocks are missing.
    partial: bool,
    /// Reference system of the coordinates.
    #[schema(example = "EPSG:7415")]
    crs: String,
    /// When it was published, RFC 3339.
    made: String,
    /// How many buildings it has.
    buildings: i64,
    /// How many of them the generation before had not.
    added: i64,
    /// How many of the generation before are gone.
    removed: i64,
    /// How many have other geometries or attributes.
    changed: i64,
}

impl GenerationView {
    pub(super) fn of(generation: Generation) -> Self {
        let Generation { city: _, number, job, restored, partial, crs, made, buildings, added, removed, changed } =
            generation;
        Self { number, job, restored, partial, crs, made: time(made), buildings, added, removed, changed }
    }
}

/// A page of generations.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct GenerationPage {
    /// Newest first.
    generations: Vec<GenerationView>,
    /// Give it as `before` for the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<i64>,
}

/// Which cities.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct CityQuery {
    /// Only those whose names sort after this one.
    after: Option<String>,
    /// Most cities on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// Which generations.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct GenerationsQuery {
    /// Only those before this number.
    before: Option<i64>,
    /// Most generations on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// Between which generations.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ChangesQuery {
    /// The earlier generation; by default the one that is kept before `to`. 0 for nothing at all.
    #[param(minimum = 0)]
    from: Option<i64>,
    /// The later generation; by default the one that readers see.
    #[param(minimum = 0)]
    to: Option<i64>,
    /// Only buildings whose ids sort after this one.
    after: Option<String>,
    /// Most buildings on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// A building that two generations do not have in common.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct ChangeView {
    id: String,
    /// added, removed or changed.
    #[schema(example = "changed")]
    change: &'static str,
}

/// A page of changes.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct ChangePage {
    from: i64,
    to: i64,
    /// By id of the building.
    changes: Vec<ChangeView>,
    /// Give it as `after` for the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

/// The city that a request is about.
async fn found(service: &Coordinator, name: &str) -> Result<City, Problem> {
    service.store.city(name).await?.ok_or_else(|| Problem::not_found(format!("there is no city {name:?}")))
}

/// The generation of a city that a request is about: the one that it names, or the one that readers see.
pub(super) async fn chosen(service: &Coordinator, city: &str, number: Option<i64>) -> Result<Generation, Problem> {
    let number = number.or(found(service, city).await?.generation);
    let number = number.ok_or_else(|| Problem::not_found(format!("nothing of {city:?} was published yet")))?;
    let generation = service.store.generation(city, number).await?;
    generation.ok_or_else(|| Problem::not_found(format!("{city:?} has no generation {number}")))
}

/// List cities, by name
#[utoipa::path(
    get, path = "/cities", tag = "cities", params(CityQuery),
    responses((status = 200, description = "A page", body = CityPage))
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    caller: Caller,
    Query(query): Query<CityQuery>,
) -> Result<Json<CityPage>, Problem> {
    let limit = limit(query.limit, service.limits.page)?;
    let found = service.store.cities(caller.sees().as_deref(), query.after.as_deref(), limit + 1).await?;
    let (cities, next) = page(found, limit, |c| c.name.clone(), CityView::of);
    Ok(Json(CityPage { cities, next }))
}

/// Show a city and the generation that readers see
///
/// To poll it, send the ETag of the last answer as If-None-Match: nothing new is answered by 304.
#[utoipa::path(
    get, path = "/cities/{city}", tag = "cities",
    params(("city" = String, Path, description = "Name of the city")),
    responses(
        (status = 200, description = "The city", body = CityDetail, headers(("ETag" = String, description = "Its generation"))),
        (status = 304, description = "Nothing new"),
        Refused<404>,
    )
)]
pub(crate) async fn show(
    State(service): State<Coordinator>,
    _: OfCity,
    headers: HeaderMap,
    Path(name): Path<String>,
) -> Result<Response, Problem> {
    let city = found(&service, &name).await?;
    let current = match city.generation {
        Some(number) => service.store.generation(&name, number).await?.map(GenerationView::of),
        None => None,
    };
    let state = city.generation.unwrap_or(0).to_string();
    let detail = CityDetail { city: CityView::of(city), current };
    Ok(tagged(&headers, &state, || Json(detail).into_response()))
}

/// The generations of a city, newest first
#[utoipa::path(
    get, path = "/cities/{city}/generations", tag = "cities",
    params(("city" = String, Path, description = "Name of the city"), GenerationsQuery),
    responses((status = 200, description = "A page", body = GenerationPage), Refused<404>)
)]
pub(crate) async fn generations(
    State(service): State<Coordinator>,
    _: OfCity,
    Path(name): Path<String>,
    Query(query): Query<GenerationsQuery>,
) -> Result<Json<GenerationPage>, Problem> {
    let limit = limit(query.limit, service.limits.page)?;
    found(&service, &name).await?;
    let all = service.store.generations(&name, query.before, limit + 1).await?;
    let (generations, next) = page(all, limit, |g| g.number, GenerationView::of);
    Ok(Json(GenerationPage { generations, next }))
}

/// Show a generation of a city
#[utoipa::path(
    get, path = "/cities/{city}/generations/{number}", tag = "cities",
    params(
        ("city" = String, Path, description = "Name of the city"),
        ("number" = i64, Path, description = "Number of the generation"),
    ),
    responses((status = 200, description = "The generation", body = GenerationView), Refused<404>)
)]
pub(crate) async fn generation(
    State(service): State<Coordinator>,
    _: OfCity,
    Path((name, number)): Path<(String, i64)>,
) -> Result<Json<GenerationView>, Problem> {
    Ok(Json(GenerationView::of(chosen(&service, &name, Some(number)).await?)))
}

/// The buildings that two generations of a city do not have in common
#[utoipa::path(
    get, path = "/cities/{city}/changes", tag = "cities",
    params(("city" = String, Path, description = "Name of the city"), ChangesQuery),
    responses((status = 200, description = "A page", body = ChangePage), Refused<404>)
)]
pub(crate) async fn changes(
    State(service): State<Coordinator>,
    _: OfCity,
    Path(name): Path<String>,
    Query(query): Query<ChangesQuery>,
) -> Result<Json<ChangePage>, Problem> {
    let limit = limit(query.limit, service.limits.page)?;
    // Before the first generation there is nothing, which may be compared with as well.
    let of = async |number: Option<i64>| match number {
        Some(0) => Ok(0),
        number => chosen(&service, &name, number).await.map(|g| g.number),
    };
    let to = of(query.to).await?;
    let from = match query.from {
        Some(from) => of(Some(from)).await?,
        // Those between may have been removed.
        None => service.store.generations(&name, Some(to), 1).await?.first().map_or(0, |before| before.number),
    };
    if from == 0 && to == 0 {
        chosen(&service, &name, None).await?;
    }
    let all = service.store.changes(&name, from, to, query.after.as_deref(), limit + 1).await?;
    let (changes, next) = page(all, limit, |c| c.id.clone(), |c| ChangeView { id: c.id, change: c.kind.name() });
    Ok(Json(ChangePage { from, to, changes, next }))
}
