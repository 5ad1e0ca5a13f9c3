//! The execution of a process.

use super::jobs::status_info;
use super::no_such_process;
use super::processes::{CITY_MODEL, ECHO, echo_values, exists};
use crate::api::jobs::{JobRequest, take_in};
use crate::base::Base;
use crate::extract::Body;
use crate::{Caller, Coordinator, Problem, outbound};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gable_job_store::{NewCallback, Scope, WebhookEvent};
use serde::Deserialize;
use serde_json::{Map, Value};

/// What is to be executed, and how the result is wanted.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Execute {
    #[serde(default)]
    inputs: Map<String, Value>,
    /// Outputs that are wanted; all if it is not there.
    outputs: Option<Map<String, Value>>,
    #[serde(default)]
    response: ResponseForm,
    /// Who is told how the job goes.
    subscriber: Option<Subscriber>,
}

/// Addresses that are told how a job goes.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscriber {
    /// Gets the results.
    success_uri: Option<String>,
    /// Gets the status when the job begins, and at each further stage.
    in_progress_uri: Option<String>,
    /// Gets the status when the job has failed or was dismissed.
    failed_uri: Option<String>,
}

impl Subscriber {
    /// What is to be kept of it. `private`: also addresses that are not public.
    fn callbacks(self, base: &Base, private: bool) -> Result<Vec<NewCallback>, Problem> {
        use WebhookEvent::{JobCancelled, JobFailed, JobPartial, JobProgressed, JobSucceeded};
        let wanted = [
            ("successUri", self.success_uri, vec![JobSucceeded, JobPartial]),
            ("inProgressUri", self.in_progress_uri, vec![JobProgressed]),
            ("failedUri", self.failed_uri, vec![JobFailed, JobCancelled]),
        ];
        let given = wanted.into_iter().filter_map(|(name, url, events)| Some((name, url?, events)));
        given
            .map(|(name, url, events)| match outbound::checked(&url, private) {
                Ok(_) => Ok(NewCallback { url, events, base: base.href("") }),
                Err(e) => Err(bad_input(format!("subscriber.{name}: {e}"))),
            })
            .collect()
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ResponseForm {
    /// The value itself, if one output is wanted.
    #[default]
    Raw,
    /// All outputs as one JSON object.
    Document,
}

pub(super) async fn execute(
    State(service): State<Coordinator>,
    caller: Caller,
    base: Base,
    headers: HeaderMap,
    Path(process): Path<String>,
    Body(request): Body<Execute>,
) -> Result<Response, Problem> {
    if !exists(&process) {
        return Err(no_such_process(&process));
    }
    caller.needs(Scope::Submitter)?;
    match process.as_str() {
        ECHO => echo(&request),
        _ => city_model(&service, caller, &base, &headers, request).await,
    }
}

/// An input's value: as it is, or under `value`, as objects have to be given.
fn value(input: Value) -> Value {
    match input {
        Value::Object(mut object) if object.len() <= 3 && object.contains_key("value") => {
            object.remove("value").unwrap_or_default()
        }
        other => other,
    }
}

async fn city_model(
    service: &Coordinator,
    caller: Caller,
    base: &Base,
    headers: &HeaderMap,
    request: Execute,
) -> Result<Response, Problem> {
    let inputs: Map<String, Value> = request.inputs.into_iter().map(|(name, input)| (name, value(input))).collect();
    let wanted: JobRequest = serde_json::from_value(inputs.into())
        .map_err(|e| bad_input(format!("inputs: {e}; /ogc/processes/{CITY_MODEL} describes them")))?;
    let callbacks = request.subscriber.map(|s| s.callbacks(base, service.limits.private_webhooks)).transpose()?;
    let (job, _) = take_in(service, caller, headers, wanted, callbacks.unwrap_or_default()).await?;
    let place = base.href(&format!("/ogc/jobs/{}", job.id));
    // Whatever was preferred, it is done later.
    let fields = [
        (header::LOCATION, place),
        (header::HeaderName::from_static("preference-applied"), "respond-async".to_owned()),
    ];
    Ok((StatusCode::CREATED, fields, Json(status_info(base, &job, None))).into_response())
}

fn echo(request: &Execute) -> Result<Response, Problem> {
    if request.subscriber.is_some() {
        return Err(bad_input(format!("{ECHO} is executed at once, so there is no job to tell a subscriber of")));
    }
    let known = echo_values();
    let mut outputs = Map::new();
    for (name, input) in &request.inputs {
        let Some((_, schema)) = known.iter().find(|(known, _)| known == name) else {
            return Err(bad_input(format!("there is no input {name:?}: /ogc/processes/{ECHO} describes them")));
        };
        let given = value(input.clone());
        let fits = match schema["type"].as_str() {
            Some("string") => given.is_string(),
            Some("number") => given.is_number(),
            Some("boolean") => given.is_boolean(),
            Some("array") => given.is_array(),
            _ => given.is_object(),
        };
        if !fits {
            return Err(bad_input(format!("input {name:?} has to be of type {}", schema["type"])));
        }
        outputs.insert(name.clone(), given);
    }
    if let Some(wanted) = &request.outputs {
        if let Some(unknown) = wanted.keys().find(|name| !known.iter().any(|(known, _)| known == name)) {
            return Err(bad_input(format!("there is no output {unknown:?}: /ogc/processes/{ECHO} describes them")));
        }
        outputs.retain(|name, _| wanted.contains_key(name));
    }
    // A single value is sent as it is, if it is wanted so.
    if request.response == ResponseForm::Raw
        && let (Some((_, only)), 1) = (outputs.iter().next(), outputs.len())
    {
        return Ok(match only {
            Value::String(text) => text.clone().into_response(),
            other => Json(other.clone()).into_response(),
        });
    }
    Ok(Json(outputs).into_response())
}

fn bad_input(detail: String) -> Problem {
    let kind = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/invalid-parameter-value";
    Problem::new(StatusCode::BAD_REQUEST, kind, "An input does not hold", detail)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn objects_are_given_as_values() {
        assert_eq!(value(json!({ "value": { "a": 1 }, "mediaType": "application/json" })), json!({ "a": 1 }));
        assert_eq!(value(json!({ "a": 1 })), json!({ "a": 1 }));
        assert_eq!(value(json!("x")), json!("x"));
    }

    #[test]
    fn echo_checks_what_it_gives_back() {
        let status = |body: Value| {
            echo(&serde_json::from_value(body).unwrap()).map(|r| r.status().as_u16()).map_err(|p| p.status)
        };
        assert_eq!(status(json!({ "inputs": { "text": "a", "number": 1 } })), Ok(200));
        assert_eq!(status(json!({ "inputs": { "text": 1 } })), Err(400));
        assert_eq!(status(json!({ "inputs": { "colour": 1 } })), Err(400));
        assert_eq!(status(json!({ "inputs": {}, "outputs": { "colour": {} } })), Err(400));
        assert_eq!(status(json!({ "inputs": {}, "subscriber": { "successUri": "https://example.com/" } })), Err(400));
    }
}
