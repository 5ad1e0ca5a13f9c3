//! OGC API – Processes 1.0 (OGC 18-062r2) at `/ogc`, over the same jobs as `/api/v1`.
//!
//! Conformance classes: core, OGC process description, JSON, OpenAPI 3.0, job list, dismiss, callback. `city-model` runs
//! asynchronously, `echo` synchronously.

mod execution;
mod jobs;
mod processes;

use crate::base::Base;
use crate::{Caller, Coordinator, Problem};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde_json::{Value, json};

/// The description of these addresses, OpenAPI 3.0.
const OPENAPI: &str = include_str!("openapi.json");

/// What begins the names of OGC's exceptions.
macro_rules! exception {
    ($name:literal) => {
        concat!("http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/", $name)
    };
}

/// The routes.
pub(crate) fn router() -> Router<Coordinator> {
    Router::new()
        .route("/ogc", get(landing))
        .route("/ogc/", get(landing))
        .route("/ogc/conformance", get(conformance))
        .route("/ogc/api", get(description))
        .route("/ogc/processes", get(processes::list))
        .route("/ogc/processes/{process}", get(processes::show))
        .route("/ogc/processes/{process}/execution", post(execution::execute))
        .route("/ogc/jobs", get(jobs::list))
        .route("/ogc/jobs/{job}", get(jobs::show).delete(jobs::dismiss))
        .route("/ogc/jobs/{job}/results", get(jobs::results))
}

impl Base {
    /// A link to a place under `/ogc`.
    fn link(&self, path: &str, relation: &str, media_type: &str, title: &str) -> Value {
        json!({ "href": self.href(&format!("/ogc{path}")), "rel": relation, "type": media_type, "title": title })
    }
}

const JSON: &str = "application/json";

async fn landing(_: Caller, base: Base) -> Json<Value> {
    let relation = |name: &str| format!("http://www.opengis.net/def/rel/ogc/1.0/{name}");
    let openapi = "application/vnd.oai.openapi+json;version=3.0";
    Json(json!({
        "title": "gable",
        "description": "From the mesh of a city to its buildings",
        "links": [
            base.link("/", "self", JSON, "This document"),
            base.link("/api", "service-desc", openapi, "The API, in OpenAPI 3.0"),
            { "href": base.href("/docs"), "rel": "service-doc", "type": "text/html", "title": "The native API" },
            base.link("/conformance", &relation("conformance"), JSON, "Conformance classes"),
            base.link("/conformance", "conformance", JSON, "Conformance classes"),
            base.link("/processes", &relation("processes"), JSON, "The processes"),
            base.link("/processes", "processes", JSON, "The processes"),
            base.link("/jobs", &relation("job-list"), JSON, "The jobs"),
        ],
    }))
}

async fn conformance(_: Caller) -> Json<Value> {
    let names = ["core", "ogc-process-description", "json", "oas30", "job-list", "dismiss", "callback"];
    let classes = names.map(|name| format!("http://www.opengis.net/spec/ogcapi-processes-1/1.0/conf/{name}"));
    Json(json!({ "conformsTo": classes }))
}

async fn description(_: Caller, base: Base) -> Response {
    let own = OPENAPI.replacen(r#""url": "/ogc""#, &format!(r#""url": "{}/ogc""#, base.prefix()), 1);
    ([(header::CONTENT_TYPE, "application/vnd.oai.openapi+json;version=3.0")], own).into_response()
}

fn no_such_process(name: &str) -> Problem {
    let detail = format!("there is no process {name:?}: /ogc/processes lists all");
    Problem::new(StatusCode::NOT_FOUND, exception!("no-such-process"), "There is no such process", detail)
}

fn no_such_job(id: &str) -> Problem {
    let detail = format!("there is no job {id}: /ogc/jobs lists all");
    Problem::new(StatusCode::NOT_FOUND, exception!("no-such-job"), "There is no such job", detail)
}

pub(crate) use exception;
pub(crate) use jobs::callback;
