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

/// Flips a bit in the middle of a file.
fn damage(path: &Path) {
    let mut bytes = std::fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(path, bytes).unwrap();
}

/// The files of a folder of the working folder that end so.
fn artefacts(out: &Path, folder: &str, ending: &str) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(out.join(".work").join(folder)).unwrap();
    let mut files: Vec<_> =
        entries.map(|e| e.unwrap().path()).filter(|p| p.to_str().unwrap().ends_with(ending)).collect();
    files.sort();
    files
}

/// A run into `out` that is killed as soon as a stage has ended.
fn killed_after(out: &Path, stage: &str) {
    let mut child = start_gable(&arguments(out));
    wait_for(&mut child, stage);
    send(&child, "-KILL");
    wait(child, Duration::from_secs(10));
}

#[test]
fn a_damaged_block_fails_alone_and_the_same_command_mends_it() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    // With report, so that the key of the working folder fits the command below.
    let mut more = arguments(out);
    more.retain(|a| a != "--set" && a != "output.report=false");
    let mut child = start_gable(&more);
    wait_for(&mut child, "split");
    send(&child, "-KILL");
    wait(child, Duration::from_secs(10));
    // A block file of which nothing was made yet, so that it has to be read.
    let block = artefacts(out, "blocks", ".block")
        .into_iter()
        .rev()
        .find(|block| {
            let record = format!("ortho/{}.json", block.file_stem().unwrap().to_str().unwrap());
            !out.join(".work").join(record).exists() && std::fs::metadata(block).unwrap().len() > 5000
        })
        .unwrap();
    damage(&block);
    let name = block.file_stem().unwrap().to_str().unwrap().to_owned();

    let partial = run_gable(&more);
    assert_eq!(partial.code, 3, "{}", partial.stderr);
    let summary = partial.json();
    assert_eq!(summary["status"], "partial");
    let failed: Vec<_> =
        summary["blocks"].as_array().unwrap().iter().filter(|b| b["status"]["state"] == "failed").cloned().collect();
    assert_eq!(failed.len(), 1);
    assert_eq!(format!("{}_{}", failed[0]["ix"], failed[0]["iy"]), name);
    let reason = failed[0]["status"]["reason"].as_str().unwrap().to_owned();
    let said = format!("sample of {name}: ");
    assert!(reason.starts_with(&said) && reason.contains("is damaged, its checksum does not fit"), "{reason}");
    assert!(summary["buildings"].as_u64().unwrap() > 0, "the rest of the city is there");
    // Buildings at the hole are marked, others are not.
    let notes = |r: &&serde_json::Value| r["note"].as_str().is_some_and(|n| n.ends_with(&format!("block {name}")));
    let records = summary["building_records"].as_array().unwrap();
    let marked = records.iter().filter(notes).count();
    assert!(marked < records.len(), "{marked} of {} are marked", records.len());
    // Index and report say it too.
    let index: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("index.json")).unwrap()).unwrap();
    let listed: Vec<_> = index["tiles"].as_array().unwrap().iter().filter(|t| t["failed"].is_string()).collect();
    assert_eq!(listed.len(), 1);
    assert_eq!(listed[0]["failed"], reason);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("Failed blocks (1)") && page.contains("its checksum does not fit"));

    let mended = run_gable(&more).success().json();
    assert_eq!(mended["status"], "successful");
    assert!(reused(&mended) > 0, "good blocks are not sampled again: {}", mended["blocks"]);
    assert!(!out.join(".work").exists());
    assert!(bytes_of_models(out) == uninterrupted(), "the mended city is the one of an undisturbed run");
}

#[test]
fn damaged_artefacts_are_made_again() {
    let expected = uninterrupted();
    let cases = [
        ("sample", "ortho", ".gbo"),
        ("sample", "ortho", ".json"),
        ("sample", "blocks", "split.json"),
        ("segment", "labels", ".lab"),
        ("segment", "labels", ".json"),
        ("model", "models", ".json"),
    ];
    for (stage, kind, ending) in cases {
        let folder = tempfile::tempdir().unwrap();
        killed_after(folder.path(), stage);
        let files = artefacts(folder.path(), kind, ending);
        // Cut short, as by a full disk or a crash of the machine.
        let file = &files[files.len() / 2];
        let bytes = std::fs::read(file).unwrap();
        std::fs::write(file, &bytes[..bytes.len() / 2]).unwrap();
        let _ = run_gable(&arguments(folder.path())).success();
        let found = bytes_of_models(folder.path());
        for (name, bytes) in &expected {
            assert!(bytes == &found[name], "{name} differs after {} was cut", file.display());
        }
    }
}
