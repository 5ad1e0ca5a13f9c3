//! Signed links to files of a city or a job, for those who have no token.

use super::{city_files, files};
use crate::access::Asking;
use crate::auth::random;
use crate::base::Base;
use crate::extract::Body;
use crate::pages::{escaped, time};
use crate::problem::Refused;
use crate::rights::{OfCity, OfJob};
use crate::shared::Freshness;
use crate::signed::{Grant, Opened};
use crate::{Caller, Coordinator, PERSON, Problem};
use axum::Json;
use axum::extract::{Extension, Path, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use gable_job_store::{Artifact, Scope};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Name of what links are signed with.
const SECRET: &str = "links";

/// How long a link holds if that is not said, and at most, seconds.
const USUAL: i64 = 24 * 3600;
const LONGEST: i64 = 7 * 24 * 3600;

/// A link to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewLink {
    /// A file, as the list of files has it, or a folder with all that is in it, which ends with `/`.
    #[schema(example = "3dtiles/", min_length = 1, max_length = 1000)]
    path: String,
    /// How long it holds, seconds: a week at most, a day if not given.
    #[schema(minimum = 1, maximum = 604_800)]
    seconds: Option<i64>,
    /// Of a city: the number of a generation; if not given, the one that readers see at the time.
    generation: Option<i64>,
}

/// A link.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LinkView {
    /// What opens it; for a folder, what stands before the paths in it.
    url: String,
    /// When it ends, RFC 3339.
    expires: String,
}

/// Make a link to a file or a folder of a city that needs no token
///
/// Whoever has it reads what it names until it ends: by its time, or with the token or the membership of whoever made it. A viewer of
/// 3D Tiles takes the link to `3dtiles/` and adds `tileset.json`.
#[utoipa::path(
    post, path = "/cities/{city}/links", tag = "cities",
    params(("city" = String, Path, description = "Name of the city")),
    request_body = NewLink,
    responses((status = 201, description = "The link", body = LinkView), Refused<404>, Refused<413>, Refused<415>, Refused<422>)
)]
pub(crate) async fn of_city(
    State(service): State<Coordinator>,
    OfCity(caller): OfCity,
    base: Base,
    Path(city): Path<String>,
    Body(wanted): Body<NewLink>,
) -> Result<Response, Problem> {
    make(&service, caller, &base, Opened::City(city, wanted.generation), wanted).await
}

/// Make a link to a file or a folder of a job's result that needs no token
///
/// The same as of a city.
#[utoipa::path(
    post, path = "/jobs/{id}/links", tag = "results",
    params(("id" = String, Path, description = "Id of the job")),
    request_body = NewLink,
    responses((status = 201, description = "The link", body = LinkView), Refused<404>, Refused<413>, Refused<415>, Refused<422>)
)]
pub(crate) async fn of_job(
    State(service): State<Coordinator>,
    OfJob(caller): OfJob,
    base: Base,
    Path(id): Path<String>,
    Body(wanted): Body<NewLink>,
) -> Result<Response, Problem> {
    if wanted.generation.is_some() {
        return Err(Problem::invalid("a job has no generations: leave generation out"));
    }
    make(&service, caller, &base, Opened::Job(id), wanted).await
}

async fn make(
    service: &Coordinator,
    caller: Caller,
    base: &Base,
    of: Opened,
    wanted: NewLink,
) -> Result<Response, Problem> {
    let seconds = wanted.seconds.unwrap_or(USUAL);
    if !(1..=LONGEST).contains(&seconds) {
        return Err(Problem::invalid(format!("seconds has to be 1 to {LONGEST}")));
    }
    let files = of.files(service, &wanted.path).await?;
    // It ends with what its maker has shown, at the latest.
    let until = (now() + seconds * 1000).min(caller.ends.unwrap_or(i64::MAX));
    let grant = Grant { of, path: wanted.path, by: caller.name, until };
    if grant.path.is_empty() || !files.iter().any(|file| grant.opens(&file.path)) {
        return Err(Problem::not_found(format!("there is no file or folder {:?}; a folder ends with /", grant.path)));
    }
    let signed = grant.signed(&secret(service).await?).ok_or_else(|| Problem::invalid("it cannot be signed"))?;
    let path: Vec<String> = grant.path.split('/').map(escaped).collect();
    let url = base.href(&format!("/api/v1/links/{signed}/files/{}", path.join("/")));
    Ok((StatusCode::CREATED, Json(LinkView { url, expires: time(until) })).into_response())
}

/// Read a file that a link opens
///
/// `Range: bytes=…` gives a part of it.
#[utoipa::path(
    get, path = "/links/{link}/files/{*path}", tag = "results", security(()),
    params(
        ("link" = String, Path, description = "What is signed"),
        ("path" = String, Path, description = "Path of the file"),
    ),
    responses(
        (status = 200, description = "Its content", content_type = "*/*"),
        (status = 206, description = "A part of it", content_type = "*/*"),
        (status = 304, description = "Nothing new"),
        Refused<404>,
        Refused<416>,
    )
)]
pub(crate) async fn content(
    State(service): State<Coordinator>,
    Extension(asking): Extension<Asking>,
    headers: HeaderMap,
    Path((link, path)): Path<(String, String)>,
) -> Result<Response, Problem> {
    let grant = Grant::read(&link, &secret(&service).await?).filter(|grant| grant.until > now() && grant.opens(&path));
    let grant = grant.ok_or_else(ended)?;
    // Also the log does not tell the link itself.
    asking.set(&format!("link of {}", grant.by));
    let maker = maker(&service, &grant.by).await?.ok_or_else(ended)?;
    grant.of.seen_by(&service, &maker).await?;
    let file = grant.of.file(&service, &path).await?;
    files::send(&service, &headers, &path, &file).await
}

/// End all links, of all cities and jobs
///
/// For operators: if one has come to know of a link who was not to.
#[utoipa::path(
    delete, path = "/links", tag = "service",
    responses((status = 204, description = "No link that was made before holds any more"))
)]
pub(crate) async fn end_all(State(service): State<Coordinator>, caller: Caller) -> Result<StatusCode, Problem> {
    caller.needs(Scope::Operator)?;
    service.store.replace_secret(SECRET, &random()?).await?;
    Ok(StatusCode::NO_CONTENT)
}

impl Opened {
    /// The files whose paths begin with this.
    async fn files(&self, service: &Coordinator, prefix: &str) -> Result<Vec<Artifact>, Problem> {
        match self {
            Self::City(city, generation) => Ok(city_files::listed(service, city, *generation, prefix).await?.1),
            Self::Job(id) => files::listed(service, id, prefix).await,
        }
    }

    /// The file of this path.
    async fn file(&self, service: &Coordinator, path: &str) -> Result<Artifact, Problem> {
        match self {
            Self::City(city, generation) => city_files::named(service, city, *generation, path).await,
            Self::Job(id) => files::named(service, id, path).await,
        }
    }

    /// An error, as if the link had ended, unless a caller sees it.
    async fn seen_by(&self, service: &Coordinator, caller: &Caller) -> Result<(), Problem> {
        let seen = match self {
            Self::City(city, _) => service.sees_city(caller, city, ended).await,
            Self::Job(id) => service.seen_job(caller, id).await.map(drop),
        };
        seen.map_err(|problem| if problem.status == StatusCode::NOT_FOUND.as_u16() { ended() } else { problem })
    }
}

/// What links are signed with just now.
async fn secret(service: &Coordinator) -> Result<String, Problem> {
    let freshness = Freshness::lately(service.store.writes());
    let ask = async |_: Option<String>| service.store.secret(SECRET, &random()?).await;
    Ok(service.answers.secrets.get(SECRET, freshness, ask).await?)
}

/// Who has made a link, as they are now.
async fn maker(service: &Coordinator, name: &str) -> Result<Option<Caller>, Problem> {
    if service.open && !service.store.has_tokens().await? {
        return Ok(Some(Caller::local()));
    }
    if name.starts_with(PERSON) {
        return Ok(service.store.session_of(name).await?.map(Caller::from));
    }
    Ok(service.store.token_of(name).await?.map(Caller::from))
}

fn ended() -> Problem {
    Problem::not_found("this link opens nothing: it has ended, or is not complete; ask whoever sent it for a new one")
}

fn now() -> i64 {
    jiff::Timestamp::now().as_millisecond()
}
