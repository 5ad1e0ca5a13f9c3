//! The API under `/api/v1`, and its description.

mod audit;
mod blocks;
mod buildings;
mod caller;
mod cities;
mod city_files;
mod completion;
mod dashboard;
mod events;
mod failures;
mod files;
mod health;
pub(crate) mod jobs;
mod links;
mod map;
mod members;
mod metrics;
mod parameters;
mod parts;
mod removal;
mod schedules;
mod seams;
mod sessions;
mod uploads;
mod webhooks;
mod workers;

pub use parameters::FOR_THE_VIEWER;
pub(crate) use uploads::{no_room, too_large};

pub(crate) use jobs::first_task;
pub(crate) use schedules::read_request;

use crate::base::Base;
use crate::problem::{in_one_form, refused_anyway};
use crate::{Coordinator, Problem};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};
use std::any::Any;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::limit::RequestBodyLimitLayer;
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::TimeoutLayer;
use utoipa::OpenApi;
use utoipa::openapi::OpenApi as Document;
use utoipa::openapi::Server;
use utoipa::openapi::path::Operation;
use utoipa::openapi::security::{Http, HttpAuthScheme, SecurityRequirement, SecurityScheme};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::{Config, SwaggerUi};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "gable",
        description = "From the mesh of a city to its buildings: jobs, their blocks, events and results.",
        license(name = "MIT", identifier = "MIT"),
    ),
    components(schemas(Problem)),
    tags(
        (name = "cities", description = "What readers see: cities, their members, generations, buildings, tiles and files"),
        (name = "jobs", description = "Submitting and steering"),
        (name = "results", description = "What a job made"),
        (name = "uploads", description = "Meshes that are sent"),
        (name = "schedules", description = "Jobs by the clock"),
        (name = "webhooks", description = "Who is told of what happens"),
        (name = "service", description = "The service itself"),
    )
)]
struct Description;

/// All routes, with limits on what a request may take.
pub fn router(service: Coordinator) -> Router {
    let limits = service.limits;
    let (bounded, mut document) = routes().split_for_parts();
    let (uploads, of_uploads) = upload_routes().split_for_parts();
    document.merge(of_uploads);
    bounded
        .merge(crate::ogc::router())
        .merge(crate::sign_in::router())
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, limits.time))
        // A stream of events is as long as its job, so it has no time limit.
        .merge(events::stream_router())
        .merge(dashboard::router())
        .merge(docs(document))
        .fallback(|| async { Problem::not_found("no such address: /docs lists all") })
        .method_not_allowed_fallback(|| async {
            Problem::new(
                StatusCode::METHOD_NOT_ALLOWED,
                "method",
                "This address does not take this method",
                "/docs lists what each address takes",
            )
        })
        .layer(RequestBodyLimitLayer::new(limits.body))
        .merge(uploads.layer(axum::extract::DefaultBodyLimit::disable()))
        .layer(axum::middleware::map_response(in_one_form))
        .layer(CompressionLayer::new())
        .layer(CatchPanicLayer::custom(after_panic))
        .layer(axum::middleware::map_response(crate::headers::guard))
        .layer(axum::middleware::from_fn(crate::extract::without_nul))
        .layer(axum::middleware::from_fn_with_state(service.clone(), crate::audit::note))
        .layer(crate::cors::layer(&service.origins))
        .layer(axum::middleware::from_fn(crate::access::log))
        .layer(axum::middleware::from_fn_with_state(service.clone(), crate::visitor::look))
        .with_state(service)
}

/// The description of the API, and the pages that show it. Its addresses are relative, or begin with what a proxy takes away.
fn docs(document: Document) -> Router<Coordinator> {
    let pages: Router<Coordinator> = SwaggerUi::new("/docs").config(Config::new(["../api/v1/openapi.json"])).into();
    let policy = SetResponseHeaderLayer::overriding(
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static(crate::headers::DOCS),
    );
    let description = async move |base: Base| {
        let mut document = document.clone();
        if !base.prefix().is_empty() {
            document.servers = Some(vec![Server::new(base.prefix())]);
        }
        Json(document)
    };
    pages.layer(policy).route("/api/v1/openapi.json", get(description))
}

/// What supervisors ask, for a listener of its own: it answers though that of the API has as many connections as it takes. Whoever reaches
/// it sees the figures without a token.
pub fn probes(service: Coordinator) -> Router {
    let time = TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, service.limits.time);
    Router::new()
        .route("/healthz", get(health::alive))
        .route("/readyz", get(health::ready))
        .route("/metrics", get(metrics::without_token))
        .fallback(|| async { Problem::not_found("this listener has /healthz, /readyz and /metrics") })
        .layer(time)
        .layer(RequestBodyLimitLayer::new(0))
        .layer(axum::middleware::map_response(in_one_form))
        .layer(axum::middleware::map_response(crate::headers::guard))
        .with_state(service)
}

/// The OpenAPI document.
#[must_use]
pub fn document() -> Document {
    let mut document = routes().split_for_parts().1;
    document.merge(upload_routes().split_for_parts().1);
    document
}

/// What takes large bodies: with limits of its own for size and time.
fn upload_routes() -> OpenApiRouter<Coordinator> {
    let v1 = OpenApiRouter::new()
        .routes(routes!(uploads::receive, uploads::put, uploads::list))
        .routes(routes!(uploads::remove))
        .routes(routes!(parts::open, parts::list))
        .routes(routes!(parts::show, parts::abort))
        .routes(routes!(parts::put))
        .routes(routes!(completion::complete));
    with_refusals(OpenApiRouter::new().nest("/api/v1", v1))
}

/// Adds to the description of each operation what any may answer.
fn with_refusals(mut router: OpenApiRouter<Coordinator>) -> OpenApiRouter<Coordinator> {
    // OpenAPI has no sign for a path of several parts.
    let paths = &mut router.get_openapi_mut().paths.paths;
    *paths = std::mem::take(paths).into_iter().map(|(path, item)| (path.replace("{*", "{"), item)).collect();
    for operation in operations(router.get_openapi_mut()) {
        for (status, response) in refused_anyway() {
            operation.responses.responses.entry(status).or_insert(response);
        }
    }
    router
}

fn routes() -> OpenApiRouter<Coordinator> {
    let mut description = Description::openapi();
    let bearer = SecurityScheme::Http(Http::new(HttpAuthScheme::Bearer));
    description.components.get_or_insert_default().security_schemes.insert("token".to_owned(), bearer.into());
    description.security = Some(vec![SecurityRequirement::new("token", [""; 0])]);
    let v1 = OpenApiRouter::new()
        .routes(routes!(jobs::submit, jobs::list))
        .routes(routes!(jobs::show, removal::job))
        .routes(routes!(jobs::cancel))
        .routes(routes!(jobs::pause))
        .routes(routes!(jobs::resume))
        .routes(routes!(jobs::retry))
        .routes(routes!(jobs::set_priority))
        .routes(routes!(blocks::list))
        .routes(routes!(blocks::log))
        .routes(routes!(links::of_city))
        .routes(routes!(links::of_job))
        .routes(routes!(links::content))
        .routes(routes!(links::end_all))
        .routes(routes!(map::show))
        .routes(routes!(map::picture))
        .routes(routes!(seams::list))
        .routes(routes!(events::list))
        .routes(routes!(files::list))
        .routes(routes!(files::content))
        .routes(routes!(cities::list))
        .routes(routes!(cities::show, removal::city))
        .routes(routes!(cities::generations))
        .routes(routes!(cities::generation, removal::generation))
        .routes(routes!(cities::changes))
        .routes(routes!(members::list))
        .routes(routes!(members::put, members::remove))
        .routes(routes!(members::roll_back))
        .routes(routes!(audit::list))
        .routes(routes!(buildings::list))
        .routes(routes!(buildings::show))
        .routes(routes!(city_files::tiles))
        .routes(routes!(city_files::list))
        .routes(routes!(city_files::content))
        .routes(routes!(parameters::list))
        .routes(routes!(schedules::list))
        .routes(routes!(schedules::show, schedules::put, schedules::remove))
        .routes(routes!(schedules::run))
        .routes(routes!(schedules::runs))
        .routes(routes!(webhooks::list, webhooks::create))
        .routes(routes!(webhooks::remove))
        .routes(routes!(webhooks::messages))
        .routes(routes!(workers::list))
        .routes(routes!(sessions::sign_in))
        .routes(routes!(sessions::end))
        .routes(routes!(caller::show));
    let all = OpenApiRouter::with_openapi(description).nest("/api/v1", v1).routes(routes!(metrics::show));
    with_refusals(all).routes(routes!(health::alive)).routes(routes!(health::ready))
}

/// All operations of a description.
fn operations(document: &mut Document) -> impl Iterator<Item = &mut Operation> {
    document.paths.paths.values_mut().flat_map(|path| {
        [&mut path.get, &mut path.put, &mut path.post, &mut path.delete].into_iter().filter_map(Option::as_mut)
    })
}

fn after_panic(cause: Box<dyn Any + Send + 'static>) -> Response {
    let text = cause.downcast_ref::<String>().map(String::as_str).or_else(|| cause.downcast_ref::<&str>().copied());
    tracing::error!(cause = text.unwrap_or("unknown"), "a request handler panicked");
    let detail = "this is a fault of the service; its log tells more";
    Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "internal", "The service failed", detail).into_response()
}
