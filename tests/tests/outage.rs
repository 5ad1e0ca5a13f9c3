//! A database and an object store that are away for a while in the middle of a job: coordinators and workers wait, and the city is
//! that of an undisturbed run.
#![cfg(unix)]

use gable_tests::{AS_A_JOB, Database, Process, Service, files_of, pause_postgres, run_gable, same_models, town};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(180);
const AWAY: Duration = Duration::from_secs(20);

fn mesh() -> PathBuf {
    town(2, 0.01).join("mesh")
}

fn parameters() -> Value {
    json!({ "sampling.step": 0.5, "grid.columns": 8, "grid.rows": 8, "output.report": false })
}

/// The job ends as if nothing had been: the same city, nothing done or published twice, nothing given up. Somebody has noticed.
#[expect(clippy::print_stdout, reason = "the figure is for whoever runs the test")]
fn ends_well(service: &Service, job: &str, mesh: &Path, away: Instant, log: impl Fn() -> String) {
    let gone = away.elapsed();
    service.expect(job, "successful", LIMIT);
    println!("away for {gone:?} in all; over {:?} after it was back", away.elapsed() - gone);
    let out = tempfile::tempdir().unwrap();
    let path = out.path().to_str().unwrap();
    let more = ["--step", "0.5", "--grid", "8x8", "--set", "output.report=false", "--quiet"];
    let _ = run_gable(&[&["run", mesh.to_str().unwrap(), "--out", path], &more[..], &AS_A_JOB].concat()).success();
    same_models(&service.files(job), &files_of(out.path()));
    let events = service.events(job);
    assert_eq!(events.iter().filter(|e| e["kind"] == "published").count(), 1);
    let mut ended: BTreeMap<(String, String), usize> = BTreeMap::new();
    for event in events.iter().filter(|e| e["kind"] == "done") {
        *ended.entry((event["stage"].to_string(), event["unit"].to_string())).or_default() += 1;
    }
    assert!(ended.values().all(|n| *n == 1), "{ended:?}");
    assert!(!events.iter().any(|e| e["kind"] == "failed"), "no task was given up");
    let log = log();
    assert!(log.contains("trying again") || log.contains("no task can be had"), "nobody noticed: {log}");
}

#[test]
fn database_and_object_store_are_away_in_mid_job() {
    let mesh = mesh();
    let Some(mut service) = Service::new("outage", Database::Postgres, &mesh, 2.0) else { return };
    let _first = service.serve(&[]);
    let second = service.serve(&[]);
    let workers: Vec<Process> = (0..4).map(|_| service.work(&[])).collect();
    let job = service.submit(&mesh, "delft", &parameters());
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
    ends_well(&service, &job, &mesh, begin, || second.log() + &workers.iter().map(Process::log).collect::<String>());
}

#[test]
fn sqlite_is_held_by_another_program_in_mid_job() {
    let mesh = mesh();
    let mut service = Service::new("held", Database::Sqlite, &mesh, 2.0).unwrap();
    let _coordinator = service.serve(&[]);
    let workers: Vec<Process> = (0..4).map(|_| service.work(&[])).collect();
    let job = service.submit(&mesh, "delft", &parameters());
    service.wait_for_stage(&job, &["sample", "terrain", "segment"], LIMIT);
    let begin = Instant::now();
    let script = "import sqlite3, sys, time\n\
                  database = sqlite3.connect(sys.argv[1], isolation_level=None, timeout=30)\n\
                  database.execute('BEGIN EXCLUSIVE')\n\
                  print('held', flush=True)\n\
                  time.sleep(float(sys.argv[2]))\n\
                  database.execute('ROLLBACK')\n";
    let file = service.database().trim_start_matches("sqlite:").to_owned();
    let mut python = Command::new("python3");
    let python = python.args(["-c", script, &file, &AWAY.as_secs().to_string()]).stdout(Stdio::piped());
    let Ok(mut holder) = python.spawn() else {
        return gable_tests::skip("sqlite_is_held_by_another_program_in_mid_job", "Python is not installed");
    };
    let mut line = String::new();
    BufReader::new(holder.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert_eq!(line, "held\n");
    assert!(holder.wait().unwrap().success());
    ends_well(&service, &job, &mesh, begin, || workers.iter().map(Process::log).collect());
}
