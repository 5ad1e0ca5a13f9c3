//! What happened to a job: as pages for polling, and as a stream.

use super::jobs::stage_name;
use crate::extract::Query;
use crate::pages::{limit, time};
use crate::problem::Refused;
use crate::rights::OfJob;
use crate::{Coordinator, Problem};
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::sse::{Event as Message, KeepAlive, Sse};
use axum::routing::get;
use axum::{Json, Router};
use futures_util::stream::{self, Stream};
use gable_job_store::{Event, JobStoreError};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use utoipa::{IntoParams, ToSchema};

/// Something that happened to a job.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct EventView {
    /// Number within the job, from 1, without gaps.
    number: i64,
    /// When, RFC 3339.
    at: String,
    /// submitted, state, stage, claimed, done, reused, retry, failed, waiting, priority, published, unchanged or withheld.
    #[schema(example = "done")]
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    stage: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
}

impl EventView {
    fn of(event: Event) -> Self {
        Self {
            number: event.number,
            at: time(event.at),
            kind: event.kind.name(),
            stage: event.stage.map(stage_name),
            unit: event.unit,
            message: event.message,
        }
    }
}

/// Which events.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EventQuery {
    /// Only those after this number.
    #[param(minimum = 0, default = 0)]
    since: Option<i64>,
    /// Most events in the answer.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// The events of a job, oldest first
///
/// `/jobs/{id}/events/stream` sends the same as server-sent events, from the start or from after `Last-Event-ID`, until the
/// job is over.
#[utoipa::path(
    get, path = "/jobs/{id}/events", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job"), EventQuery),
    responses(
        (status = 200, description = "The events", body = Vec<EventView>),
        Refused<404>,
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: OfJob,
    Path(id): Path<String>,
    Query(query): Query<EventQuery>,
) -> Result<Json<Vec<EventView>>, Problem> {
    let (since, limit) = (query.since.unwrap_or(0), limit(query.limit, service.limits.page)?);
    if since < 0 {
        return Err(Problem::query("since has to be 0 or more"));
    }
    service.store.job(&id).await?;
    let events = service.store.events(&id, since, limit).await?;
    Ok(Json(events.into_iter().map(EventView::of).collect()))
}

/// The route of the stream: apart from the others, for it has no time limit.
pub(super) fn stream_router() -> Router<Coordinator> {
    Router::new().route("/api/v1/jobs/{id}/events/stream", get(follow))
}

async fn follow(
    State(service): State<Coordinator>,
    _: OfJob,
    headers: HeaderMap,
    Path(id): Path<String>,
) -> Result<Sse<impl Stream<Item = Result<Message, JobStoreError>>>, Problem> {
    let last = headers.get("last-event-id").and_then(|v| v.to_str().ok()).and_then(|v| v.parse().ok()).unwrap_or(0);
    let follower = service.feed.follow(&service.store, &id, last).await?;
    let messages = stream::try_unfold((follower, VecDeque::new()), |(mut follower, mut waiting)| async {
        if waiting.is_empty() {
            waiting.extend(follower.next().await?.unwrap_or_default());
        }
        Ok(waiting.pop_front().map(|event| (message(event), (follower, waiting))))
    });
    Ok(Sse::new(messages).keep_alive(KeepAlive::default()))
}

fn message(event: Event) -> Message {
    let view = EventView::of(event);
    let message = Message::default().id(view.number.to_string()).event(view.kind);
    message.json_data(&view).unwrap_or_else(|_| Message::default().comment("unreadable"))
}
