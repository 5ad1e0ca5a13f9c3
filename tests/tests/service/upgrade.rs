//! Two versions of the program at one database, and restarts that end whole groups of processes.

use gable_tests::{Database, Service, signal, town};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(240);

/// What builds for tests take for their version.
const VERSION: &str = "GABLE_TEST_VERSION";

fn mesh() -> PathBuf {
    town(2, 0.01).join("mesh")
}

fn parameters() -> Value {
    json!({ "sampling.step": 0.4, "grid.columns": 4, "grid.rows": 4, "output.report": false })
}

/// What is so in time.
fn until(what: &str, mut is: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is() {
        assert!(begin.elapsed() < Duration::from_secs(60), "never: {what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The ids of the workers of a version.
fn workers(service: &Service, version: &str) -> BTreeSet<String> {
    let all = service.get("/workers");
    let of_version = all.as_array().expect("a list").iter().filter(|w| w["version"] == version);
    of_version.filter_map(|w| w["id"].as_str().map(str::to_owned)).collect()
}

/// Who has done the units of a job.
fn doers(service: &Service, job: &str) -> BTreeSet<String> {
    let units = service.get(&format!("/jobs/{job}/blocks"));
    units.as_array().expect("a list").iter().filter_map(|u| u["worker"].as_str().map(str::to_owned)).collect()
}

/// An upgrade with a job under way: it ends with the version that began it, as long as that has a worker; when it has none, another begins
/// it anew. Never are there results of both.
fn a_job_is_of_one_version(database: Database) {
    let Some(mut service) = Service::new("versions", database, &mesh(), 3.0) else { return };
    let _coordinator = service.serve(&[]);
    service.set(VERSION, "1.0.0");
    let mut old = service.work(&[]);
    until("the old one is there", || workers(&service, "1.0.0").len() == 1);
    let job = service.submit(&mesh(), "delft", &parameters());
    until("it has begun", || !doers(&service, &job).is_empty());
    service.set(VERSION, "2.0.0");
    let new = service.work(&["--slots", "2"]);
    until("the new one is there", || workers(&service, "2.0.0").len() == 2);
    let (olds, news) = (workers(&service, "1.0.0"), workers(&service, "2.0.0"));
    until("some blocks are done", || service.units(&job).iter().filter(|u| u[2] == "done").count() > 4);
    assert_eq!(doers(&service, &job), olds, "the new ones leave it alone");
    // Its last worker goes, and does not say so.
    old.kill();
    service.expect(&job, "successful", LIMIT);
    assert!(doers(&service, &job).is_subset(&news), "{:?} of {news:?}", doers(&service, &job));
    let told: Vec<String> =
        service.events(&job).iter().filter_map(|e| e["message"].as_str().map(str::to_owned)).collect();
    assert!(told.iter().any(|m| m.contains("begun anew by gable 2.0.0: gable 1.0.0")), "{told:?}");
    assert!(new.log().contains("job begun anew"), "{}", new.log());
    // What it made is what either would have made alone.
    let again = service.submit(&mesh(), "leiden", &parameters());
    service.expect(&again, "successful", LIMIT);
    let hashes = |job: &str| {
        let files = service.get(&format!("/jobs/{job}/files"));
        let models = files
            .as_array()
            .expect("a list")
            .iter()
            .filter(|f| f["path"].as_str().is_some_and(|p| p.ends_with(".gml")));
        models.map(|f| f.to_string()).collect::<Vec<_>>()
    };
    assert!(!hashes(&job).is_empty());
    assert_eq!(hashes(&job), hashes(&again));
}

/// A supervisor that ends all processes of a unit at once, children first: no attempt is lost.
fn a_restart_burns_no_attempt(database: Database) {
    let Some(mut service) = Service::new("restart", database, &mesh(), 30.0) else { return };
    let mut process = service.serve(&["--all", "--slots", "2", "--grace", "5"]);
    let job = service.submit(&mesh(), "delft", &parameters());
    for _ in 0..2 {
        let children = || {
            let listed = Command::new("pgrep").arg("-P").arg(process.id().to_string()).output().expect("pgrep runs");
            String::from_utf8_lossy(&listed.stdout).lines().filter_map(|pid| pid.parse().ok()).collect::<Vec<u32>>()
        };
        until("tasks are under way", || !children().is_empty());
        for child in children() {
            // One may have ended by itself just now.
            let _ = Command::new("kill").arg("-TERM").arg(child.to_string()).status();
        }
        signal(process.id(), "TERM");
        assert_eq!(process.wait(Duration::from_secs(60)), Some(0), "{}", process.log());
        process = service.serve(&["--all", "--slots", "2", "--grace", "5"]);
    }
    service.expect(&job, "successful", LIMIT);
    let units = service.get(&format!("/jobs/{job}/blocks"));
    let tried: Vec<&Value> =
        units.as_array().expect("a list").iter().filter(|u| u["attempts"].as_i64().is_some_and(|n| n > 1)).collect();
    assert!(tried.is_empty(), "{tried:?}");
    let back =
        service.events(&job).iter().filter(|e| e["message"].as_str() == Some("handed back by its worker")).count();
    assert!(back >= 1, "nothing was interrupted: {:?}", service.events(&job));
}

mod sqlite {
    #[test]
    fn a_job_is_of_one_version() {
        super::a_job_is_of_one_version(super::Database::Sqlite);
    }

    #[test]
    fn a_restart_burns_no_attempt() {
        super::a_restart_burns_no_attempt(super::Database::Sqlite);
    }
}

mod on_postgres {
    #[test]
    fn a_job_is_of_one_version() {
        super::a_job_is_of_one_version(super::Database::Postgres);
    }

    #[test]
    fn a_restart_burns_no_attempt() {
        super::a_restart_burns_no_attempt(super::Database::Postgres);
    }
}
