//! Who asks: for pages that show only what a caller may do.

use crate::pages::time;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::State;
use serde::Serialize;
use utoipa::ToSchema;

/// Who asks.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct CallerView {
    /// Name of the token; `user:NAME` for somebody who has signed in; `local` for a caller without either at a service that is open.
    #[schema(example = "ann")]
    name: String,
    /// viewer, submitter or operator.
    #[schema(example = "submitter")]
    scope: &'static str,
    /// Whether the service asks for tokens.
    tokens: bool,
    /// Whether the caller has signed in, rather than shown a token.
    signed_in: bool,
    /// When what was shown ends, RFC 3339; absent for never.
    #[serde(skip_serializing_if = "Option::is_none")]
    ends: Option<String>,
}

/// Show who asks, and what they may do
#[utoipa::path(
    get, path = "/caller", tag = "service",
    responses((status = 200, description = "The caller", body = CallerView))
)]
pub(crate) async fn show(State(service): State<Coordinator>, caller: Caller) -> Result<Json<CallerView>, Problem> {
    let tokens = !service.open || service.store.has_tokens().await?;
    let Caller { name, scope, signed_in, ends, .. } = caller;
    Ok(Json(CallerView { name, scope: scope.name(), tokens, signed_in, ends: ends.map(time) }))
}
