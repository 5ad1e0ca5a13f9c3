//! Schedules: jobs that are submitted again and again, by the clock.

use super::jobs::{JobRequest, check, first_task};
use crate::cron::Ticks;
use crate::extract::{Body, Query};
use crate::names::is_name;
use crate::pages::{limit, removed, time};
use crate::problem::Refused;
use crate::{Caller, Coordinator, Problem};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use gable_job_store::{JobStoreError, Missed, NewSchedule, Role, RunOutcome, Schedule, ScheduleRun, Scope};
use serde::{Deserialize, Serialize};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::{IntoParams, ToSchema};

/// Longest name of a schedule, bytes.
const LONGEST: usize = 100;

/// Longest cron expression and name of a time zone, bytes.
const LONGEST_CRON: usize = 200;

/// Ticks to come that are told.
const COMING: usize = 5;

/// When to submit which job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "cron": "30 2 * * MON", "zone": "Europe/Amsterdam", "job": { "source": "delft/mesh.obj", "city": "delft" }
}))]
pub(crate) struct ScheduleRequest {
    /// When: minute, hour, day of the month, month, weekday; before them, if wanted, the second.
    #[schema(min_length = 1, max_length = 200)]
    cron: String,
    /// Time zone of that, by its name in the IANA database.
    #[serde(default = "utc")]
    #[schema(max_length = 200, default = "UTC")]
    zone: String,
    /// What becomes of ticks at which the service was down for a minute or longer: skip lets them go; once submits one job for all
    /// of them as soon as the service is there again.
    #[serde(default = "skip")]
    #[schema(schema_with = missed_names)]
    missed: Missed,
    /// Whether it ticks.
    #[serde(default = "yes")]
    enabled: bool,
    /// The job of each tick. Later jobs of a city do only what has changed.
    job: JobRequest,
}

fn utc() -> String {
    "UTC".to_owned()
}

fn yes() -> bool {
    true
}

fn skip() -> Missed {
    Missed::Skip
}

/// The names of what becomes of missed ticks.
fn missed_names() -> utoipa::openapi::Object {
    let names = Missed::ALL.iter().map(|missed| missed.name());
    ObjectBuilder::new().schema_type(Type::String).enum_values(Some(names)).build()
}

/// A schedule.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct ScheduleView {
    name: String,
    /// Who owns its jobs.
    owner: String,
    cron: String,
    zone: String,
    #[schema(schema_with = missed_names)]
    missed: Missed,
    enabled: bool,
    job: JobRequest,
    /// The next ticks, RFC 3339.
    next: Vec<String>,
    /// Number of its last run; 0 before the first.
    runs: i64,
    /// The last job that it submitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    last_job: Option<String>,
    /// When it was made.
    created: String,
}

impl ScheduleView {
    fn of(schedule: Schedule) -> Result<Self, Problem> {
        let Schedule { said, runs, job, created } = schedule;
        let request = read_request(&said.request)?;
        let mut next: Vec<i64> = said.next.filter(|_| said.enabled).into_iter().collect();
        if let Ok(ticks) = Ticks::new(&said.cron, &said.zone) {
            while let Some(following) = next.last().filter(|_| next.len() < COMING).and_then(|n| ticks.after(*n).ok()) {
                next.push(following);
            }
        }
        Ok(Self {
            name: said.name,
            owner: said.owner,
            cron: said.cron,
            zone: said.zone,
            missed: said.missed,
            enabled: said.enabled,
            job: request,
            next: next.into_iter().map(time).collect(),
            runs,
            last_job: job,
            created: time(created),
        })
    }
}

/// A run of a schedule.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct RunView {
    /// Its number, from 1.
    number: i64,
    /// The tick, RFC 3339; for a run by hand, when it was asked for.
    due: String,
    /// When it was looked at.
    at: String,
    /// submitted; overlap, if the job before was not over; missed, if the service was down.
    #[schema(example = "submitted")]
    outcome: &'static str,
    /// The job that was submitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    job: Option<String>,
}

impl RunView {
    fn of(run: ScheduleRun) -> Self {
        Self { number: run.number, due: time(run.due), at: time(run.at), outcome: run.outcome.name(), job: run.job }
    }
}

/// Which schedules.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ScheduleQuery {
    /// Only those whose names sort after this one: the last name of a page gives the next page.
    after: Option<String>,
    /// Most schedules on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// Which runs.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct RunQuery {
    /// Only those before this number: the last number of a page gives the next page.
    before: Option<i64>,
    /// Most runs on the page.
    #[param(minimum = 1, maximum = 1000, default = 100)]
    limit: Option<i64>,
}

/// What is to be stored of a schedule that is found to hold.
async fn checked(
    service: &Coordinator,
    caller: &Caller,
    name: String,
    wanted: ScheduleRequest,
) -> Result<NewSchedule, Problem> {
    if wanted.cron.len() > LONGEST_CRON || wanted.zone.len() > LONGEST_CRON {
        return Err(Problem::invalid(format!("cron and zone have to have at most {LONGEST_CRON} bytes each")));
    }
    check(&wanted.job, service, caller).await?;
    let refused = |e: crate::cron::CronRefused| Problem::invalid(e.to_string());
    let ticks = Ticks::new(&wanted.cron, &wanted.zone).map_err(refused)?;
    let next = ticks.after(service.store.clock().await?).map_err(refused)?;
    let request = serde_json::to_string(&wanted.job).map_err(|e| Problem::invalid(e.to_string()))?;
    Ok(NewSchedule {
        name,
        owner: caller.name.clone(),
        priority: wanted.job.priority(),
        city: wanted.job.city().to_owned(),
        request,
        cron: wanted.cron,
        zone: wanted.zone,
        missed: wanted.missed,
        enabled: wanted.enabled,
        next: Some(next),
    })
}

/// The request that a schedule keeps.
pub(crate) fn read_request(text: &str) -> Result<JobRequest, JobStoreError> {
    let stored = || JobStoreError::Stored { what: "request of a schedule", value: text.to_owned() };
    serde_json::from_str(text).map_err(|_| stored())
}

fn none(name: &str) -> Problem {
    Problem::not_found(format!("there is no schedule {name:?}"))
}

/// A schedule, if the caller sees its city.
async fn seen(service: &Coordinator, caller: &Caller, name: &str) -> Result<Schedule, Problem> {
    let schedule = service.store.schedule(name).await?.ok_or_else(|| none(name))?;
    service.needs_role(caller, &schedule.said.city, Role::Viewer).await.map_err(|problem| match problem.status {
        404 => none(name),
        _ => problem,
    })?;
    Ok(schedule)
}

async fn view(service: &Coordinator, name: &str) -> Result<ScheduleView, Problem> {
    ScheduleView::of(service.store.schedule(name).await?.ok_or_else(|| none(name))?)
}

/// List schedules, by name
#[utoipa::path(
    get, path = "/schedules", tag = "schedules", params(ScheduleQuery),
    responses(
        (status = 200, description = "A page", body = Vec<ScheduleView>),
    )
)]
pub(crate) async fn list(
    State(service): State<Coordinator>,
    caller: Caller,
    Query(query): Query<ScheduleQuery>,
) -> Result<Json<Vec<ScheduleView>>, Problem> {
    let seen_by = caller.sees();
    let found = service
        .store
        .schedules(seen_by.as_deref(), query.after.as_deref(), limit(query.limit, service.limits.page)?)
        .await?;
    Ok(Json(found.into_iter().map(ScheduleView::of).collect::<Result<_, _>>()?))
}

/// Show a schedule
#[utoipa::path(
    get, path = "/schedules/{name}", tag = "schedules",
    params(("name" = String, Path, description = "Name of the schedule")),
    responses(
        (status = 200, description = "The schedule", body = ScheduleView),
        Refused<404>,
    )
)]
pub(crate) async fn show(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(name): Path<String>,
) -> Result<Json<ScheduleView>, Problem> {
    seen(&service, &caller, &name).await?;
    Ok(Json(view(&service, &name).await?))
}

/// Make a schedule, or change the one of this name
///
/// The history of a schedule that is changed stays. Its jobs are the caller's, and no quota counts them; so it takes an operator.
#[utoipa::path(
    put, path = "/schedules/{name}", tag = "schedules",
    params(("name" = String, Path, description = "Name of the schedule: letters, digits, and . _ -", min_length = 1, max_length = 100)),
    request_body = ScheduleRequest,
    responses(
        (status = 201, description = "Made", body = ScheduleView),
        (status = 200, description = "Changed", body = ScheduleView),
        Refused<413>,
        Refused<415>,
        Refused<422>,
    )
)]
pub(crate) async fn put(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(name): Path<String>,
    Body(wanted): Body<ScheduleRequest>,
) -> Result<(StatusCode, Json<ScheduleView>), Problem> {
    caller.needs(Scope::Operator)?;
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"._-".contains(&b);
    if name.is_empty() || name.len() > LONGEST || !name.bytes().all(plain) || !is_name(&name) {
        let detail = format!("the name of a schedule has 1 to {LONGEST} letters, digits, or . _ -");
        return Err(Problem::invalid(detail));
    }
    let new = checked(&service, &caller, name.clone(), wanted).await?;
    let made = service.store.add_schedule(&new).await?;
    if !made && !service.store.change_schedule(&new).await? {
        // It was removed just now.
        return Err(none(&name));
    }
    let status = if made { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, Json(view(&service, &name).await?)))
}

/// Remove a schedule with its history; its jobs stay
#[utoipa::path(
    delete, path = "/schedules/{name}", tag = "schedules",
    params(("name" = String, Path, description = "Name of the schedule")),
    responses(
        (status = 204, description = "Removed"),
        Refused<404>,
    )
)]
pub(crate) async fn remove(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(name): Path<String>,
) -> Result<StatusCode, Problem> {
    caller.needs(Scope::Operator)?;
    removed(service.store.remove_schedule(&name).await?, || none(&name))
}

/// Submit a schedule's job now, beside its ticks
#[utoipa::path(
    post, path = "/schedules/{name}/run", tag = "schedules",
    params(("name" = String, Path, description = "Name of the schedule")),
    responses(
        (status = 201, description = "Submitted", body = RunView),
        Refused<404>,
        Refused<409>,
    )
)]
pub(crate) async fn run(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(name): Path<String>,
) -> Result<(StatusCode, Json<RunView>), Problem> {
    caller.needs(Scope::Operator)?;
    let schedule = service.store.schedule(&name).await?.ok_or_else(|| none(&name))?;
    let first = first_task(&read_request(&schedule.said.request)?);
    let run = service.store.run_schedule(&name, &first).await?.ok_or_else(|| none(&name))?;
    if run.outcome == RunOutcome::Overlap {
        let detail = format!("the job before of schedule {name:?} is not over: wait for it, or cancel it");
        return Err(Problem::new(StatusCode::CONFLICT, "overlap", "The job before is not over", detail));
    }
    Ok((StatusCode::CREATED, Json(RunView::of(run))))
}

/// The runs of a schedule, newest first
#[utoipa::path(
    get, path = "/schedules/{name}/runs", tag = "schedules",
    params(("name" = String, Path, description = "Name of the schedule"), RunQuery),
    responses(
        (status = 200, description = "A page", body = Vec<RunView>),
        Refused<404>,
    )
)]
pub(crate) async fn runs(
    State(service): State<Coordinator>,
    caller: Caller,
    Path(name): Path<String>,
    Query(query): Query<RunQuery>,
) -> Result<Json<Vec<RunView>>, Problem> {
    let most = limit(query.limit, service.limits.page)?;
    seen(&service, &caller, &name).await?;
    let found = service.store.schedule_runs(&name, query.before, most).await?;
    Ok(Json(found.into_iter().map(RunView::of).collect()))
}
