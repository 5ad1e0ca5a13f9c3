//! Whether the service is there, and whether it can work.

use crate::problem::Refused;
use crate::{Coordinator, Problem};
use axum::extract::State;

/// The service is there
#[utoipa::path(get, path = "/healthz", tag = "service", security(()), responses((status = 200, description = "It is", body = String)))]
pub(crate) async fn alive() -> &'static str {
    "ok\n"
}

/// The service can work: its database answers
#[utoipa::path(
    get, path = "/readyz", tag = "service", security(()),
    responses(
        (status = 200, description = "It can", body = String),
        Refused<503>,
    )
)]
pub(crate) async fn ready(State(service): State<Coordinator>) -> Result<&'static str, Problem> {
    service.store.ping().await?;
    Ok("ok\n")
}
