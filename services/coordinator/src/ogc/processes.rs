//! The processes and their descriptions.

use super::{JSON, no_such_process};
use crate::base::Base;
use crate::extract::Query;
use crate::pages::limit;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use gable_pipeline::params::PRESETS;
use serde::Deserialize;
use serde_json::{Value, json};

/// Makes or refreshes a city.
pub(super) const CITY_MODEL: &str = "city-model";

/// Gives its inputs back, so that clients can be tried out.
pub(super) const ECHO: &str = "echo";

/// The inputs of [`ECHO`], which are its outputs as well, with their schemas.
pub(super) fn echo_values() -> [(&'static str, Value); 5] {
    [
        ("text", json!({ "type": "string", "maxLength": 65536 })),
        ("number", json!({ "type": "number" })),
        ("flag", json!({ "type": "boolean" })),
        ("list", json!({ "type": "array", "items": {}, "maxItems": 10000 })),
        ("object", json!({ "type": "object" })),
    ]
}

/// The outputs of [`CITY_MODEL`]: name, file of the result, media type, what it is.
pub(super) const CITY_OUTPUTS: [(&str, &str, &str, &str); 4] = [
    ("city", "city.city.jsonl", "application/city+json-seq", "The whole city as CityJSONSeq"),
    ("index", "index.json", JSON, "The tiles, with their extents and counts"),
    ("report", "report.html", "text/html", "Pictures and figures for people"),
    ("figures", "report.json", JSON, "The same figures for programs"),
];

fn summary(base: &Base, name: &str) -> Option<Value> {
    let (title, description, options, transmission) = match name {
        CITY_MODEL => (
            "City model",
            "Makes the buildings of a city from its textured mesh, or refreshes them",
            json!(["async-execute", "dismiss"]),
            "reference",
        ),
        ECHO => ("Echo", "Gives its inputs back", json!(["sync-execute"]), "value"),
        _ => return None,
    };
    let path = format!("/processes/{name}");
    Some(json!({
        "id": name,
        "title": title,
        "description": description,
        "version": env!("CARGO_PKG_VERSION"),
        "jobControlOptions": options,
        "outputTransmission": [transmission],
        "links": [base.link(&path, "self", JSON, "The description"),
            base.link(&format!("{path}/execution"), "http://www.opengis.net/def/rel/ogc/1.0/execute", JSON, "Execute it")],
    }))
}

fn described(base: &Base, name: &str) -> Option<Value> {
    let mut process = summary(base, name)?;
    let input = |title: &str, required: bool, schema: Value| json!({ "title": title, "schema": schema, "minOccurs": u8::from(required), "maxOccurs": 1 });
    (process["inputs"], process["outputs"]) = match name {
        CITY_MODEL => {
            let presets: Vec<&str> = PRESETS.iter().map(|p| p.name).collect();
            let inputs = json!({
                "source": input("The mesh, as the service sees it", true, json!({ "type": "string", "minLength": 1, "maxLength": 4096 })),
                "city": input("Name of the city that it shows", true, json!({ "type": "string", "minLength": 1, "maxLength": 200 })),
                "preset": input("A named set of parameters", false, json!({ "type": "string", "enum": presets })),
                "parameters": input("Parameters by name, as /api/v1/parameters lists them", false,
                    json!({ "type": "object", "additionalProperties": { "oneOf": [{ "type": "boolean" }, { "type": "number" }, { "type": "string" }] } })),
                "priority": input("Jobs of higher priority get workers first", false, json!({ "type": "integer", "minimum": -100, "maximum": 100 })),
            });
            let outputs = CITY_OUTPUTS.into_iter().map(|(name, _, media_type, title)| {
                (
                    name.to_owned(),
                    json!({ "title": title, "schema": { "type": "string", "contentMediaType": media_type } }),
                )
            });
            (inputs, outputs.collect())
        }
        _ => {
            let values = echo_values();
            let inputs = values.iter().map(|(name, schema)| ((*name).to_owned(), input(name, false, schema.clone())));
            let outputs =
                values.iter().map(|(name, schema)| ((*name).to_owned(), json!({ "title": name, "schema": schema })));
            (inputs.collect(), outputs.collect())
        }
    };
    Some(process)
}

/// Whether there is a process of this name.
pub(super) fn exists(name: &str) -> bool {
    [CITY_MODEL, ECHO].contains(&name)
}

/// Which processes.
#[derive(Debug, Deserialize)]
pub(super) struct ListQuery {
    limit: Option<i64>,
}

pub(super) async fn list(
    State(service): State<Coordinator>,
    _: Caller,
    base: Base,
    Query(query): Query<ListQuery>,
) -> Result<Json<Value>, Problem> {
    let limit = usize::try_from(limit(query.limit, service.limits.page)?).unwrap_or(usize::MAX);
    let processes: Vec<Value> =
        [CITY_MODEL, ECHO].into_iter().take(limit).filter_map(|name| summary(&base, name)).collect();
    let links = [base.link("/processes", "self", JSON, "This list")];
    Ok(Json(json!({ "processes": processes, "links": links })))
}

pub(super) async fn show(_: Caller, base: Base, Path(name): Path<String>) -> Result<Json<Value>, Problem> {
    described(&base, &name).map(Json).ok_or_else(|| no_such_process(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptions_have_inputs_and_outputs() {
        let base = Base::kept("http://h");
        for name in [CITY_MODEL, ECHO] {
            let process = described(&base, name).unwrap();
            assert!(process["inputs"].as_object().is_some_and(|o| o.len() == 5), "{process}");
            assert!(process["outputs"].as_object().is_some_and(|o| o.len() >= 4), "{process}");
            assert_eq!(process["links"][0]["href"], format!("http://h/ogc/processes/{name}"));
        }
        assert!(described(&base, "none").is_none());
    }
}
