//! The pages for people: the dashboard, and a plain one that needs nothing but a browser.

use crate::headers::{self, DASHBOARD};
use crate::pages::time;
use crate::{Caller, Coordinator, Problem};
use axum::Router;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use gable_job_store::JobFilter;
use std::fmt::Write as _;

/// Name, media type, tag and content of each file of the dashboard; none where it was built without Node.
static FILES: &[(&str, &str, &str, &[u8])] = &include!(concat!(env!("OUT_DIR"), "/dashboard_files.rs"));

/// Most jobs on the plain page.
const PLAIN: i64 = 200;

pub(super) fn router() -> Router<Coordinator> {
    let page = if FILES.is_empty() { get(plain) } else { get(|headers| file(headers, "index.html".to_owned())) };
    Router::new()
        .route("/", page)
        .route("/plain", get(plain))
        .route("/assets/{name}", get(|headers, Path(name): Path<String>| file(headers, format!("assets/{name}"))))
}

async fn file(headers: HeaderMap, name: String) -> Response {
    let Some((_, kind, tag, bytes)) = FILES.iter().find(|(known, ..)| *known == name) else {
        return Problem::not_found("the dashboard has no such file").into_response();
    };
    let known = headers.get(header::IF_NONE_MATCH).and_then(|v| v.to_str().ok());
    // Compression turns tags into weak ones.
    let same = known.is_some_and(|list| list.split(',').any(|t| t.trim().trim_start_matches("W/") == *tag));
    let mut answer = if same { StatusCode::NOT_MODIFIED.into_response() } else { (*bytes).into_response() };
    let fixed = [
        (header::CONTENT_TYPE, *kind),
        (header::ETAG, *tag),
        (header::CACHE_CONTROL, "no-cache"),
        (header::CONTENT_SECURITY_POLICY, DASHBOARD),
    ];
    for (name, value) in fixed {
        answer.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    answer
}

/// The newest jobs as a table, without scripts.
async fn plain(State(service): State<Coordinator>, caller: Caller) -> Result<Response, Problem> {
    let filter = JobFilter { seen_by: caller.sees(), ..JobFilter::default() };
    let jobs = service.store.jobs(&filter, PLAIN).await?;
    let mut rows = String::new();
    for job in &jobs {
        let reason = job.reason.as_deref().unwrap_or_default();
        let finished = job.finished.map(time).unwrap_or_default();
        let cells =
            [&job.id, &job.city, job.state.name(), super::jobs::stage_name(job.stage), &job.owner, &finished, reason];
        rows += "<tr>";
        cells.iter().for_each(|cell| {
            let _ = write!(rows, "<td>{}", escaped(cell));
        });
        rows += "\n";
    }
    let empty =
        if jobs.is_empty() { "<p>No job yet. <a href=\"docs\">/docs</a> shows how to submit one.</p>" } else { "" };
    let page = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <meta http-equiv=\"refresh\" content=\"10\">\n<title>gable: jobs</title>\n\
         <style>:root{{color-scheme:light dark}}body{{font:15px system-ui;margin:1.5rem}}table{{border-collapse:collapse}}\
         td,th{{text-align:left;padding:.3rem .7rem;border-bottom:1px solid #8886}}</style>\n\
         <h1>Jobs</h1>\n<table>\n<tr><th>Id<th>City<th>State<th>Stage<th>Who<th>Finished<th>Reason\n{rows}</table>\n{empty}\n\
         <p>The newest {PLAIN}. <a href=\"docs\">The API</a> has all.</p>\n"
    );
    Ok(([(header::CACHE_CONTROL, "no-store"), (header::CONTENT_SECURITY_POLICY, headers::PLAIN)], Html(page))
        .into_response())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_wrote_is_no_markup() {
        assert_eq!(escaped("<b title=\"x\">&"), "&lt;b title=&quot;x&quot;&gt;&amp;");
    }

    #[test]
    fn the_first_page_is_small_and_needs_nothing_from_elsewhere() {
        let Some((.., index)) = FILES.iter().find(|(name, ..)| *name == "index.html") else { return };
        let index = String::from_utf8_lossy(index);
        assert!(
            !index.contains("http:") || index.matches("http:").count() == index.matches("http://www.w3.org").count()
        );
        assert!(!index.contains("viewer"), "the viewer is loaded when it is shown");
        let first: usize = FILES.iter().filter(|(name, ..)| index.contains(name)).map(|(.., bytes)| bytes.len()).sum();
        assert!(first < 150_000, "{first} bytes, before compression");
    }
}
