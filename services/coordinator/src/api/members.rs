//! The members of a city, and rolling it back.

use super::cities::GenerationView;
use crate::extract::Body;
use crate::names::{LONGEST, is_name};
use crate::problem::Refused;
use crate::rights::OfCity;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use gable_job_store::{Member, Role, Scope};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use utoipa::openapi::schema::{ObjectBuilder, Type};

/// A member of a city.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct MemberView {
    /// Name of a token, or `group:NAME` for all tokens of a group.
    #[schema(example = "ann")]
    name: String,
    /// viewer, editor or owner.
    #[schema(example = "editor")]
    role: &'static str,
}

impl MemberView {
    fn of(member: Member) -> Self {
        Self { name: member.name, role: member.role.name() }
    }
}

/// What a member is to be.
#[derive(Clone, Copy, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewRole {
    /// viewer looks; editor submits jobs and steers their own; owner steers all jobs, says who the members are, and rolls back.
    #[schema(schema_with = role_names)]
    role: Role,
}

fn role_names() -> utoipa::openapi::Object {
    let names = Role::ALL.iter().map(|role| role.name());
    ObjectBuilder::new().schema_type(Type::String).enum_values(Some(names)).build()
}

/// A generation to go back to.
#[derive(Clone, Copy, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Back {
    /// Its number.
    #[schema(minimum = 1)]
    generation: i64,
}

/// An error unless the caller owns the city, as a token that may submit.
pub(super) async fn owned(service: &Coordinator, caller: &Caller, city: &str) -> Result<(), Problem> {
    service.needs_role(caller, city, Role::Viewer).await?;
    caller.needs(Scope::Submitter)?;
    service.needs_role(caller, city, Role::Owner).await
}

/// The members of a city, by name
#[utoipa::path(
    get, path = "/cities/{city}/members", tag = "cities",
    params(("city" = String, Path, description = "Name of the city")),
    responses((status = 200, description = "All of them", body = Vec<MemberView>), Refused<404>)
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: OfCity,
    Path(city): Path<String>,
) -> Result<Json<Vec<MemberView>>, Problem> {
    if !service.store.is_claimed(&city).await? {
        return Err(unclaimed(&city));
    }
    Ok(Json(service.store.members(&city).await?.into_iter().map(MemberView::of).collect()))
}

/// Make someone a member of a city, or change what they may do
///
/// For its owners. A member is the name of a token, or `group:NAME` for all tokens of a group.
#[utoipa::path(
    put, path = "/cities/{city}/members/{member}", tag = "cities",
    params(
        ("city" = String, Path, description = "Name of the city"),
        ("member" = String, Path, description = "Name of a token, or group:NAME", max_length = 200),
    ),
    request_body = NewRole,
    responses(
        (status = 200, description = "The members afterwards", body = Vec<MemberView>),
        Refused<404>, Refused<409>, Refused<413>, Refused<415>, Refused<422>,
    )
)]
pub(crate) async fn put(
    State(service): State<Coordinator>,
    OfCity(caller): OfCity,
    Path((city, member)): Path<(String, String)>,
    Body(NewRole { role }): Body<NewRole>,
) -> Result<Json<Vec<MemberView>>, Problem> {
    owned(&service, &caller, &city).await?;
    if !is_name(&member) {
        let detail = format!(
            "the name of a member has 1 to {LONGEST} bytes, without control characters and marks that are not seen"
        );
        return Err(Problem::invalid(detail));
    }
    if !service.store.set_member(&city, &member, Some(role)).await? {
        return Err(unclaimed(&city));
    }
    Ok(Json(service.store.members(&city).await?.into_iter().map(MemberView::of).collect()))
}

/// Let someone be a member of a city no longer
///
/// For its owners; and for whoever wants to leave it.
#[utoipa::path(
    delete, path = "/cities/{city}/members/{member}", tag = "cities",
    params(
        ("city" = String, Path, description = "Name of the city"),
        ("member" = String, Path, description = "The member"),
    ),
    responses((status = 204, description = "No member any more"), Refused<404>, Refused<409>)
)]
pub(crate) async fn remove(
    State(service): State<Coordinator>,
    OfCity(caller): OfCity,
    Path((city, member)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    if member != caller.name {
        owned(&service, &caller, &city).await?;
    }
    let removed = service.store.set_member(&city, &member, None).await?;
    crate::pages::removed(removed, || Problem::not_found(format!("{member:?} is no member of {city:?}")))
}

/// Roll a city back to an earlier generation
///
/// For its owners. What that generation had is published anew, as the newest one: so a roll-back can be rolled back.
#[utoipa::path(
    post, path = "/cities/{city}/roll-back", tag = "cities",
    params(("city" = String, Path, description = "Name of the city")),
    request_body = Back,
    responses(
        (status = 200, description = "The generation that readers see now", body = GenerationView),
        Refused<404>, Refused<413>, Refused<415>, Refused<422>,
    )
)]
pub(crate) async fn roll_back(
    State(service): State<Coordinator>,
    OfCity(caller): OfCity,
    Path(city): Path<String>,
    Body(Back { generation }): Body<Back>,
) -> Result<Json<GenerationView>, Problem> {
    owned(&service, &caller, &city).await?;
    let none = || Problem::not_found(format!("{city:?} has no generation {generation}"));
    let number = service.store.roll_back(&city, generation).await?.ok_or_else(none)?;
    tracing::info!(city, to = generation, generation = number, by = caller.name, "city rolled back");
    Ok(Json(GenerationView::of(service.store.generation(&city, number).await?.ok_or_else(none)?)))
}

fn unclaimed(city: &str) -> Problem {
    Problem::not_found(format!("there is no city {city:?}: its first job makes it"))
}
