//! Jobs in OGC's words: status, list, results, dismissal.

use super::processes::{CITY_MODEL, CITY_OUTPUTS};
use super::{JSON, exception, no_such_job};
use crate::base::Base;
use crate::extract::Query;
use crate::pages::{limit, page, time};
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use gable_job_store::{Callback, Job, JobFilter, JobState, JobStoreError, Store, TaskState, WebhookEvent};
use serde::Deserialize;
use serde_json::{Map, Value, json};

/// OGC's word for a state.
fn word(state: JobState) -> &'static str {
    match state {
        JobState::Accepted => "accepted",
        JobState::Running | JobState::Paused => "running",
        JobState::Successful | JobState::Partial => "successful",
        JobState::Failed => "failed",
        JobState::Cancelled => "dismissed",
    }
}

/// A job in OGC's words.
pub(super) fn status_info(base: &Base, job: &Job, progress: Option<i64>) -> Value {
    let path = format!("/jobs/{}", job.id);
    let mut links = vec![base.link(&path, "self", JSON, "The status")];
    if matches!(job.state, JobState::Successful | JobState::Partial) {
        let relation = "http://www.opengis.net/def/rel/ogc/1.0/results";
        links.push(base.link(&format!("{path}/results"), relation, JSON, "The results"));
    }
    let mut info = json!({ "jobID": job.id, "processID": CITY_MODEL, "type": "process", "status": word(job.state),
        "created": time(job.created), "links": links });
    let message = match job.state {
        JobState::Paused => Some("paused".to_owned()),
        JobState::Partial => Some("some blocks failed: the rest of the city is there".to_owned()),
        _ => job.reason.clone(),
    };
    for (name, value) in [
        ("message", message.map(Value::from)),
        ("started", job.started.map(|t| time(t).into())),
        ("finished", job.finished.map(|t| time(t).into())),
        ("progress", progress.map(Value::from)),
    ] {
        if let Some(value) = value {
            info[name] = value;
        }
    }
    info
}

async fn found(service: &Coordinator, caller: &Caller, id: &str) -> Result<Job, Problem> {
    service.seen_job(caller, id).await.map_err(|problem| match problem.status {
        404 => no_such_job(id),
        _ => problem,
    })
}

/// Percent of the tasks known so far that are over.
async fn progress(store: &Store, job: &Job) -> Result<i64, JobStoreError> {
    if matches!(job.state, JobState::Successful | JobState::Partial) {
        return Ok(100);
    }
    let counts = store.task_counts(&job.id).await?;
    let all: i64 = counts.values().sum();
    let over: i64 = counts
        .iter()
        .filter(|((_, state), _)| !matches!(state, TaskState::Ready | TaskState::Running))
        .map(|(_, tasks)| tasks)
        .sum();
    Ok(if all == 0 { 0 } else { (100 * over / all).min(99) })
}

pub(super) async fn show(
    State(service): State<Coordinator>,
    caller: Caller,
    base: Base,
    Path(id): Path<String>,
) -> Result<Json<Value>, Problem> {
    let job = found(&service, &caller, &id).await?;
    let progress = progress(&service.store, &job).await?;
    Ok(Json(status_info(&base, &job, Some(progress))))
}

pub(super) async fn dismiss(
    State(service): State<Coordinator>,
    caller: Caller,
    base: Base,
    Path(id): Path<String>,
) -> Result<Json<Value>, Problem> {
    let job = found(&service, &caller, &id).await?;
    service.steered_job(&caller, &id).await?;
    match job.state {
        JobState::Cancelled => {
            let detail = format!("job {id} was dismissed already");
            return Err(Problem::new(StatusCode::GONE, "dismissed", "The job was dismissed", detail));
        }
        state if state.is_over() => {
            let detail = format!("job {id} is over, and what it made belongs to its city");
            return Err(Problem::new(StatusCode::CONFLICT, "state", "The job's state does not allow this", detail));
        }
        _ => service.store.cancel(&id).await?,
    }
    let job = found(&service, &caller, &id).await?;
    tracing::info!(job = job.id, city = job.city, by = caller.name, "job cancelled");
    Ok(Json(status_info(&base, &job, None)))
}

pub(super) async fn results(
    State(service): State<Coordinator>,
    caller: Caller,
    base: Base,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let job = found(&service, &caller, &id).await?;
    match job.state {
        JobState::Successful | JobState::Partial => {}
        JobState::Failed => {
            let detail = job.reason.unwrap_or_else(|| "its log tells more".to_owned());
            let kind = exception!("job-failed");
            return Err(Problem::new(StatusCode::INTERNAL_SERVER_ERROR, kind, "The job failed", detail));
        }
        state => {
            let detail = format!("job {id} is {}", word(state));
            let kind = exception!("result-not-ready");
            return Err(Problem::new(StatusCode::NOT_FOUND, kind, "There are no results yet", detail));
        }
    }
    Ok(Json(outputs(&service.store, &base, &id).await?).into_response())
}

/// The outputs of a job: links to the files that it has made.
async fn outputs(store: &Store, base: &Base, job: &str) -> Result<Value, JobStoreError> {
    let mut outputs = Map::new();
    for (name, file, media_type, title) in CITY_OUTPUTS {
        if store.artifacts_at(job, &[format!("result/{file}")]).await?.is_empty() {
            continue;
        }
        let href = base.href(&format!("/api/v1/jobs/{job}/files/{file}"));
        outputs.insert(name.to_owned(), json!({ "href": href, "rel": "item", "type": media_type, "title": title }));
    }
    Ok(outputs.into())
}

/// What the subscriber of a job is told: the results, or how it is. None if what was to be told is over by now.
///
/// # Errors
/// If the database does not answer.
pub(crate) async fn callback(
    store: &Store,
    about: &Callback,
    event: WebhookEvent,
) -> Result<Option<Value>, JobStoreError> {
    let (base, job) = (Base::kept(&about.base), store.job(&about.job).await?);
    Ok(match event {
        WebhookEvent::JobSucceeded | WebhookEvent::JobPartial => Some(outputs(store, &base, &job.id).await?),
        WebhookEvent::JobProgressed if job.state.is_over() => None,
        _ => Some(status_info(&base, &job, Some(progress(store, &job).await?))),
    })
}

/// Which jobs.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct ListQuery {
    limit: Option<i64>,
    /// Kinds of jobs, joined by commas; there is one kind only.
    r#type: Option<String>,
    #[serde(rename = "processID")]
    process_id: Option<String>,
    status: Option<String>,
    /// When they were created: a time, or an interval whose open end is `..`.
    datetime: Option<String>,
    /// Seconds.
    min_duration: Option<i64>,
    max_duration: Option<i64>,
    /// Only those created before this job; the link to the next page has it.
    before: Option<String>,
}

pub(super) async fn list(
    State(service): State<Coordinator>,
    caller: Caller,
    base: Base,
    Query(query): Query<ListQuery>,
) -> Result<Json<Value>, Problem> {
    let limit = limit(query.limit, service.limits.page)?;
    let among = |list: &Option<String>, name: &str| list.as_ref().is_none_or(|l| l.split(',').any(|one| one == name));
    let mut found = Vec::new();
    if among(&query.r#type, "process") && among(&query.process_id, CITY_MODEL) {
        let states = states(query.status.as_deref())?;
        let (from, to) = interval(query.datetime.as_deref())?;
        let filter = JobFilter {
            states,
            created_from: from,
            created_to: to,
            min_duration: query.min_duration.map(|s| s.saturating_mul(1000)),
            max_duration: query.max_duration.map(|s| s.saturating_mul(1000)),
            before: query.before.clone(),
            seen_by: caller.sees(),
            ..JobFilter::default()
        };
        found = service.store.jobs(&filter, limit + 1).await?;
    }
    let (jobs, next) = page(found, limit, |j| j.id.clone(), |job| status_info(&base, &job, None));
    let mut links = vec![base.link("/jobs", "self", JSON, "This list")];
    if let Some(next) = next {
        let mut path = format!("/jobs?limit={limit}&before={next}");
        for (name, value) in [
            ("status", query.status),
            ("datetime", query.datetime),
            ("minDuration", query.min_duration.map(|n| n.to_string())),
            ("maxDuration", query.max_duration.map(|n| n.to_string())),
        ] {
            path += &value.map_or_else(String::new, |v| format!("&{name}={}", crate::pages::escaped(&v)));
        }
        links.push(base.link(&path, "next", JSON, "Earlier jobs"));
    }
    Ok(Json(json!({ "jobs": jobs, "links": links })))
}

/// The states that OGC's words stand for.
fn states(words: Option<&str>) -> Result<Vec<JobState>, Problem> {
    let Some(words) = words else { return Ok(Vec::new()) };
    let mut states = Vec::new();
    for wanted in words.split(',') {
        let of = JobState::ALL.iter().copied().filter(|state| word(*state) == wanted);
        let before = states.len();
        states.extend(of);
        if states.len() == before {
            let detail = format!("status {wanted:?} has to be accepted, running, successful, failed or dismissed");
            return Err(Problem::query(detail));
        }
    }
    Ok(states)
}

/// The ends of an interval, milliseconds since 1970.
fn interval(text: Option<&str>) -> Result<(Option<i64>, Option<i64>), Problem> {
    let Some(text) = text else { return Ok((None, None)) };
    let wrong = || {
        Problem::query(
            "datetime has to be a time such as 2026-01-31T12:00:00Z, or two of them joined by /, or .. for an open end",
        )
    };
    let end = |text: &str| match text {
        "" | ".." => Ok(None),
        text => text.parse::<jiff::Timestamp>().map(|t| Some(t.as_millisecond())).map_err(|_| wrong()),
    };
    match text.split_once('/') {
        Some((from, to)) => Ok((end(from)?, end(to)?)),
        None => {
            let at = end(text)?.ok_or_else(wrong)?;
            Ok((Some(at), Some(at)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_for_states() {
        assert_eq!(states(Some("running,failed")).unwrap(), [JobState::Running, JobState::Paused, JobState::Failed]);
        assert!(states(Some("paused")).is_err());
        assert!(states(None).unwrap().is_empty());
    }

    #[test]
    fn intervals_may_be_open() {
        assert_eq!(interval(Some("1970-01-01T00:00:01Z/..")).unwrap(), (Some(1000), None));
        assert_eq!(interval(Some("../1970-01-01T00:00:02Z")).unwrap(), (None, Some(2000)));
        assert_eq!(interval(Some("1970-01-01T00:00:01Z")).unwrap(), (Some(1000), Some(1000)));
        assert!(interval(Some("yesterday")).is_err() && interval(Some("..")).is_err());
    }
}
