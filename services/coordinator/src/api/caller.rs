//! Who asks: for pages that show only what a caller may do.

use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::State;
use serde::Serialize;
use utoipa::ToSchema;

/// Who asks.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct CallerView {
    /// Name of the token; `local` for a caller without one at a service that is open.
    #[schema(example = "ann")]
    name: String,
    /// viewer, submitter or operator.
    #[schema(example = "submitter")]
    scope: &'static str,
    /// Whether the service asks for tokens.
    tokens: bool,
}

/// Show who asks, and what they may do
#[utoipa::path(
    get, path = "/caller", tag = "service",
    responses((status = 200, description = "The caller", body = CallerView))
)]
pub(crate) async fn show(State(service): State<Coordinator>, caller: Caller) -> Result<Json<CallerView>, Problem> {
    let tokens = !service.open || service.store.has_tokens().await?;
    Ok(Json(CallerView { scope: caller.scope.name(), name: caller.name, tokens }))
}
