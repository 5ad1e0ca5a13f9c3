//! A database and an object store that are away for a while in the middle of a job: two coordinators and four workers wait, and the
//! city is that of an undisturbed run.
#![cfg(unix)]

use gable_tests::{Database, Process, Service, files_of, pause_postgres, run_gable, same_models, town};
use serde_json::json;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(180);
const AWAY: Duration = Duration::from_secs(20);

#[test]
#[expect(clippy::print_stdout, reason = "the figure is for whoever runs the test")]
fn database_and_object_store_are_away_in_mid_job() {
    let mesh = town(2, 0.01).join("mesh");
    let Some(mut service) = Service::new("outage", Database::Postgres, &mesh, 2.0) else { return };
    let _first = service.serve(&[]);
    let second = service.serve(&[]);
    let workers: Vec<Process> = (0..4).map(|_| service.work(&[])).collect();
    let wanted = json!({ "sampling.step": 0.5, "grid.columns": 8, "grid.rows": 8, "output.report": false });
    let job = service.submit(&mesh, "delft", &wanted);
    service.wait_for_stage(&job, &["sample", "terrain", "segment"], LIMIT);
    // One after the other goes, and comes again in the same order: for some seconds both are away.
    let begin = Instant::now();
    service.objects().cut(true);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(AWAY);
            service.objects().cut(false);
        });
        std::thread::sleep(AWAY / 2);
        pause_postgres(AWAY);
    });
    let away = begin.elapsed();
    service.expect(&job, "successful", LIMIT);
    println!("away for {away:?} in all; over {:?} after it was back", begin.elapsed() - away);

    let out = tempfile::tempdir().unwrap();
    let path = out.path().to_str().unwrap();
    let more = ["--step", "0.5", "--grid", "8x8", "--set", "output.report=false", "--quiet"];
    let _ = run_gable(&[&["run", mesh.to_str().unwrap(), "--out", path], &more[..]].concat()).success();
    same_models(&service.files(&job), &files_of(out.path()));
    let events = service.events(&job);
    assert_eq!(events.iter().filter(|e| e["kind"] == "published").count(), 1);
    let mut ended: BTreeMap<(String, String), usize> = BTreeMap::new();
    for event in events.iter().filter(|e| e["kind"] == "done") {
        *ended.entry((event["stage"].to_string(), event["unit"].to_string())).or_default() += 1;
    }
    assert!(ended.values().all(|n| *n == 1), "{ended:?}");
    assert!(!events.iter().any(|e| e["kind"] == "failed"), "no task was given up");
    let log = second.log() + &workers.iter().map(Process::log).collect::<String>();
    assert!(log.contains("trying again") || log.contains("no task can be had"), "nobody noticed: {log}");
}
