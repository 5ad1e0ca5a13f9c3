//! Jobs: submitting, finding, steering.

use super::failures::{self, FailureView};
use crate::audit::About;
use crate::extract::{Body, Query};
use crate::names::{LONGEST, is_name};
use crate::pages::{limit, page, polled, time};
use crate::problem::Refused;
use crate::rights::OfJob;
use crate::{Caller, Coordinator, Problem};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use gable_files::Source;
use gable_job_store::{Job, JobFilter, JobState, NewCallback, NewJob, NewTask, Scope, Store, Task, TaskState};
use gable_pipeline::params::parameters;
use gable_pipeline::{Params, Stage};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::{IntoParams, ToSchema};

/// A job to be done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "source": "delft/mesh.obj", "city": "delft", "parameters": { "sampling.step": 0.2 } }))]
pub(crate) struct JobRequest {
    /// The mesh: a file or folder under a source root of the service, `s3://BUCKET/PREFIX` under such a root, or `upload:ID`.
    #[schema(min_length = 1, max_length = 4096)]
    source: String,
    /// The city that it shows; a later job of the same city refreshes it.
    #[schema(min_length = 1, max_length = 200)]
    city: String,
    /// A named set of parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    preset: Option<String>,
    /// Parameters by name, as `/parameters` lists them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    parameters: BTreeMap<String, ParameterValue>,
    /// Jobs of higher priority get workers first; those above 0 are for operators to give.
    #[serde(default)]
    #[schema(minimum = -100, maximum = 100)]
    priority: i64,
}

impl JobRequest {
    pub(super) fn city(&self) -> &str {
        &self.city
    }

    pub(super) fn priority(&self) -> i64 {
        self.priority
    }
}

/// A parameter's value: what its kind asks for, or the same as text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub(crate) enum ParameterValue {
    /// For switches.
    Switch(bool),
    /// For numbers and integers.
    #[schema(value_type = f64)]
    Number(serde_json::Number),
    /// For all others.
    Text(String),
}

impl ParameterValue {
    fn text(&self) -> String {
        match self {
            Self::Switch(v) => v.to_string(),
            Self::Number(v) => v.to_string(),
            Self::Text(v) => v.clone(),
        }
    }
}

/// A job as a client sees it.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct JobView {
    /// Id; ids of later jobs sort later.
    id: String,
    /// The city.
    city: String,
    /// Whose token submitted it.
    owner: String,
    /// The mesh.
    source: String,
    /// accepted, running, paused, successful, partial, failed or cancelled.
    #[schema(example = "running")]
    state: &'static str,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    /// Jobs of higher priority get workers first.
    priority: i64,
    /// The stage under way.
    #[schema(example = "segment")]
    stage: &'static str,
    /// Number of its last event.
    events: i64,
    /// When it was taken in, RFC 3339.
    created: String,
    /// When the first task began.
    #[serde(skip_serializing_if = "Option::is_none")]
    started: Option<String>,
    /// When it was over.
    #[serde(skip_serializing_if = "Option::is_none")]
    finished: Option<String>,
}

impl JobView {
    fn of(job: Job) -> Self {
        /// What of a request a list shows; the rest is not looked at.
        #[derive(Deserialize)]
        struct Shown {
            source: String,
        }
        let source = serde_json::from_str::<Shown>(&job.request).map(|r| r.source).unwrap_or_default();
        Self {
            source,
            state: job.state.name(),
            reason: job.reason,
            priority: job.priority,
            stage: stage_name(job.stage),
            events: job.events,
            created: time(job.created),
            started: job.started.map(time),
            finished: job.finished.map(time),
            id: job.id,
            city: job.city,
            owner: job.owner,
        }
    }
}

/// A job with how far it is.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct JobDetail {
    #[serde(flatten)]
    job: JobView,
    /// Preset, parameters, and all else that was submitted.
    request: JobRequest,
    /// Its stages, in order.
    progress: Vec<StageProgress>,
    /// What failed, each reason once, in the order of the stages.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    failures: Vec<FailureView>,
}

/// How far a stage is.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct StageProgress {
    #[schema(example = "segment")]
    stage: &'static str,
    ready: i64,
    running: i64,
    /// Done now, or taken over from an earlier run.
    done: i64,
    failed: i64,
    cancelled: i64,
}

/// A page of jobs.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct JobPage {
    /// Newest first.
    jobs: Vec<JobView>,
    /// Give it as `before` for the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

/// Which jobs.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct JobQuery {
    /// Only in this state.
    #[param(schema_with = state_names)]
    state: Option<JobState>,
    /// Only of this city.
    city: Option<String>,
    /// Only of this owner.
    owner: Option<String>,
    /// Only those submitted before this job.
    before: Option<String>,
    /// Most jobs on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// The names of the states of jobs.
fn state_names() -> utoipa::openapi::Object {
    let names = JobState::ALL.iter().map(|state| state.name());
    ObjectBuilder::new().schema_type(Type::String).enum_values(Some(names)).build()
}

/// A priority.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Priority {
    #[schema(minimum = -100, maximum = 100)]
    priority: i64,
}

/// Name of a stage by its number.
pub(super) fn stage_name(number: i64) -> &'static str {
    Stage::name_of(number)
}

/// Submit a job
#[utoipa::path(
    post, path = "/jobs", tag = "jobs",
    params(("Idempotency-Key" = Option<String>, Header, description = "The same key again gives the same job")),
    request_body = JobRequest,
    responses(
        (status = 201, description = "Taken in", body = JobView, headers(("Location" = String, description = "Where the job is"))),
        (status = 200, description = "Taken in earlier under the same key", body = JobView),
        Refused<409>,
        Refused<413>,
        Refused<415>,
        Refused<422>,
        Refused<429>,
    )
)]
pub(crate) async fn submit(
    State(service): State<Coordinator>,
    caller: Caller,
    Extension(about): Extension<About>,
    headers: HeaderMap,
    Body(request): Body<JobRequest>,
) -> Result<Response, Problem> {
    caller.needs(Scope::Submitter)?;
    about.set(&request.city);
    let (job, new) = take_in(&service, caller, &headers, request, Vec::new()).await?;
    let status = if new { StatusCode::CREATED } else { StatusCode::OK };
    let place = format!("/api/v1/jobs/{}", job.id);
    Ok((status, [(header::LOCATION, place)], Json(JobView::of(job))).into_response())
}

/// Takes a job in, if its caller may have another; gives it, and whether it is new.
pub(crate) async fn take_in(
    service: &Coordinator,
    caller: Caller,
    headers: &HeaderMap,
    request: JobRequest,
    callbacks: Vec<NewCallback>,
) -> Result<(Job, bool), Problem> {
    check(&request, service, &caller).await?;
    let key = headers.get("idempotency-key").map(|v| v.to_str().map(str::to_owned)).transpose();
    let key = key.map_err(|_| Problem::invalid("the idempotency key is not ASCII"))?;
    if key.as_ref().is_some_and(|k| k.is_empty() || k.len() > LONGEST) {
        return Err(Problem::invalid(format!("the idempotency key has to have 1 to {LONGEST} bytes")));
    }
    let text = serde_json::to_string(&request).map_err(|e| Problem::invalid(e.to_string()))?;
    let first = first_task(&request);
    let new = NewJob {
        city: request.city,
        names: caller.sees(),
        owner: caller.name,
        idempotency_key: key,
        request: text,
        priority: request.priority,
        tasks: vec![first],
        max_jobs: caller.max_jobs,
        callbacks,
    };
    let submitted = service.store.submit(&new).await?;
    let job = service.store.job(&submitted.id).await?;
    if submitted.new {
        tracing::info!(job = job.id, city = job.city, owner = job.owner, priority = job.priority, "job submitted");
    }
    Ok((job, submitted.new))
}

/// The task that a job with this request begins with.
pub(crate) fn first_task(request: &JobRequest) -> NewTask {
    let source = request.source.as_str();
    let input = match (Source::upload(source), Source::objects(source)) {
        (Some(id), _) => serde_json::json!({ "upload": id }),
        (None, Some(place)) => serde_json::json!({ "objects": place }),
        (None, None) => serde_json::json!({}),
    };
    NewTask { stage: 0, unit: "scene".to_owned(), input: input.to_string(), required: true, max_attempts: 3 }
}

/// An error unless a city may have this name.
pub(super) fn checked_city(name: &str) -> Result<(), Problem> {
    if !is_name(name) {
        let detail = format!(
            "city has to be a name of 1 to {LONGEST} bytes, without control characters and marks that are not seen, and not . or .."
        );
        return Err(Problem::invalid(detail));
    }
    Ok(())
}

/// What can be known to be wrong before the job begins.
pub(super) async fn check(request: &JobRequest, service: &Coordinator, caller: &Caller) -> Result<(), Problem> {
    checked_city(&request.city)?;
    if !(-100..=100).contains(&request.priority) {
        return Err(Problem::invalid("priority has to be -100 to 100"));
    }
    caller.may_have_priority(request.priority)?;
    if request.source.trim().is_empty() {
        return Err(Problem::invalid("source has to name a mesh"));
    }
    let roots = service.roots_of(caller)?;
    let source = roots.locate(&request.source).map_err(|e| Problem::source(e.to_string()))?;
    if let Source::Upload(id) = source {
        let usable = match service.store.upload(&id).await? {
            Some(upload) => service.may_use(caller, &upload).await?,
            None => false,
        };
        if !usable {
            return Err(Problem::invalid(format!("there is no upload {id}: send the mesh by POST /api/v1/uploads")));
        }
    }
    let settings: Vec<_> = request.parameters.iter().map(|(name, value)| (name.clone(), value.text())).collect();
    let params =
        Params::assemble(request.preset.as_deref(), None, &settings).map_err(|e| Problem::invalid(e.to_string()))?;
    let defaults = Params::default();
    for changed in parameters().iter().filter(|p| p.value(&params) != p.value(&defaults)) {
        if changed.group == "resources" {
            return Err(Problem::invalid(format!("{} is for the workers to say, not for a job", changed.name)));
        }
        if changed.kind == "file" {
            let found = roots.resolve(&changed.value(&params));
            found.map_err(|e| Problem::invalid(format!("{}: {e}", changed.name)))?;
        }
    }
    Ok(())
}

/// List jobs, newest first
#[utoipa::path(
    get, path = "/jobs", tag = "jobs", params(JobQuery),
    responses(
        (status = 200, description = "A page", body = JobPage),
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    caller: Caller,
    Query(query): Query<JobQuery>,
) -> Result<Json<JobPage>, Problem> {
    let limit = limit(query.limit, service.limits.page)?;
    let filter = JobFilter {
        states: query.state.into_iter().collect(),
        city: query.city,
        owner: query.owner,
        seen_by: caller.sees(),
        before: query.before,
        ..JobFilter::default()
    };
    // One more than asked for, to know whether there is a next page.
    let found = service.store.jobs(&filter, limit + 1).await?;
    let (jobs, next) = page(found, limit, |j| j.id.clone(), JobView::of);
    Ok(Json(JobPage { jobs, next }))
}

/// Show a job
///
/// To poll it, send the ETag of the last answer as If-None-Match: nothing new is answered by 304.
#[utoipa::path(
    get, path = "/jobs/{id}", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    responses(
        (status = 200, description = "The job", body = JobDetail, headers(("ETag" = String, description = "Its state"))),
        (status = 304, description = "Nothing new"),
        Refused<404>,
    )
)]
pub(crate) async fn show(
    State(service): State<Coordinator>,
    _: OfJob,
    headers: HeaderMap,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    polled(&service.answers.jobs, &service.store, &id, &headers, || detail(&service.store, &id)).await
}

async fn detail(store: &Store, id: &str) -> Result<JobDetail, Problem> {
    let job = store.job(id).await?;
    let request: JobRequest = serde_json::from_str(&job.request)
        .map_err(|_| gable_job_store::JobStoreError::Stored { what: "request of a job", value: job.request.clone() })?;
    let mut progress: BTreeMap<i64, StageProgress> = BTreeMap::new();
    for ((stage, state), n) in store.task_counts(id).await? {
        let entry = progress.entry(stage).or_insert_with(|| StageProgress {
            stage: stage_name(stage),
            ready: 0,
            running: 0,
            done: 0,
            failed: 0,
            cancelled: 0,
        });
        match state {
            TaskState::Ready => entry.ready += n,
            TaskState::Running => entry.running += n,
            TaskState::Done | TaskState::Reused => entry.done += n,
            TaskState::Failed => entry.failed += n,
            TaskState::Cancelled => entry.cancelled += n,
        }
    }
    let failures = match progress.values().any(|stage| stage.failed > 0) {
        true => failures::grouped(&store.tasks(id).await?),
        false => Vec::new(),
    };
    Ok(JobDetail { job: JobView::of(job), request, progress: progress.into_values().collect(), failures })
}

macro_rules! steering {
    ($(#[doc = $help:literal] $name:ident, $path:literal, $method:ident, $done:literal;)+) => {
        $(
            #[doc = $help]
            #[utoipa::path(
                post, path = $path, tag = "jobs",
                params(("id" = String, Path, description = "Id of the job")),
                responses(
                    (status = 200, description = "The job afterwards", body = JobView),
                    Refused<404>,
                    Refused<409>,
                )
            )]
            pub(crate) async fn $name(
                State(service): State<Coordinator>,
                OfJob(caller): OfJob,
                Path(id): Path<String>,
            ) -> Result<Json<JobView>, Problem> {
                service.steered_job(&caller, &id).await?;
                service.store.$method(&id).await?;
                let job = service.store.job(&id).await?;
                tracing::info!(job = job.id, city = job.city, by = caller.name, $done);
                Ok(Json(JobView::of(job)))
            }
        )+
    };
}

steering! {
    /// Cancel a job for good
    cancel, "/jobs/{id}/cancel", cancel, "job cancelled";
    /// Let no further task of a job begin
    pause, "/jobs/{id}/pause", pause, "job paused";
    /// Let a paused job go on
    resume, "/jobs/{id}/resume", resume, "job resumed";
    /// Do what failed again
    retry, "/jobs/{id}/retry", retry_failed, "job retried";
}

/// Set a job's priority
#[utoipa::path(
    put, path = "/jobs/{id}/priority", tag = "jobs",
    params(("id" = String, Path, description = "Id of the job")),
    request_body = Priority,
    responses(
        (status = 200, description = "The job afterwards", body = JobView),
        Refused<404>,
        Refused<409>,
        Refused<413>,
        Refused<415>,
        Refused<422>,
    )
)]
pub(crate) async fn set_priority(
    State(service): State<Coordinator>,
    OfJob(caller): OfJob,
    Path(id): Path<String>,
    Body(Priority { priority }): Body<Priority>,
) -> Result<Json<JobView>, Problem> {
    if !(-100..=100).contains(&priority) {
        return Err(Problem::invalid("priority has to be -100 to 100"));
    }
    service.steered_job(&caller, &id).await?;
    caller.may_have_priority(priority)?;
    service.store.set_priority(&id, priority).await?;
    Ok(Json(JobView::of(service.store.job(&id).await?)))
}

/// A task, for the lists of other modules.
pub(super) fn seconds(task: &Task) -> Option<f64> {
    let (begin, end) = (task.started?, task.finished?);
    Some((end - begin) as f64 / 1000.0)
}
