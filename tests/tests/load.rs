//! Many clients and many jobs.
//!
//! Twenty clients for five seconds and a thousand jobs by default; `GABLE_LOAD=full` asks for two hundred clients for a minute, one
//! request a second each, and ten thousand jobs. The time of an answer to a poll is held against its limit where the load is
//! full only: in a short run the slowest of a hundred answers says more about the machine than about the service.
#![cfg(unix)]

use gable_job_store::{NewJob, Store};
use gable_tests::{Database, Service, town};
use serde_json::json;
use std::time::{Duration, Instant};

/// Milliseconds.
const LIMIT: f64 = 50.0;

fn full() -> bool {
    std::env::var("GABLE_LOAD").is_ok_and(|v| v == "full")
}

/// The time below which a part of the answers were given, milliseconds.
fn quantile(times: &mut [f64], part: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    times[((times.len() as f64 * part) as usize).min(times.len() - 1)]
}

#[test]
#[expect(clippy::print_stdout, reason = "the figure is for whoever runs the test")]
fn many_clients_poll_a_running_job() {
    let (clients, time) = if full() { (200, Duration::from_secs(60)) } else { (20, Duration::from_secs(5)) };
    let mesh = town(2, 0.01).join("mesh");
    let mut service = Service::new("many_clients", Database::Sqlite, &mesh, 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "1"]);
    let wanted = json!({ "sampling.step": 0.1, "grid.columns": 16, "grid.rows": 16, "output.report": false });
    let job = service.submit(&mesh, "delft", &wanted);
    let url = format!("{}/api/v1/jobs/{job}", service.address());
    service.wait_for_stage(&job, &["sample", "terrain", "segment"], Duration::from_secs(120));
    let end = Instant::now() + time;
    let threads: Vec<_> = (0..clients)
        .map(|number| {
            let url = url.clone();
            std::thread::spawn(move || {
                let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
                let (mut tag, mut times) = (String::new(), Vec::new());
                std::thread::sleep(Duration::from_millis(number * 1000 / clients));
                while Instant::now() < end {
                    let begin = Instant::now();
                    let mut answer = agent.get(&url).header("if-none-match", &tag).call().expect("an answer");
                    let body = answer.body_mut().read_to_vec().expect("a body");
                    times.push(begin.elapsed().as_secs_f64() * 1000.0);
                    match answer.status().as_u16() {
                        200 => tag = answer.headers()["etag"].to_str().expect("text").to_owned(),
                        304 => assert!(body.is_empty()),
                        other => panic!("status {other}"),
                    }
                    std::thread::sleep(Duration::from_secs(1).saturating_sub(begin.elapsed()));
                }
                times
            })
        })
        .collect();
    let mut times: Vec<f64> = threads.into_iter().flat_map(|t| t.join().expect("a client")).collect();
    let (median, p99) = (quantile(&mut times, 0.5), quantile(&mut times, 0.99));
    let state = service.state(&job);
    println!(
        "{clients} clients, {} answers while the job was {state}: median {median:.1} ms, p99 {p99:.1} ms",
        times.len()
    );
    assert!(times.len() as f64 >= 0.5 * clients as f64 * time.as_secs_f64(), "only {} answers", times.len());
    if full() {
        assert!(p99 < LIMIT, "p99 {p99:.1} ms");
    }
}

#[test]
#[expect(clippy::print_stdout, reason = "the figure is for whoever runs the test")]
fn many_jobs_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let mut service = Service::new("ten_thousand", Database::Sqlite, folder.path(), 5.0).unwrap();
    let _process = service.serve(&[]);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let jobs = if full() { 10_000 } else { 1000 };
    runtime.block_on(async {
        let store = Store::connect(service.database()).await.unwrap();
        for number in 0..jobs {
            let request = json!({ "source": "mesh.obj", "city": format!("city {}", number % 50) });
            let new = NewJob {
                city: format!("city {}", number % 50),
                owner: "local".to_owned(),
                idempotency_key: None,
                request: request.to_string(),
                priority: 0,
                tasks: Vec::new(),
            };
            store.submit(&new).await.unwrap();
        }
        store.close().await;
    });
    for path in ["/jobs", "/jobs?limit=1000", "/jobs?state=successful", "/jobs?state=failed", "/jobs?city=city%207"] {
        let mut times: Vec<f64> = (0..20)
            .map(|_| {
                let begin = Instant::now();
                let page = service.get(path);
                assert_eq!(page["jobs"].as_array().unwrap().is_empty(), path.contains("failed"));
                begin.elapsed().as_secs_f64() * 1000.0
            })
            .collect();
        let median = quantile(&mut times, 0.5);
        println!("{jobs} jobs, {path}: median {median:.1} ms");
        // A page of a thousand is mostly JSON.
        assert!(median < if path.contains("1000") { 4.0 * LIMIT } else { LIMIT }, "{path}: {median:.1} ms");
    }
}
