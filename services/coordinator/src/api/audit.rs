//! Who did what.

use super::members::owned;
use crate::extract::Query;
use crate::pages::{limit, page, time};
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::State;
use gable_job_store::{AuditEntry, AuditFilter, Scope};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// Something that was done, or was to be done and was refused.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct AuditView {
    id: String,
    /// RFC 3339.
    at: String,
    /// Name of the token.
    who: String,
    /// From where, as far as it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    address: Option<String>,
    /// Method and kind of address.
    #[schema(example = "POST /api/v1/jobs/{id}/cancel")]
    action: String,
    /// The address itself; that of the folder for tiles.
    target: String,
    /// HTTP status of the answer: from 400 on it was refused.
    status: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    city: Option<String>,
    /// What was made, if something was.
    #[serde(skip_serializing_if = "Option::is_none")]
    made: Option<String>,
    /// How often, within a few seconds.
    times: i64,
}

impl AuditView {
    fn of(entry: AuditEntry) -> Self {
        let AuditEntry { id, at, who, address, action, target, status, city, made, times } = entry;
        Self { id, at: time(at), who, address, action, target, status, city, made, times }
    }
}

/// A page of the audit log.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct AuditPage {
    /// Newest first.
    entries: Vec<AuditView>,
    /// Give it as `before` for the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

/// Which entries.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct AuditQuery {
    /// Only of this name.
    who: Option<String>,
    /// Only about this city.
    city: Option<String>,
    /// Only those before this entry.
    before: Option<String>,
    /// Most entries on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// Who did, steered and downloaded what, newest first
///
/// For operators; that of one city also for its owners.
#[utoipa::path(
    get, path = "/audit", tag = "service", params(AuditQuery),
    responses((status = 200, description = "A page", body = AuditPage))
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    caller: Caller,
    Query(query): Query<AuditQuery>,
) -> Result<Json<AuditPage>, Problem> {
    match &query.city {
        Some(city) if caller.scope < Scope::Operator => owned(&service, &caller, city).await?,
        _ => caller.needs(Scope::Operator)?,
    }
    let limit = limit(query.limit, service.limits.page)?;
    service.gathered.write(&service).await?;
    let filter = AuditFilter { who: query.who, city: query.city, before: query.before };
    let found = service.store.audit(&filter, limit + 1).await?;
    let (entries, next) = page(found, limit, |entry| entry.id.clone(), AuditView::of);
    Ok(Json(AuditPage { entries, next }))
}
