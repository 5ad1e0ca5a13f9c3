//! Many clients and many jobs.
//!
//! `GABLE_LOAD=full` asks for two hundred clients, one request a second each, that poll a job of a minute and more; by default there
//! are twenty, and the job takes some seconds. The bounds are the same. A machine that does something else for a moment makes
//! answers late and jobs slow, never the other way round: so the best of some runs counts.
#![cfg(unix)]

use gable_tests::{Database, Service, town};
use serde_json::{Value, json};
use sqlx::Connection as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Milliseconds.
const LIMIT: f64 = 50.0;

/// How much longer a job may take if it is polled.
const SLOWER: f64 = 1.05;

/// Most pairs of a job that is left alone and one that is polled.
const PAIRS: usize = 5;

/// One test at a time: they measure.
static QUIET: Mutex<()> = Mutex::new(());

fn full() -> bool {
    std::env::var("GABLE_LOAD").is_ok_and(|v| v == "full")
}

/// The time below which a part of the answers were given, milliseconds.
fn quantile(times: &mut [f64], part: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    times[((times.len() as f64 * part) as usize).min(times.len() - 1)]
}

/// Runs a job of a city of its own; gives how long it took, seconds. `polled` is called while it runs.
fn run_job(service: &Service, mesh: &Path, city: &str, polled: impl FnOnce(&str)) -> f64 {
    // Each block is a process of its own.
    let side = if full() { 22 } else { 5 };
    let wanted = json!({ "sampling.step": 0.3, "grid.columns": side, "grid.rows": side, "output.report": false });
    let job = service.submit(mesh, city, &wanted);
    polled(&job);
    service.expect(&job, "successful", Duration::from_secs(600));
    // The first event of a task, and the end.
    let shown = service.get(&format!("/jobs/{job}"));
    let at = |member: &str| -> f64 {
        let clock = shown[member].as_str().and_then(|t| t.split_once('T')).expect("a time").1.trim_end_matches('Z');
        clock.split(':').fold(0.0, |all, part| 60.0 * all + part.parse::<f64>().expect("a number"))
    };
    (at("finished") - at("started")).rem_euclid(86_400.0)
}

/// Clients that ask for a job once a second each until it is over, by ETag; gives the times of the answers, milliseconds.
fn poll(url: &str, clients: u64) -> Vec<f64> {
    let over = Arc::new(AtomicBool::new(false));
    let threads: Vec<_> = (0..clients)
        .map(|number| {
            let (url, over) = (url.to_owned(), Arc::clone(&over));
            std::thread::spawn(move || {
                let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
                let (mut tag, mut times) = (String::new(), Vec::new());
                std::thread::sleep(Duration::from_millis(number * 1000 / clients));
                while !over.load(Ordering::Relaxed) {
                    let begin = Instant::now();
                    let mut answer = agent.get(&url).header("if-none-match", &tag).call().expect("an answer");
                    let body = answer.body_mut().read_to_vec().expect("a body");
                    times.push(begin.elapsed().as_secs_f64() * 1000.0);
                    match answer.status().as_u16() {
                        200 => {
                            tag = answer.headers()["etag"].to_str().expect("text").to_owned();
                            let job: Value = serde_json::from_slice(&body).expect("JSON");
                            over.fetch_or(job["finished"].is_string(), Ordering::Relaxed);
                        }
                        304 => assert!(body.is_empty()),
                        other => panic!("status {other}"),
                    }
                    std::thread::sleep(Duration::from_secs(1).saturating_sub(begin.elapsed()));
                }
                times
            })
        })
        .collect();
    threads.into_iter().flat_map(|t| t.join().expect("a client")).collect()
}

#[test]
#[expect(clippy::print_stdout, reason = "the figures are for whoever runs the test")]
fn many_clients_poll_a_running_job() {
    let _alone = QUIET.lock().unwrap_or_else(PoisonError::into_inner);
    let clients = if full() { 200 } else { 20 };
    let mesh = town(2, 0.01).join("mesh");
    let mut service = Service::new("many_clients", Database::Sqlite, &mesh, 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "1"]);
    let (mut alone, mut polled, mut p99) = (f64::MAX, f64::MAX, f64::MAX);
    for pair in 0..PAIRS {
        let quiet = run_job(&service, &mesh, &format!("alone {pair}"), |_| ());
        let mut times = Vec::new();
        let watched = run_job(&service, &mesh, &format!("polled {pair}"), |job| {
            times = poll(&format!("{}/api/v1/jobs/{job}", service.address()), clients);
        });
        let (median, worst) = (quantile(&mut times, 0.5), quantile(&mut times, 0.99));
        println!(
            "{clients} clients, {} answers: median {median:.1} ms, p99 {worst:.1} ms; the job took {watched:.2} s, and {quiet:.2} s alone",
            times.len()
        );
        assert!(times.len() as f64 >= 0.5 * clients as f64 * watched, "only {} answers", times.len());
        assert!(!full() || watched >= 60.0, "the job is over after {watched} s");
        (alone, polled, p99) = (alone.min(quiet), polled.min(watched), p99.min(worst));
        if p99 < LIMIT && polled <= SLOWER * alone {
            return;
        }
    }
    panic!("p99 {p99:.1} ms; {polled:.2} s instead of {alone:.2} s");
}

/// Puts many jobs into the table, as they are when they have ended.
fn fill(database: &str, jobs: usize) {
    let statement = format!(
        "INSERT INTO job (id, city, owner, request, state, priority, stage, events, created, started, finished) \
         WITH RECURSIVE numbered (n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM numbered WHERE n + 1 < {jobs}) \
         SELECT '0199a3c4-0000-7000-8000-' || CAST(100000000000 + n AS TEXT), 'city ' || CAST(n % 50 AS TEXT), 'local', \
         '{{\"source\":\"mesh.obj\",\"city\":\"city\",\"parameters\":{{\"sampling.step\":0.25}},\"priority\":0}}', \
         'successful', 0, 7, 12, 1760000000000 + n, 1760000000000 + n, 1760000000000 + n FROM numbered"
    );
    sqlx::any::install_default_drivers();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut connection = sqlx::AnyConnection::connect(database).await.unwrap();
        let done = sqlx::query(sqlx::AssertSqlSafe(statement)).execute(&mut connection).await.unwrap();
        assert_eq!(done.rows_affected(), jobs as u64);
        connection.close().await.unwrap();
    });
}

#[expect(clippy::print_stdout, reason = "the figures are for whoever runs the test")]
fn listed(database: Database) {
    const JOBS: usize = 10_000;
    let _alone = QUIET.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let Some(mut service) = Service::new("ten_thousand", database, folder.path(), 5.0) else { return };
    let _process = service.serve(&[]);
    fill(service.database(), JOBS);
    // Each page of all, by clients that walk from the newest job to the oldest; and lists of some of them.
    for (query, jobs) in [
        ("?limit=100", JOBS),
        ("?limit=1000", JOBS),
        ("?limit=1000&state=successful", JOBS),
        ("?limit=1000&state=failed", 0),
        ("?limit=1000&city=city%207", JOBS / 50),
        ("?limit=1000&owner=local", JOBS),
        ("?limit=50&state=successful&city=city%207", JOBS / 50),
    ] {
        let (mut found, mut next, mut pages) = (0, String::new(), Vec::new());
        loop {
            let path = format!("/jobs{query}{next}");
            let mut best = f64::MAX;
            let mut page = Value::Null;
            for _ in 0..3 {
                let begin = Instant::now();
                page = service.get(&path);
                best = best.min(begin.elapsed().as_secs_f64() * 1000.0);
            }
            pages.push(best);
            found += page["jobs"].as_array().unwrap().len();
            let Some(before) = page["next"].as_str() else { break };
            next = format!("&before={before}");
        }
        assert_eq!(found, jobs, "{query}");
        let (median, slowest) = (quantile(&mut pages, 0.5), quantile(&mut pages, 1.0));
        println!("{database:?} {query}: {} pages, median {median:.1} ms, slowest {slowest:.1} ms", pages.len());
        assert!(slowest < LIMIT, "{query}: {slowest:.1} ms");
    }
}

#[test]
fn many_jobs_are_listed() {
    listed(Database::Sqlite);
}

#[test]
fn many_jobs_are_listed_on_postgres() {
    listed(Database::Postgres);
}
