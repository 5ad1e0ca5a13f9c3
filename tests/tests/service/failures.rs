//! Jobs that go on whatever dies: real coordinators and workers, killed, frozen, and poisoned; on both databases.

use gable_tests::{AS_A_JOB, Database, Files, Process, Service, files_of, run_gable, same_models, signal, town};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// Seconds.
const LEASE: f64 = 2.0;
const LIMIT: Duration = Duration::from_secs(180);

/// Each test on each database.
macro_rules! on_both {
    ($($name:ident),+ $(,)?) => {
        mod sqlite {
            $(
                #[test]
                fn $name() {
                    super::$name(super::Database::Sqlite);
                }
            )+
        }
        mod on_postgres {
            $(
                #[test]
                fn $name() {
                    super::$name(super::Database::Postgres);
                }
            )+
        }
    };
}

on_both!(
    killed_workers_change_nothing,
    a_frozen_worker_comes_too_late,
    a_block_that_dies_costs_itself,
    a_killed_coordinator_changes_nothing,
);

fn mesh() -> PathBuf {
    town(2, 0.01).join("mesh")
}

/// Parameters of a job of `side` × `side` blocks that takes some seconds.
fn parameters(side: u32) -> Value {
    json!({ "sampling.step": 0.5, "grid.columns": side, "grid.rows": side, "output.report": false })
}

/// What `gable run` makes with them.
fn expected(side: u32) -> &'static Files {
    static EXPECTED: Mutex<BTreeMap<u32, &'static Files>> = Mutex::new(BTreeMap::new());
    let mut made = EXPECTED.lock().unwrap_or_else(PoisonError::into_inner);
    made.entry(side).or_insert_with(|| {
        let out = tempfile::tempdir().unwrap();
        let (mesh, path, grid) = (mesh(), out.path().to_str().unwrap(), format!("{side}x{side}"));
        let more = ["--step", "0.5", "--grid", &grid, "--set", "output.report=false", "--quiet"];
        let _ = run_gable(&[&["run", mesh.to_str().unwrap(), "--out", path], &more[..], &AS_A_JOB].concat()).success();
        Box::leak(Box::new(files_of(out.path())))
    })
}

/// Milliseconds since 1970.
fn now() -> i64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_millis() as i64
}

/// Milliseconds since 1970 of an event.
fn at(event: &Value) -> i64 {
    // 2026-11-25T10:28:01.993Z
    let text = event["at"].as_str().unwrap();
    let clock = text.split_once('T').unwrap().1.trim_end_matches('Z');
    let parts: Vec<f64> = clock.split(':').map(|p| p.parse().unwrap()).collect();
    (1000.0 * (3600.0 * parts[0] + 60.0 * parts[1] + parts[2])).round() as i64
}

/// Nothing counts twice: each unit ended once, and one generation was published.
fn once_each(service: &Service, job: &str) {
    let mut ended: BTreeMap<(String, String), usize> = BTreeMap::new();
    let events = service.events(job);
    for event in events.iter().filter(|e| e["kind"] == "done" || e["kind"] == "reused") {
        *ended.entry((event["stage"].to_string(), event["unit"].to_string())).or_default() += 1;
    }
    assert!(ended.values().all(|n| *n == 1), "{ended:?}");
    assert_eq!(ended.len(), service.units(job).len(), "every unit ended");
    assert_eq!(events.iter().filter(|e| e["kind"] == "published").count(), 1);
}

/// Whether some block has died twice, and is not done.
fn one_death_from_failing(service: &Service, job: &str) -> bool {
    let blocks = service.get(&format!("/jobs/{job}/blocks"));
    blocks.as_array().expect("a list").iter().any(|block| match block["state"].as_str() {
        Some("ready") => block["attempts"].as_i64() >= Some(2),
        Some("running") => block["attempts"].as_i64() >= Some(3),
        _ => false,
    })
}

#[expect(clippy::print_stdout, reason = "the figure is for whoever runs the test")]
fn killed_workers_change_nothing(database: Database) {
    let Some(mut service) = Service::new("killed_workers", database, &mesh(), LEASE) else { return };
    let _coordinator = service.serve(&[]);
    let mut workers: Vec<Process> = (0..4).map(|_| service.work(&[])).collect();
    let job = service.submit(&mesh(), "delft", &parameters(16));
    // The split is the longest, and would be hit again and again.
    service.wait_for_stage(&job, &["sample"], LIMIT);
    let mut random = 0x2018_u64;
    let mut draw = |n: u64| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % n
    };
    let begin = Instant::now();
    // Of each kill: when, and which worker.
    let mut kills: Vec<(i64, u32)> = Vec::new();
    while service.get(&format!("/jobs/{job}"))["finished"].is_null() {
        assert!(begin.elapsed() < LIMIT, "{}", service.get(&format!("/jobs/{job}")));
        std::thread::sleep(Duration::from_millis(400 + draw(600)));
        // A third death in one block would be taken for its own fault, rightly.
        if kills.len() < 10 && !one_death_from_failing(&service, &job) {
            let victim = draw(4) as usize;
            kills.push((now() % 86_400_000, workers[victim].id()));
            workers[victim].kill();
            workers[victim] = service.work(&[]);
        }
    }
    service.expect(&job, "successful", LIMIT);
    same_models(&service.files(&job), expected(16));
    once_each(&service, &job);
    assert!(kills.len() >= 3, "the job was over after {} kills", kills.len());

    // What the dead held was taken by others within a lease.
    let events = service.events(&job);
    let mut longest = 0;
    for (number, lost) in events.iter().enumerate() {
        let Some(reason) = lost["message"].as_str().filter(|_| lost["kind"] == "retry") else { continue };
        assert!(reason.contains("fell silent"), "{reason}");
        let killed =
            kills.iter().find(|(_, pid)| reason.contains(&format!("-{pid}-"))).expect("a worker that was killed");
        let same = |e: &&Value| e["kind"] == "claimed" && e["stage"] == lost["stage"] && e["unit"] == lost["unit"];
        let again = events[number..].iter().find(same).expect("taken again");
        longest = longest.max(at(again) - killed.0);
    }
    println!("{database:?}: {} kills, a lost unit was taken again after {longest} ms at most", kills.len());
    assert!(longest > 0, "no kill hit a unit under way");
    // A lease, the pace at which workers look, and a machine that is busy.
    assert!(longest as f64 <= LEASE * 1000.0 + 1500.0, "{longest} ms");
}

fn a_frozen_worker_comes_too_late(database: Database) {
    let Some(mut service) = Service::new("frozen_worker", database, &mesh(), 1.0) else { return };
    let _coordinator = service.serve(&[]);
    let frozen = service.work(&[]);
    // Few large blocks, so that a unit takes long.
    let wanted = json!({ "sampling.step": 0.05, "grid.columns": 2, "grid.rows": 1, "output.report": false, "output.formats": "cityjson" });
    let job = service.submit(&mesh(), "delft", &wanted);
    service.wait_for_stage(&job, &["sample"], LIMIT);
    std::thread::sleep(Duration::from_millis(150));
    signal(frozen.id(), "STOP");
    let held: Vec<_> = service.units(&job).into_iter().filter(|u| u[2] == "running").collect();
    assert_eq!(held.len(), 1, "it holds a unit: {:?}", service.units(&job));
    let other = service.work(&[]);
    let begin = Instant::now();
    let retaken = || service.events(&job).iter().any(|e| e["kind"] == "retry");
    while !retaken() {
        assert!(begin.elapsed() < Duration::from_secs(10), "nobody takes it");
        std::thread::sleep(Duration::from_millis(50));
    }
    // Its child has gone on meanwhile, and has a result to hand in.
    std::thread::sleep(Duration::from_secs(3));
    signal(frozen.id(), "CONT");
    let begin = Instant::now();
    while !frozen.log().contains("its result is thrown away") {
        assert!(begin.elapsed() < Duration::from_secs(20), "nothing was refused: {}", frozen.log());
        std::thread::sleep(Duration::from_millis(50));
    }
    service.expect(&job, "successful", LIMIT);
    once_each(&service, &job);
    // Both still work, and both end when they are told.
    for mut worker in [frozen, other] {
        signal(worker.id(), "TERM");
        assert_eq!(worker.wait(Duration::from_secs(20)), Some(0));
    }
}

/// A program that starts tasks, but dies at some.
fn poison(folder: &Path) -> PathBuf {
    let path = folder.join("poison.sh");
    let script = r#"#!/bin/bash
IFS= read -r order
case $order in
*'"stage":1,"unit":"2_2","input"'*) echo 'a pylon fell on it' >&2; kill -ABRT $$ ;;
*'"stage":1,"unit":"3_4","input"'*) x=$(head -c 400000000 /dev/zero | tr '\0' x); sleep 60 ;;
esac
exec "$@" < <(printf '%s\n' "$order"; exec cat)
"#;
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    path
}

/// The ids of the buildings.
fn building_ids(files: &Files) -> BTreeSet<String> {
    let mut ids = BTreeSet::new();
    for line in files["city.city.jsonl"].split(|byte| *byte == b'\n') {
        if line.windows(10).any(|w| w == b"\"Building\"") {
            let feature: Value = serde_json::from_slice(line).unwrap();
            ids.insert(feature["id"].as_str().unwrap().to_owned());
        }
    }
    ids
}

fn a_block_that_dies_costs_itself(database: Database) {
    let Some(mut service) = Service::new("a_block_that_dies", database, &mesh(), LEASE) else { return };
    let folder = tempfile::tempdir().unwrap();
    let wrapper = poison(folder.path());
    let more = ["--all", "--slots", "2", "--task-memory", "300", "--task-wrapper", wrapper.to_str().unwrap()];
    let mut process = service.serve(&more);
    let job = service.submit(&mesh(), "delft", &parameters(6));
    service.expect(&job, "partial", LIMIT);
    let failed: Vec<_> = service.units(&job).into_iter().filter(|u| u[2] == "failed").collect();
    let names: Vec<_> = failed.iter().map(|u| (u[0].as_str(), u[1].as_str())).collect();
    assert_eq!(names, [("sample", "2_2"), ("sample", "3_4")]);
    assert!(failed[1][3].contains("more than the limit of 300 MB"), "{:?}", failed[1]);
    assert!(failed[0][3].contains("signal: 6"), "{:?}", failed[0]);
    let attempts = |service: &Service, unit: &str| {
        let claims = service.events(&job);
        claims.iter().filter(|e| e["kind"] == "claimed" && e["stage"] == "sample" && e["unit"] == unit).count()
    };
    assert_eq!((attempts(&service, "2_2"), attempts(&service, "3_4"), attempts(&service, "0_0")), (3, 3, 1));

    // Each block tells what its programs said, those that died too.
    let log = |unit: &str| service.text(&format!("/api/v1/jobs/{job}/blocks/{unit}/log"));
    let (good, aborted, large) = (log("0_0"), log("2_2"), log("3_4"));
    assert!(good.starts_with("sample, attempt 1\n") && good.contains("\nwrite, attempt 1\n"), "{good}");
    assert!(good.contains(" s  running\n") && good.contains(" s  done, "), "{good}");
    assert!(aborted.starts_with("sample, attempt 3\n") && aborted.contains(" s  a pylon fell on it\n"), "{aborted}");
    assert!(aborted.contains(" s  failed: signal: 6 ") && aborted.contains("): a pylon fell on it\n"), "{aborted}");
    assert!(large.contains(" s  failed: used ") && large.contains("more than the limit of 300 MB\n"), "{large}");

    // The others are there: each building of the whole city that does not stand on these blocks, or near by.
    let files = service.files(&job);
    let index: Value = serde_json::from_slice(&files["index.json"]).unwrap();
    let told: Vec<_> = index["tiles"].as_array().unwrap().iter().filter(|t| t["failed"].is_string()).collect();
    assert_eq!(told.len(), 2);
    assert!(told.iter().any(|t| t["failed"].as_str().unwrap().contains("signal: 6")));
    let whole: Value = serde_json::from_slice(&expected(6)["index.json"]).unwrap();
    let (some, all) = (index["buildings"].as_u64().unwrap(), whole["buildings"].as_u64().unwrap());
    assert!(some + 2 >= all && some > 0, "{some} of {all} buildings");
    // In a town of 100 m most buildings stand near a hole, and the ground around it is spanned anew: their heights differ a
    // little, but they are the same buildings.
    let (some, all) = (building_ids(&files), building_ids(expected(6)));
    let same = some.intersection(&all).count();
    assert!(same * 3 >= all.len() * 2, "{same} of {} buildings are those of the whole city", all.len());

    // Without the poison, a retry mends it, and samples only the two.
    process.kill();
    let _healthy = service.serve(&["--all", "--slots", "2"]);
    let _ = service.post(&format!("/jobs/{job}/retry"), &Value::Null);
    service.expect(&job, "successful", LIMIT);
    same_models(&service.files(&job), expected(6));
    assert_eq!((attempts(&service, "2_2"), attempts(&service, "3_4"), attempts(&service, "0_0")), (4, 4, 1));
}

fn a_killed_coordinator_changes_nothing(database: Database) {
    let Some(mut service) = Service::new("a_killed_coordinator", database, &mesh(), 1.0) else { return };
    let alone = ["--all", "--slots", "2"];
    let mut process = service.serve(&alone);
    let job = service.submit(&mesh(), "delft", &parameters(6));
    let kill_in = |stages: &[&str], service: &mut Service, process: &mut Process| {
        service.wait_for_stage(&job, stages, LIMIT);
        process.kill();
        *process = service.serve(&alone);
    };
    kill_in(&["split"], &mut service, &mut process);
    kill_in(&["sample"], &mut service, &mut process);
    kill_in(&["terrain", "segment", "stitch", "model"], &mut service, &mut process);
    kill_in(&["write", "report"], &mut service, &mut process);
    service.expect(&job, "successful", LIMIT);
    same_models(&service.files(&job), expected(6));
    once_each(&service, &job);
    let claims = service.events(&job).iter().filter(|e| e["kind"] == "claimed").count();
    let units: BTreeSet<_> = service.units(&job).into_iter().collect();
    assert!(claims > units.len(), "no unit was lost");
}
