//! Removing jobs, generations and cities for good.

use super::members::owned;
use crate::extract::Query;
use crate::pages::removed;
use crate::problem::Refused;
use crate::rights::{OfCity, OfJob};
use crate::{Coordinator, Problem};
use axum::extract::{Path, State};
use axum::http::StatusCode;
use serde::Deserialize;
use utoipa::IntoParams;

/// Whether it is meant.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct Confirmation {
    /// The name of the city once more.
    confirm: Option<String>,
}

/// Delete a job that is over, with its events, logs and result; what it published stays
#[utoipa::path(
    delete, path = "/jobs/{id}", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    responses((status = 204, description = "Gone"), Refused<404>, Refused<409>)
)]
pub(crate) async fn job(
    State(service): State<Coordinator>,
    OfJob(caller): OfJob,
    Path(id): Path<String>,
) -> Result<StatusCode, Problem> {
    let job = service.steered_job(&caller, &id).await?;
    service.store.delete_job(&id).await?;
    tracing::info!(job = job.id, city = job.city, by = caller.name, "job deleted");
    Ok(StatusCode::NO_CONTENT)
}

/// Delete a generation of a city that readers do not see
///
/// For the city's owners.
#[utoipa::path(
    delete, path = "/cities/{city}/generations/{number}", tag = "cities",
    params(
        ("city" = String, Path, description = "Name of the city"),
        ("number" = i64, Path, description = "Number of the generation"),
    ),
    responses((status = 204, description = "Gone"), Refused<404>, Refused<409>)
)]
pub(crate) async fn generation(
    State(service): State<Coordinator>,
    OfCity(caller): OfCity,
    Path((city, number)): Path<(String, i64)>,
) -> Result<StatusCode, Problem> {
    owned(&service, &caller, &city).await?;
    let was_there = service.store.delete_generation(&city, number).await?;
    if was_there {
        tracing::info!(city, generation = number, by = caller.name, "generation deleted");
    }
    removed(was_there, || Problem::not_found(format!("{city:?} has no generation {number}")))
}

/// Delete a city with its generations, jobs and members
///
/// For its owners, and only with its name as `confirm`. Files that were uploaded for it stay with who has sent them.
#[utoipa::path(
    delete, path = "/cities/{city}", tag = "cities",
    params(("city" = String, Path, description = "Name of the city"), Confirmation),
    responses((status = 204, description = "Gone"), Refused<404>, Refused<409>, Refused<422>)
)]
pub(crate) async fn city(
    State(service): State<Coordinator>,
    OfCity(caller): OfCity,
    Path(city): Path<String>,
    Query(Confirmation { confirm }): Query<Confirmation>,
) -> Result<StatusCode, Problem> {
    owned(&service, &caller, &city).await?;
    if confirm.as_ref() != Some(&city) {
        return Err(Problem::invalid("to delete a city with all it has, give its name as confirm"));
    }
    let was_there = service.store.delete_city(&city).await?;
    if was_there {
        tracing::warn!(city, by = caller.name, "city deleted");
    }
    removed(was_there, || Problem::not_found(format!("there is no city {city:?}")))
}
