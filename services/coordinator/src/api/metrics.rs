//! Figures for Prometheus.

use super::jobs::stage_name;
use crate::{Caller, Coordinator, Problem};
use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use gable_job_store::{Attempt, Figures, JobState, TaskState};
use std::fmt::{Display, Write as _};
use std::time::{Duration, Instant};

/// Workers that were not seen for so long are not told.
const LATELY: Duration = Duration::from_secs(120);

/// How long the bytes that are kept are told before they are counted anew: that takes time where there are many.
const COUNTED: Duration = Duration::from_secs(60);

/// Figures for Prometheus: queue, attempts, workers, storage
#[utoipa::path(
    get, path = "/metrics", tag = "service",
    responses((status = 200, description = "Prometheus' text format", body = String, content_type = "text/plain"))
)]
pub(crate) async fn show(service: State<Coordinator>, _: Caller) -> Result<impl IntoResponse, Problem> {
    without_token(service).await
}

/// The same at the listener for supervisors, which the operator lets nobody else reach.
pub(super) async fn without_token(State(service): State<Coordinator>) -> Result<impl IntoResponse, Problem> {
    let figures = service.store.figures(LATELY).await?;
    let stored = stored_bytes(&service).await?;
    Ok(([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text(&figures, stored)))
}

/// Bytes of all that is kept, as they were counted of late.
async fn stored_bytes(service: &Coordinator) -> Result<i64, Problem> {
    let mut counted = service.answers.stored.lock().await;
    match *counted {
        Some((at, bytes)) if at.elapsed() < COUNTED => Ok(bytes),
        _ => {
            let bytes = service.store.stored_bytes().await?;
            *counted = Some((Instant::now(), bytes));
            Ok(bytes)
        }
    }
}

/// A text in Prometheus' format.
#[derive(Default)]
struct Text(String);

impl Text {
    fn metric(&mut self, name: &str, kind: &str, help: &str) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {kind}");
    }

    fn sample(&mut self, name: &str, labels: &[(&str, &str)], value: impl Display) {
        let escaped = |text: &str| text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
        let labels: Vec<String> = labels.iter().map(|(label, v)| format!("{label}=\"{}\"", escaped(v))).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        let _ = writeln!(self.0, "{name}{labels} {value}");
    }
}

fn text(figures: &Figures, stored: i64) -> String {
    let mut out = Text::default();
    out.metric("gable_build_info", "gauge", "The version of the service.");
    out.sample("gable_build_info", &[("version", env!("CARGO_PKG_VERSION"))], 1);

    out.metric("gable_jobs", "gauge", "Jobs by state.");
    for state in JobState::ALL {
        let count = figures.jobs.iter().find(|(s, _)| s == state).map_or(0, |(_, n)| *n);
        out.sample("gable_jobs", &[("state", state.name())], count);
    }
    let name = "gable_oldest_waiting_job_seconds";
    out.metric(name, "gauge", "How long the oldest job waits that no worker has begun; 0 if none waits.");
    out.sample(name, &[], figures.oldest_waiting as f64 / 1000.0);
    let name = "gable_storage_bytes";
    out.metric(name, "gauge", "Bytes of all contents that jobs, cities and uploads refer to, each counted once.");
    out.sample(name, &[], stored);
    let name = "gable_queue_depth";
    out.metric(name, "gauge", "Tasks that a worker could begin now.");
    out.sample(name, &[], figures.queue.iter().map(|q| q.claimable).sum::<i64>());
    let name = "gable_tasks";
    out.metric(name, "gauge", "Tasks of jobs that are not over, by stage and state.");
    for queue in &figures.queue {
        out.sample(name, &[("stage", stage_name(queue.stage)), ("state", queue.state.name())], queue.tasks);
    }
    let name = "gable_tasks_running";
    out.metric(name, "gauge", "Tasks that workers hold.");
    let running = figures.queue.iter().filter(|q| q.state == TaskState::Running).map(|q| q.tasks);
    out.sample(name, &[], running.sum::<i64>());

    let name = "gable_task_attempts_total";
    out.metric(name, "counter", "Attempts at tasks that ended, by stage and outcome.");
    for attempts in &figures.attempts {
        let labels = [("stage", stage_name(attempts.stage)), ("outcome", attempts.outcome.name())];
        out.sample(name, &labels, attempts.tasks);
    }
    let name = "gable_lease_losses_total";
    out.metric(name, "counter", "Tasks whose worker fell silent.");
    let lost = figures.attempts.iter().filter(|a| a.outcome == Attempt::Lost).map(|a| a.tasks);
    out.sample(name, &[], lost.sum::<i64>());
    let name = "gable_task_seconds";
    out.metric(name, "summary", "How long attempts took that ended well, by stage.");
    let done = || figures.attempts.iter().filter(|a| a.outcome == Attempt::Done);
    for attempts in done() {
        let labels = [("stage", stage_name(attempts.stage))];
        out.sample("gable_task_seconds_sum", &labels, attempts.seconds);
        out.sample("gable_task_seconds_count", &labels, attempts.tasks);
    }
    let name = "gable_artifact_bytes_total";
    out.metric(name, "counter", "Bytes of what tasks made, by stage.");
    for attempts in done() {
        out.sample(name, &[("stage", stage_name(attempts.stage))], attempts.bytes);
    }

    let name = "gable_workers";
    out.metric(name, "gauge", "Workers that were seen of late.");
    out.sample(name, &[], figures.workers.len());
    let name = "gable_workers_in_trouble";
    out.metric(name, "gauge", "Workers that were seen of late and take no tasks, for something is wrong with them.");
    out.sample(name, &[], figures.workers.iter().filter(|w| w.trouble.is_some()).count());
    let name = "gable_worker_memory_bytes";
    out.metric(name, "gauge", "Memory of the task that a worker does.");
    for worker in &figures.workers {
        out.sample(name, &[("worker", &worker.id), ("host", &worker.host)], worker.memory);
    }
    out.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_job_store::{Attempts, Queue, Worker};

    #[test]
    fn figures_become_samples() {
        let attempts = |outcome, tasks| Attempts { stage: 1, outcome, tasks, seconds: 2.5, bytes: 70 };
        let worker = Worker {
            id: "w\"1".to_owned(),
            host: "h".to_owned(),
            pid: 1,
            version: String::new(),
            started: 0,
            seen: 0,
            task: None,
            memory: 5,
            node: "n".to_owned(),
            task_memory: 7,
            trouble: Some("rests".to_owned()),
        };
        let figures = Figures {
            jobs: vec![(JobState::Running, 2)],
            oldest_waiting: 1500,
            queue: vec![
                Queue { stage: 1, state: TaskState::Ready, tasks: 9, claimable: 4 },
                Queue { stage: 1, state: TaskState::Running, tasks: 3, claimable: 0 },
            ],
            attempts: vec![attempts(Attempt::Done, 7), attempts(Attempt::Lost, 1)],
            workers: vec![worker],
        };
        let told = text(&figures, 12);
        for line in [
            "gable_jobs{state=\"running\"} 2",
            "gable_jobs{state=\"failed\"} 0",
            "gable_oldest_waiting_job_seconds 1.5",
            "gable_storage_bytes 12",
            "gable_queue_depth 4",
            "gable_tasks{stage=\"sample\",state=\"ready\"} 9",
            "gable_tasks_running 3",
            "gable_task_attempts_total{stage=\"sample\",outcome=\"lost\"} 1",
            "gable_lease_losses_total 1",
            "gable_task_seconds_sum{stage=\"sample\"} 2.5",
            "gable_task_seconds_count{stage=\"sample\"} 7",
            "gable_artifact_bytes_total{stage=\"sample\"} 70",
            "gable_workers_in_trouble 1",
            "gable_worker_memory_bytes{worker=\"w\\\"1\",host=\"h\"} 5",
        ] {
            assert!(told.lines().any(|l| l == line), "{line} is not in\n{told}");
        }
        let names = told.lines().filter_map(|l| l.strip_prefix("# TYPE ")).map(|l| l.split(' ').next());
        let mut seen = std::collections::BTreeSet::new();
        assert!(names.into_iter().all(|n| seen.insert(n)), "each metric is described once");
    }
}
