//! `gable submit`, `status`, `cancel`, `retry`: jobs of a service on another machine.

use crate::cli::{CancelArgs, DeleteArgs, JobArgs, RetryArgs, Send, StatusArgs, SubmitArgs};
use crate::exit::{Outcome, UsageError};
use crate::remote::{Remote, RemoteError};
use crate::send::{self, Mesh};
use crate::{table, terminal};
use gable_coordinator::escaped;
use serde_json::{Map, Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// How often a job that is watched is asked for.
const PACE: Duration = Duration::from_secs(1);

/// How long a service that does not answer is waited for while a job is watched.
const OUTAGE: Duration = Duration::from_secs(300);

/// A job that was watched to its end, and did not end well.
#[derive(Debug, thiserror::Error)]
#[error("job {job} {state}{}", reason.as_ref().map(|r| format!(": {r}")).unwrap_or_default())]
struct EndedBadly {
    job: String,
    state: String,
    reason: Option<String>,
}

/// What `--set` says, as the parameters of a job.
pub(super) fn settings(settings: &[String]) -> Result<Map<String, Value>, UsageError> {
    let pair = |setting: &String| match setting.split_once('=') {
        Some((name, value)) => Ok((name.to_owned(), value.into())),
        None => Err(UsageError(format!("--set {setting:?} has no value: write --set NAME=VALUE"))),
    };
    settings.iter().map(pair).collect()
}

/// Submits a job, and sends its mesh if the service cannot see it.
pub(crate) fn submit(args: &SubmitArgs, quiet: bool) -> anyhow::Result<Outcome> {
    let mut body = json!({
        "source": args.source, "city": args.city, "priority": args.priority, "parameters": settings(&args.settings)?,
    });
    if let Some(preset) = &args.preset {
        body["preset"] = preset.as_str().into();
    }
    let remote = Remote::new(&args.remote)?;
    // With a key, a request whose answer was lost can be sent again.
    let key = args.key.clone().unwrap_or_else(|| uuid::Uuid::now_v7().to_string());
    let ask = |body: &Value| remote.post("/jobs", &[("idempotency-key", &key)], Some(body));
    let path = Path::new(&args.source);
    let elsewhere = ["s3://", "upload:"].iter().any(|start| args.source.starts_with(start));
    let ours = args.send != Send::Never && !elsewhere && (args.send == Send::Always || path.exists());
    if !ours {
        return end(&remote, ask(&body)?, args.watch, args.json);
    }
    // A service on this machine may see the same file; one elsewhere may have another under the same path.
    if args.send == Send::Auto && remote.is_here() {
        let whole = path.canonicalize().map_err(|e| UsageError(format!("{}: {e}", path.display())))?;
        body["source"] = whole.to_string_lossy().into();
        match ask(&body) {
            Err(RemoteError::NotSeen(reason)) => tracing::info!("{reason}"),
            result => return end(&remote, result?, args.watch, args.json),
        }
    }
    body["source"] = send::send(&remote, &Mesh::at(path)?, &args.city, quiet)?.into();
    end(&remote, ask(&body)?, args.watch, args.json)
}

/// Shows a job, or lists jobs.
pub(crate) fn status(args: &StatusArgs) -> anyhow::Result<Outcome> {
    let remote = Remote::new(&args.remote)?;
    if let Some(id) = &args.job {
        let job = remote.get(&format!("/jobs/{}", escaped(id)))?;
        if args.watch {
            return end(&remote, job, true, args.json);
        }
        if args.json {
            terminal::json(&job);
        } else {
            terminal::stdout(&shown(&job));
        }
        return Ok(Outcome::Success);
    }
    let mut path = format!("/jobs?limit={}", args.limit);
    for (name, value) in [("state", &args.state), ("city", &args.city)] {
        if let Some(value) = value {
            path += &format!("&{name}={}", escaped(value));
        }
    }
    let page = remote.get(&path)?;
    if args.json {
        terminal::json(&page["jobs"]);
        return Ok(Outcome::Success);
    }
    let mut rows = vec![["job", "city", "state", "stage", "owner", "created"].map(str::to_owned).to_vec()];
    for job in page["jobs"].as_array().into_iter().flatten() {
        rows.push(["id", "city", "state", "stage", "owner", "created"].map(|member| text(&job[member])).to_vec());
    }
    terminal::stdout(&table::render(&rows));
    Ok(Outcome::Success)
}

/// Cancels a job.
pub(crate) fn cancel(args: &CancelArgs) -> anyhow::Result<Outcome> {
    let (_, job) = steered(&args.of, "cancel")?;
    tell(&job, args.of.json, "state");
    Ok(Outcome::Success)
}

/// Deletes a job that is over.
pub(crate) fn delete(args: &DeleteArgs) -> anyhow::Result<Outcome> {
    let id = &args.of.job;
    Remote::new(&args.of.remote)?.delete(&format!("/jobs/{}", escaped(id)))?;
    if args.of.json {
        terminal::json(&json!({ "deleted": id }));
    } else {
        terminal::stdout(&format!("job {id} is gone"));
    }
    Ok(Outcome::Success)
}

/// Does what failed of a job again.
pub(crate) fn retry(args: &RetryArgs) -> anyhow::Result<Outcome> {
    let (remote, job) = steered(&args.of, "retry")?;
    end(&remote, job, args.watch, args.of.json)
}

/// Has something done with a job; gives the service, and the job afterwards.
fn steered(of: &JobArgs, what: &str) -> anyhow::Result<(Remote, Value)> {
    let remote = Remote::new(&of.remote)?;
    let job = remote.post(&format!("/jobs/{}/{what}", escaped(&of.job)), &[], None)?;
    Ok((remote, job))
}

/// Tells a job; with `watch`, when it is over.
fn end(remote: &Remote, job: Value, watch: bool, json: bool) -> anyhow::Result<Outcome> {
    if !watch {
        tell(&job, json, "id");
        return Ok(Outcome::Success);
    }
    let job = watched(remote, &text(&job["id"]))?;
    tell(&job, json, "id");
    match job["state"].as_str() {
        Some("successful") => Ok(Outcome::Success),
        Some("partial") => Ok(Outcome::Partial),
        _ => {
            let reason = job["reason"].as_str().map(str::to_owned);
            Err(EndedBadly { job: text(&job["id"]), state: text(&job["state"]), reason }.into())
        }
    }
}

/// Waits until a job is over, telling what changes.
fn watched(remote: &Remote, id: &str) -> anyhow::Result<Value> {
    let path = format!("/jobs/{}", escaped(id));
    let (mut tag, mut told, mut away) = (String::new(), String::new(), None);
    loop {
        match remote.changed(&path, &tag) {
            Ok(Some((job, new))) => {
                away = None;
                tag = new;
                let line = progress(&job);
                if line != told {
                    terminal::stderr_line(&line);
                    told = line;
                }
                if job["finished"].is_string() {
                    return Ok(job);
                }
            }
            Ok(None) => away = None,
            // A coordinator may be started anew: its jobs go on.
            Err(e @ (RemoteError::Unreachable { .. } | RemoteError::Failed { .. })) => {
                if away.get_or_insert_with(Instant::now).elapsed() > OUTAGE {
                    return Err(e.into());
                }
                tracing::warn!("{e}");
            }
            Err(e) => return Err(e.into()),
        }
        std::thread::sleep(PACE);
    }
}

/// How far a job is, in a line.
fn progress(job: &Value) -> String {
    let (state, stage) = (text(&job["state"]), text(&job["stage"]));
    let under_way = job["progress"].as_array().into_iter().flatten().find(|p| p["stage"] == job["stage"]);
    let count =
        |names: &[&str]| -> i64 { names.iter().filter_map(|name| under_way.and_then(|p| p[*name].as_i64())).sum() };
    let all = count(&["ready", "running", "done", "failed", "cancelled"]);
    if all == 0 || job["finished"].is_string() {
        return format!("{state}: {stage}");
    }
    let failed = count(&["failed"]);
    let failed = if failed == 0 { String::new() } else { format!(", {failed} failed") };
    format!("{state}: {stage} {} of {all}{failed}", count(&["done"]))
}

/// Most units that are named for one reason.
const NAMED: usize = 8;

/// What failed of a job: each reason once, with what to do and the units.
fn failures(job: &Value) -> String {
    let mut lines = String::new();
    for failure in job["failures"].as_array().into_iter().flatten() {
        let count = failure["count"].as_u64().unwrap_or(0);
        let units = if count == 1 { "unit" } else { "units" };
        lines += &format!("\n{count} {units} failed: {}\n", text(&failure["reason"]));
        if let Some(advice) = failure["what_to_do"].as_str() {
            lines += &format!("  {advice}\n");
        }
        let named = failure["units"].as_array().into_iter().flatten().take(NAMED);
        let mut names: Vec<String> = named.map(|u| format!("{} {}", text(&u["stage"]), text(&u["unit"]))).collect();
        let rest = usize::try_from(count).unwrap_or(0).saturating_sub(names.len());
        if rest > 0 {
            names.push(format!("and {rest} more"));
        }
        lines += &format!("  {}\n", names.join(", "));
    }
    lines
}

/// A job, stage by stage.
fn shown(job: &Value) -> String {
    let mut lines = String::new();
    let failures = failures(job);
    for member in ["id", "city", "source", "owner", "state", "reason", "created", "started", "finished"] {
        // The reason of a job is that of a unit.
        if job[member].is_string() && (member != "reason" || failures.is_empty()) {
            lines += &format!("{member:<10}{}\n", text(&job[member]));
        }
    }
    let columns = ["stage", "ready", "running", "done", "failed", "cancelled"];
    let mut rows = vec![columns.map(str::to_owned).to_vec()];
    for stage in job["progress"].as_array().into_iter().flatten() {
        rows.push(columns.map(|member| text(&stage[member])).to_vec());
    }
    format!("{lines}\n{}{failures}", table::render(&rows))
}

/// A job as JSON, or one member of it.
fn tell(job: &Value, json: bool, member: &str) {
    if json {
        terminal::json(job);
    } else {
        terminal::stdout(&text(&job[member]));
    }
}

/// A text as it is, anything else as JSON.
pub(super) fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_that_of_the_stage_under_way() {
        let stage = |name: &str, ready: i64, done: i64, failed: i64| json!({ "stage": name, "ready": ready, "running": 1, "done": done, "failed": failed, "cancelled": 0 });
        let job = json!({ "state": "running", "stage": "sample", "progress": [stage("split", 0, 1, 0), stage("sample", 3, 4, 2)] });
        assert_eq!(progress(&job), "running: sample 4 of 10, 2 failed");
        assert_eq!(progress(&json!({ "state": "accepted", "stage": "split", "progress": [] })), "accepted: split");
    }

    #[test]
    fn a_reason_is_told_once() {
        let unit = |n: u32| json!({ "stage": "sample", "kind": "block", "unit": format!("{n}_0"), "attempts": 3 });
        let failure = json!({ "reason": "used 5 MB", "what_to_do": "Give it more.", "count": 12,
            "units": (0..12).map(unit).collect::<Vec<_>>() });
        let job =
            json!({ "id": "j", "reason": "sample of every block: used 5 MB", "progress": [], "failures": [failure] });
        let text = shown(&job);
        assert_eq!(text.matches("used 5 MB").count(), 1, "{text}");
        assert!(text.contains("12 units failed: used 5 MB\n  Give it more.\n  sample 0_0, sample 1_0,"), "{text}");
        assert!(text.ends_with("sample 7_0, and 4 more\n"), "{text}");
        let plain = shown(&json!({ "id": "j", "reason": "cancelled by ann", "progress": [] }));
        assert!(plain.contains("cancelled by ann"), "{plain}");
    }
}
