//! Who signs in at the dashboard: whether anybody can, and the end of somebody's sessions.

use crate::{Caller, Coordinator, PERSON, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use gable_job_store::Scope;
use serde::Serialize;
use utoipa::ToSchema;

/// How people come in.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct SignInView {
    /// Host of the provider at which people sign in, by `auth/login`; absent if the service takes tokens only.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "id.example.org")]
    provider: Option<String>,
}

/// Show how people sign in
#[utoipa::path(
    get, path = "/sign-in", tag = "service", security(()),
    responses((status = 200, description = "Whether they do, and where", body = SignInView))
)]
pub(crate) async fn sign_in(State(service): State<Coordinator>) -> Json<SignInView> {
    Json(SignInView { provider: service.sign_in.as_ref().map(|sign_in| sign_in.name()) })
}

/// End all sessions of somebody who has signed in
///
/// For operators: of somebody who is to be let in no more, once the provider knows. Links that they have made end as well.
#[utoipa::path(
    delete, path = "/sessions/{name}", tag = "service",
    params(("name" = String, Path, description = "As jobs and the audit log name them: user:NAME")),
    responses(
        (status = 204, description = "They have to sign in again"),
        crate::problem::Refused<404>,
    )
)]
pub(crate) async fn end(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(name): Path<String>,
) -> Result<StatusCode, Problem> {
    caller.needs(Scope::Operator)?;
    if !name.starts_with(PERSON) || service.store.remove_sessions_of(&name).await? == 0 {
        return Err(Problem::not_found(format!("{name:?} is not signed in: people are named {PERSON}NAME")));
    }
    Ok(StatusCode::NO_CONTENT)
}
