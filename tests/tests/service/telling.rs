//! What a service tells those who run it: its log, and its figures.

use gable_tests::{Database, Process, Service, town};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(180);
const BOARD: &str = include_str!("../../../deploy/grafana/gable.json");
const RULES: &str = include_str!("../../../deploy/prometheus/gable.rules.yaml");
const SCALING: &str = include_str!("../../../deploy/helm/gable/templates/scaling.yaml");

/// A program that starts tasks, but fails with those of one block.
fn poison(folder: &Path) -> String {
    let path = folder.join("poison.sh");
    let script = r#"#!/bin/bash
IFS= read -r order
case $order in *'"stage":1,"unit":"1_1","input"'*) echo "a pylon fell on it" >&2; exit 1 ;; esac
exec "$@" < <(printf '%s\n' "$order"; exec cat)
"#;
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path.to_str().unwrap().to_owned()
}

/// The lines of a log, as programs read it, with what the span around a line says.
fn lines(process: &Process) -> Vec<Value> {
    let parse = |line: &str| -> Value {
        let mut line: Value = serde_json::from_str(line).unwrap_or_else(|e| panic!("{line}: {e}"));
        if let Some(around) = line["span"].as_object().cloned() {
            for (name, value) in around {
                line[name] = value;
            }
        }
        line
    };
    process.log().lines().map(parse).collect()
}

/// Waits for a line, and gives all.
fn wait_for(process: &Process, message: &str) -> Vec<Value> {
    let begin = Instant::now();
    loop {
        let all = lines(process);
        if all.iter().any(|line| line["message"] == message) {
            return all;
        }
        assert!(begin.elapsed() < Duration::from_secs(20), "{message:?} was not said: {}", process.log());
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn the_log_tells_how_a_job_went() {
    let mesh = town(2, 0.01).join("mesh");
    let mut service = Service::new("telling", Database::Sqlite, &mesh, 5.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("broken.obj"), "v 1 2 3\nf 1 2 3\n").unwrap();
    let root = folder.path().canonicalize().unwrap();
    let common = ["--log-format", "json", "--source-root", root.to_str().unwrap()];
    let coordinator = service.serve(&common);
    let worker = service.work(&[&common[..], &["--task-wrapper", &poison(folder.path())]].concat());
    let wanted = json!({ "sampling.step": 0.5, "grid.columns": 2, "grid.rows": 2, "output.report": false });
    let job = service.submit(&mesh, "delft", &wanted);
    service.expect(&job, "partial", LIMIT);
    let _ = service.get("/jobs?city=secretly");

    let submitted = wait_for(&coordinator, "job submitted");
    let submitted = submitted.iter().find(|l| l["message"] == "job submitted").unwrap();
    assert_eq!(
        (&submitted["job"], &submitted["city"], &submitted["level"]),
        (&json!(job), &json!("delft"), &json!("INFO"))
    );
    assert_eq!(submitted["owner"], "tests");

    let all = wait_for(&worker, "job partial: some of its blocks failed");
    let about = |message: &str| -> Vec<&Value> { all.iter().filter(|l| l["message"] == message).collect() };
    for message in
        ["task claimed", "task done", "task failed, to be tried again", "task failed for good", "city published"]
    {
        let found = about(message);
        assert!(!found.is_empty(), "{message}: {}", worker.log());
        for line in found {
            let named = [&line["job"], &line["city"], &line["stage"], &line["unit"], &line["worker"]];
            assert!(named.iter().all(|v| v.is_string()) && line["attempt"].is_i64(), "{line}");
            assert_eq!((named[0], named[1]), (&json!(job), &json!("delft")));
        }
    }
    let stages: BTreeSet<&str> = about("task done").iter().filter_map(|l| l["stage"].as_str()).collect();
    assert!(stages.is_superset(&["split", "sample", "terrain", "model", "write"].into()), "{stages:?}");
    assert!(about("task done").iter().all(|l| l["seconds"].as_f64().is_some_and(|s| s > 0.0) && l["level"] == "INFO"));
    // All attempts but the last are warnings, with the reason and when it goes on.
    let tried = about("task failed, to be tried again");
    assert_eq!(tried.len(), 2);
    for (line, pause) in tried.iter().zip([2.0, 4.0]) {
        assert_eq!((&line["level"], &line["unit"], &line["stage"]), (&json!("WARN"), &json!("1_1"), &json!("sample")));
        assert!(line["reason"].as_str().unwrap().contains("a pylon fell on it"), "{line}");
        assert_eq!(line["again_in_seconds"], pause);
    }
    let failed = about("task failed for good");
    assert_eq!((failed.len(), &failed[0]["level"]), (1, &json!("ERROR")));
    assert_eq!(about("job partial: some of its blocks failed")[0]["level"], "WARN");

    // A job that fails is an error.
    let broken = service.submit(&root.join("broken.obj"), "nowhere", &json!({}));
    service.expect(&broken, "failed", LIMIT);
    let all = wait_for(&worker, "job failed");
    let failed = all.iter().find(|l| l["message"] == "job failed").unwrap();
    assert_eq!(
        (&failed["level"], &failed["job"], &failed["city"]),
        (&json!("ERROR"), &json!(broken), &json!("nowhere"))
    );

    // Who asked for what, with what answer; without what stands behind the question mark, or in a header.
    let _ = ureq::get(format!("{}/api/v1/jobs", service.address())).call().unwrap_err();
    // What is said goes through a pipe.
    std::thread::sleep(Duration::from_millis(300));
    let access: Vec<Value> = lines(&coordinator).into_iter().filter(|l| l["target"] == "access").collect();
    let find = |method: &str, path: &str, status: u64| {
        let found = access.iter().find(|l| l["method"] == method && l["path"] == path && l["status"] == status);
        found.unwrap_or_else(|| panic!("{method} {path} {status}: {access:?}")).clone()
    };
    let post = find("POST", "/api/v1/jobs", 201);
    assert!(post["token"] == "tests" && post["milliseconds"].as_f64().is_some_and(|ms| ms > 0.0), "{post}");
    assert_eq!(find("GET", "/api/v1/jobs", 401)["token"], Value::Null);
    let log = coordinator.log();
    assert!(!log.contains("secretly") && !log.contains(service.operator()), "{log}");
    figures_are_those_of_board_and_rules(&service);

    // It can be switched off, and nothing else with it.
    drop(coordinator);
    service.set("RUST_LOG", "info,access=off");
    let coordinator = service.serve(&["--log-format", "json"]);
    let _ = service.post(&format!("/jobs/{job}/retry"), &Value::Null);
    let _ = service.post(&format!("/jobs/{job}/cancel"), &Value::Null);
    let all = wait_for(&coordinator, "job cancelled");
    let cancelled = all.iter().find(|l| l["message"] == "job cancelled").unwrap();
    assert_eq!((&cancelled["by"], &cancelled["city"]), (&json!("tests"), &json!("delft")));
    assert!(all.iter().all(|l| l["target"] != "access"), "{all:?}");
}

/// Names of metrics in a text.
fn metrics(text: &str) -> BTreeSet<String> {
    let words = text.split(|c: char| !(c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'));
    words.filter(|w| w.starts_with("gable_")).map(str::to_owned).collect()
}

fn figures_are_those_of_board_and_rules(service: &Service) {
    let told = service.text("/metrics");
    let samples = told.lines().filter(|line| !line.starts_with('#'));
    let known: BTreeSet<String> = samples.flat_map(|line| metrics(line.split(['{', ' ']).next().unwrap())).collect();
    for (what, text) in [("board", BOARD), ("rules", RULES), ("scaling", SCALING)] {
        let asked = metrics(text);
        assert!(!asked.is_empty() && asked.is_subset(&known), "{what}: {:?}", asked.difference(&known));
    }
    let value = |name: &str| -> f64 {
        let line =
            told.lines().find_map(|l| l.strip_prefix(&format!("{name} "))).unwrap_or_else(|| panic!("no {name}"));
        line.parse().unwrap()
    };
    assert!(value("gable_storage_bytes") > 10_000.0, "{told}");
    assert_eq!(value("gable_oldest_waiting_job_seconds"), 0.0);
}
