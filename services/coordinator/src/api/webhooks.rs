//! Webhooks: who is told of what happens.

use crate::extract::Body;
use crate::pages::{removed, time};
use crate::problem::Refused;
use crate::{Caller, Coordinator, Problem, outbound, webhooks};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::{Scope, Webhook, WebhookEvent, WebhookMessage};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, Type};

/// Messages that are shown of a webhook.
const SHOWN: i64 = 100;

/// Whom to tell of what.
#[derive(Clone, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "url": "https://example.com/hook", "events": ["city.published"], "city": "delft" }))]
pub(crate) struct WebhookRequest {
    /// Where messages are posted to: an address of the public internet, unless the service was started with `--private-webhooks`.
    #[schema(min_length = 1, max_length = 2000)]
    url: String,
    /// Of what; if not given, of everything but `job.progressed`, which tells each stage of each job.
    #[serde(default)]
    #[schema(schema_with = event_names)]
    events: Vec<WebhookEvent>,
    /// Only of this city.
    #[serde(default)]
    #[schema(max_length = 200)]
    city: Option<String>,
    /// `whsec_` and 24 to 64 bytes in base64, which sign the messages; made by the service if not given.
    #[serde(default)]
    #[schema(pattern = "^whsec_[A-Za-z0-9+/]+={0,2}$", max_length = 200)]
    secret: Option<String>,
}

/// The names of events.
fn event_names() -> utoipa::openapi::schema::Array {
    let names = WebhookEvent::ALL.iter().map(|event| event.name());
    let name = ObjectBuilder::new().schema_type(Type::String).enum_values(Some(names)).build();
    ArrayBuilder::new().items(name).build()
}

/// A webhook.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct WebhookView {
    id: String,
    /// Who asked for it.
    owner: String,
    url: String,
    /// None for all.
    #[schema(schema_with = event_names)]
    events: Vec<WebhookEvent>,
    #[serde(skip_serializing_if = "Option::is_none")]
    city: Option<String>,
    /// False after its receiver has answered 410: it is gone for good.
    enabled: bool,
    created: String,
    /// What signs the messages; only in the answer to its making.
    #[serde(skip_serializing_if = "Option::is_none")]
    secret: Option<String>,
}

impl WebhookView {
    fn of(webhook: Webhook, secret: bool) -> Self {
        Self {
            id: webhook.id,
            owner: webhook.owner,
            url: webhook.url,
            events: webhook.events,
            city: webhook.city,
            enabled: webhook.enabled,
            created: time(webhook.created),
            secret: secret.then_some(webhook.secret),
        }
    }
}

/// A message to a webhook.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct MessageView {
    /// As the header `webhook-id` has it.
    id: String,
    #[schema(example = "job.succeeded")]
    event: &'static str,
    /// waiting, delivered or failed.
    #[schema(example = "delivered")]
    state: &'static str,
    attempts: i64,
    /// What the last attempt came to.
    #[serde(skip_serializing_if = "Option::is_none")]
    answer: Option<String>,
    created: String,
    /// When it was delivered, or given up.
    #[serde(skip_serializing_if = "Option::is_none")]
    finished: Option<String>,
}

impl MessageView {
    fn of(message: WebhookMessage) -> Self {
        Self {
            id: message.id,
            event: message.event.name(),
            state: message.state.name(),
            attempts: message.attempts,
            answer: message.answer,
            created: time(message.created),
            finished: message.finished.map(time),
        }
    }
}

fn none(id: &str) -> Problem {
    Problem::not_found(format!("there is no webhook {id:?}"))
}

/// Have a receiver told of what happens
///
/// Messages are posted at least once, signed as <https://www.standardwebhooks.com> has it, and again after growing pauses, for two
/// days, until the receiver answers 2xx; 410 ends all.
#[utoipa::path(
    post, path = "/webhooks", tag = "webhooks", request_body = WebhookRequest,
    responses(
        (status = 201, description = "Made", body = WebhookView, headers(("Location" = String, description = "Where it is"))),
        Refused<413>,
        Refused<415>,
        Refused<422>,
    )
)]
pub(crate) async fn create(
    State(service): State<Coordinator>,
    caller: Caller,
    Body(wanted): Body<WebhookRequest>,
) -> Result<Response, Problem> {
    caller.needs(Scope::Operator)?;
    outbound::checked(&wanted.url, service.limits.private_webhooks)
        .map_err(|e| Problem::invalid(format!("url: {e}")))?;
    if wanted.city.as_ref().is_some_and(|c| c.len() > 200) {
        return Err(Problem::invalid("city has to have at most 200 bytes"));
    }
    let secret = match wanted.secret {
        Some(secret) if webhooks::key(&secret).is_none() => {
            return Err(Problem::invalid("secret has to be whsec_ and 24 to 64 bytes in base64"));
        }
        Some(secret) => secret,
        None => webhooks::new_secret().map_err(|e| {
            tracing::error!("no random bytes: {e}");
            let detail = "the system gives no random bytes: try again, or send a secret";
            Problem::new(StatusCode::SERVICE_UNAVAILABLE, "unavailable", "The service is not ready", detail)
        })?,
    };
    let mut events = wanted.events;
    events.sort_unstable();
    events.dedup();
    let webhook = Webhook {
        id: uuid::Uuid::now_v7().to_string(),
        owner: caller.name,
        url: wanted.url,
        secret,
        events,
        city: wanted.city,
        enabled: true,
        created: 0,
        callback: None,
    };
    service.store.add_webhook(&webhook).await?;
    let made = service.store.webhook(&webhook.id).await?.ok_or_else(|| none(&webhook.id))?;
    let place = format!("/api/v1/webhooks/{}", made.id);
    Ok((StatusCode::CREATED, [(header::LOCATION, place)], Json(WebhookView::of(made, true))).into_response())
}

/// List webhooks, oldest first
#[utoipa::path(
    get, path = "/webhooks", tag = "webhooks",
    responses(
        (status = 200, description = "All of them", body = Vec<WebhookView>),
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    caller: Caller,
) -> Result<Json<Vec<WebhookView>>, Problem> {
    caller.needs(Scope::Operator)?;
    let all = service.store.webhooks().await?;
    Ok(Json(all.into_iter().map(|w| WebhookView::of(w, false)).collect()))
}

/// Remove a webhook, with the messages that wait for it
#[utoipa::path(
    delete, path = "/webhooks/{id}", tag = "webhooks",
    params(("id" = String, Path, description = "Id of the webhook")),
    responses(
        (status = 204, description = "Removed"),
        Refused<404>,
    )
)]
pub(crate) async fn remove(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<StatusCode, Problem> {
    caller.needs(Scope::Operator)?;
    removed(service.store.remove_webhook(&id).await?, || none(&id))
}

/// The last messages to a webhook, newest first
#[utoipa::path(
    get, path = "/webhooks/{id}/messages", tag = "webhooks",
    params(("id" = String, Path, description = "Id of the webhook")),
    responses(
        (status = 200, description = "At most 100 of them", body = Vec<MessageView>),
        Refused<404>,
    )
)]
pub(crate) async fn messages(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<Json<Vec<MessageView>>, Problem> {
    caller.needs(Scope::Operator)?;
    service.store.webhook(&id).await?.ok_or_else(|| none(&id))?;
    let found = service.store.webhook_messages(&id, SHOWN).await?;
    Ok(Json(found.into_iter().map(MessageView::of).collect()))
}
