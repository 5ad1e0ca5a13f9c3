//! The service as a user meets it: `gable serve --all`, a job over REST, and the files of `gable run`.

use gable_tests::{AS_A_JOB, Database, Files, Service, files_of, run_gable, same_models, signal, town};
use serde_json::json;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

#[test]
fn a_job_makes_the_files_of_a_run() {
    let mesh = town(2, 0.02).join("mesh");
    let out = tempfile::tempdir().unwrap();
    let path = out.path().to_str().unwrap();
    let more = ["--step", "0.4", "--grid", "5x3", "--quiet"];
    let _ = run_gable(&[&["run", mesh.to_str().unwrap(), "--out", path], &more[..], &AS_A_JOB].concat()).success();
    let mut service = Service::new("a_job_makes_the_files_of_a_run", Database::Sqlite, &mesh, 5.0).unwrap();
    let mut process = service.serve(&["--all", "--slots", "2"]);
    let wanted = json!({ "sampling.step": 0.4, "grid.columns": 5, "grid.rows": 3 });
    let job = service.submit(&mesh, "delft", &wanted);
    assert_eq!(service.wait(&job, LIMIT), "successful");
    let found: Files = service.files(&job);
    same_models(&found, &files_of(out.path()));
    let events = service.events(&job);
    assert_eq!(events.iter().filter(|e| e["kind"] == "published").count(), 1, "{events:?}");

    // SIGTERM ends it well, though a client still holds its connection.
    signal(process.id(), "TERM");
    assert_eq!(process.wait(Duration::from_secs(20)), Some(0));
}

#[test]
fn bad_input_is_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mesh.obj"), "v 1 2 3\nf 1 2 3\n").unwrap();
    let mut service = Service::new("bad_input_is_told_at_once", Database::Sqlite, folder.path(), 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "1"]);
    let job = service.submit(&folder.path().join("mesh.obj"), "delft", &json!({}));
    assert_eq!(service.wait(&job, LIMIT), "failed");
    let shown = service.get(&format!("/jobs/{job}"));
    let reason = shown["reason"].as_str().unwrap();
    assert!(reason.contains("mesh.obj") && reason.contains("line 2"), "{reason}");
    assert_eq!(service.units(&job).len(), 1, "nothing was tried with it");
}
