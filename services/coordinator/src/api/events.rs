//! What happened to a job: as pages for polling, and as a stream.

use super::jobs::stage_name;
use crate::pages::time;
use crate::{Caller, Coordinator, Problem};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::sse::{Event as Message, KeepAlive, Sse};
use axum::routing::get;
use axum::{Json, Router};
use futures_util::stream::{self, Stream};
use gable_job_store::{Event, JobStoreError};
use serde::{Deserialize, Serialize};
use std::time::Duration;
use utoipa::{IntoParams, ToSchema};

/// How often a stream looks for new events.
const PACE: Duration = Duration::from_millis(500);

/// Most events that a stream reads at once.
const BATCH: i64 = 500;

/// Something that happened to a job.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct EventView {
    /// Number within the job, from 1, without gaps.
    number: i64,
    /// When, RFC 3339.
    at: String,
    /// submitted, state, stage, claimed, done, reused, retry, failed or priority.
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
        (status = 400, description = "The query does not hold", body = Problem, content_type = "application/problem+json"),
        (status = 401, description = "No valid token", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    _: Caller,
    Path(id): Path<String>,
    query: Result<Query<EventQuery>, QueryRejection>,
) -> Result<Json<Vec<EventView>>, Problem> {
    let Query(query) = query?;
    let (since, limit) = (query.since.unwrap_or(0), query.limit.unwrap_or(service.limits.page.min(100)));
    if since < 0 || !(1..=service.limits.page).contains(&limit) {
        let detail = format!("since has to be 0 or more, limit 1 to {}", service.limits.page);
        return Err(Problem::new(StatusCode::BAD_REQUEST, "query", "The query cannot be read", detail));
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
    _: Caller,
    headers: HeaderMap,
    Path(id): Path<String>,
) -> Result<Sse<impl Stream<Item = Result<Message, JobStoreError>>>, Problem> {
    service.store.job(&id).await?;
    let last = headers.get("last-event-id").and_then(|v| v.to_str().ok()).and_then(|v| v.parse().ok()).unwrap_or(0);
    let begin = Follow { service, id, last, waiting: Vec::new(), first: true };
    Ok(Sse::new(stream::try_unfold(begin, Follow::next)).keep_alive(KeepAlive::default()))
}

/// A client that follows a job.
struct Follow {
    service: Coordinator,
    id: String,
    last: i64,
    /// Events that were read and not yet sent, newest first.
    waiting: Vec<Event>,
    first: bool,
}

impl Follow {
    async fn next(mut self) -> Result<Option<(Message, Self)>, JobStoreError> {
        loop {
            if let Some(event) = self.waiting.pop() {
                self.last = event.number;
                let view = EventView::of(event);
                let message = Message::default().id(view.number.to_string()).event(view.kind);
                let message = message.json_data(&view).unwrap_or_else(|_| Message::default().comment("unreadable"));
                return Ok(Some((message, self)));
            }
            if !self.first {
                tokio::time::sleep(PACE).await;
            }
            self.first = false;
            // Asked before the events: a job that was over then has no event that the next line could miss.
            let over = self.service.store.job(&self.id).await?.state.is_over();
            self.waiting = self.service.store.events(&self.id, self.last, BATCH).await?;
            self.waiting.reverse();
            if over && self.waiting.is_empty() {
                return Ok(None);
            }
            self.first = over;
        }
    }
}
