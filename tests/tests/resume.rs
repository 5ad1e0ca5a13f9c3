//! Runs that are killed or interrupted: the same command goes on, and the result is as if nothing had happened.
#![cfg(unix)]

use gable_tests::{bytes_of_models, run_gable, start_gable, tiles, town};
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

fn arguments(out: &Path) -> Vec<String> {
    let mesh = town(2, 0.02).join("mesh");
    let out = out.to_str().unwrap();
    [
        "run",
        mesh.to_str().unwrap(),
        "--out",
        out,
        "--grid",
        "4x4",
        "--threads",
        "1",
        "--json",
        "--set",
        "output.report=false",
    ]
    .map(str::to_owned)
    .to_vec()
}

/// Waits until the run says on standard error that a stage has ended that `wanted` names.
fn wait_for(child: &mut Child, wanted: &str) -> String {
    use std::io::{BufRead as _, BufReader};
    let mut seen = String::new();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    for line in lines.by_ref() {
        let line = line.unwrap();
        seen += &line;
        seen.push('\n');
        if line.contains(wanted) {
            // The rest is read in the background, so that the child never waits for a full pipe.
            std::thread::spawn(move || lines.for_each(drop));
            return seen;
        }
    }
    panic!("the run ended before it said {wanted:?}:\n{seen}");
}

fn send(child: &Child, signal: &str) {
    let status = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

fn wait(mut child: Child, limit: Duration) -> Option<i32> {
    let start = Instant::now();
    while start.elapsed() < limit {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().ok();
    child.wait().ok();
    panic!("the run did not stop in {limit:?}");
}

fn uninterrupted() -> std::collections::BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let _ = run_gable(&arguments(folder.path())).success();
    bytes_of_models(folder.path())
}

fn reused(summary: &serde_json::Value) -> usize {
    summary["blocks"].as_array().unwrap().iter().filter(|b| b["status"]["state"] == "reused").count()
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let expected = uninterrupted();
    for stage in ["split", "sample", "segment", "model"] {
        let folder = tempfile::tempdir().unwrap();
        let mut child = start_gable(&arguments(folder.path()));
        wait_for(&mut child, stage);
        send(&child, "-KILL");
        wait(child, Duration::from_secs(10));
        let summary = run_gable(&arguments(folder.path())).success().json();
        if stage != "split" {
            assert!(reused(&summary) > 0, "blocks are done again after {stage}: {}", summary["blocks"]);
        }
        let found = bytes_of_models(folder.path());
        assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        for (name, bytes) in &expected {
            assert!(bytes == &found[name], "{name} differs after a kill in {stage}");
        }
    }
}

#[test]
fn ctrl_c_stops_soon_and_the_run_goes_on_later() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = start_gable(&arguments(folder.path()));
    wait_for(&mut child, "sample");
    send(&child, "-INT");
    assert_eq!(wait(child, Duration::from_secs(60)), Some(130));
    assert!(!folder.path().join("city.city.jsonl").exists(), "no half city is left");
    let summary = run_gable(&arguments(folder.path())).success().json();
    assert!(reused(&summary) > 0, "{}", summary["blocks"]);
}

#[test]
fn another_run_into_the_same_folder_leaves_nothing_stale() {
    let folder = tempfile::tempdir().unwrap();
    let _ = run_gable(&arguments(folder.path())).success();
    let before = bytes_of_models(folder.path());
    let _ = run_gable(&arguments(folder.path())).success();
    assert!(before == bytes_of_models(folder.path()), "the same command gives the same bytes");

    let coarser = arguments(folder.path()).into_iter().map(|a| if a == "4x4" { "2x2".to_owned() } else { a });
    let _ = run_gable(&coarser.collect::<Vec<_>>()).success();
    let index: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("index.json")).unwrap()).unwrap();
    let found = tiles(folder.path()).len();
    assert!(found <= 4, "{found} tiles of a grid of 2 × 2: those of the run before are still there");
    let listed = serde_json::to_string(&index).unwrap();
    for tile in tiles(folder.path()) {
        assert!(listed.contains(&format!("tiles/{}.city.json", tile.name)), "{} is not in the index", tile.name);
    }
}
