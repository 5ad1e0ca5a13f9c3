//! A job in units of work, each in a folder of its own with what it says it reads and nothing else.

use gable_pipeline::{
    FailedUnit, Params, RESULT, RunStatus, RunSummary, Stage, UnitHistory, UnitJob, UnitResult, UnitTask, Unobserved,
    carry_out, first_unit, run,
};
use gable_synthetic_city::{Source, SynthParams, synthesise};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

type Files = BTreeMap<String, Vec<u8>>;

/// What a job made: its artefacts, the units it had, and those that failed.
#[derive(Default)]
struct Made {
    artefacts: Files,
    units: Vec<(Stage, String)>,
    history: UnitHistory,
}

fn params(settings: &[(&str, &str)]) -> Params {
    let base = [("sampling.step", "0.4"), ("grid.columns", "3"), ("grid.rows", "3"), ("segmentation.patch", "128")];
    let all: Vec<_> = base.iter().chain(settings).map(|(n, v)| ((*n).to_owned(), (*v).to_owned())).collect();
    Params::assemble(None, None, &all).unwrap()
}

fn town(area_km2: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let params = SynthParams { seed: 3, source: Source::Procedural { area_km2 }, ..SynthParams::default() };
    synthesise(&params, folder.path(), &|_| {}).unwrap();
    folder
}

/// Every file below a folder, by name.
fn files(folder: &Path) -> Files {
    let mut out = Files::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
                out.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    out
}

/// Does a job unit by unit; `spoil` may fail one.
fn job(source: &Path, params: &Params, spoil: &dyn Fn(&UnitTask) -> Option<String>) -> Made {
    let mut made = Made::default();
    let mut waiting = vec![first_unit()];
    for stage in Stage::ALL {
        let (now, later): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|task| task.stage == stage);
        waiting = later;
        for task in now {
            made.units.push((stage, task.unit.clone()));
            match spoil(&task).map_or_else(|| one(source, params, &task, &mut made), Err) {
                Ok(result) => waiting.extend(result.tasks),
                Err(reason) => made.history.failed.push(FailedUnit { stage, unit: task.unit, reason }),
            }
        }
    }
    assert!(waiting.is_empty(), "every unit is of a stage that is later than the one that added it");
    made
}

fn one(source: &Path, params: &Params, task: &UnitTask, made: &mut Made) -> Result<UnitResult, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in &made.artefacts {
        if task.input.reads.iter().any(|start| name.starts_with(start.as_str())) {
            let place = folder.path().join(name);
            std::fs::create_dir_all(place.parent().unwrap()).unwrap();
            std::fs::write(place, bytes).unwrap();
        }
    }
    let history = if task.input.history { made.history.clone() } else { UnitHistory::default() };
    let unit = UnitJob { source, params };
    let result = carry_out(&unit, task, &history, folder.path(), 1, &Unobserved).map_err(|e| e.to_string())?;
    let mut names = BTreeSet::new();
    for name in &result.made {
        assert!(names.insert(name.clone()), "{name} is named twice");
        let bytes = std::fs::read(folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let before = made.artefacts.insert(name.clone(), bytes);
        assert!(before.is_none(), "{name} is made by two units");
    }
    Ok(result)
}

fn result(made: &Made) -> Files {
    let inside = made.artefacts.iter().filter_map(|(name, bytes)| Some((name.strip_prefix(RESULT)?, bytes)));
    inside.map(|(name, bytes)| (name.to_owned(), bytes.clone())).collect()
}

/// The summary without what differs from run to run: times, memory, threads.
fn timeless(bytes: &[u8]) -> RunSummary {
    let mut summary: RunSummary = serde_json::from_slice(bytes).unwrap();
    summary.stages.clear();
    summary.seconds = 0.0;
    summary.peak_memory_bytes = 0;
    summary.threads = 0;
    summary.blocks.iter_mut().for_each(|b| b.seconds = 0.0);
    summary
}

fn same(units: &Files, whole: &Files) {
    assert_eq!(units.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
    for (name, bytes) in whole {
        match name.as_str() {
            "report.html" => {}
            "report.json" => assert_eq!(timeless(&units[name]), timeless(bytes)),
            _ => {
                let at = units[name].iter().zip(bytes).take_while(|(a, b)| a == b).count();
                let near =
                    |b: &[u8]| String::from_utf8_lossy(&b[at.saturating_sub(60)..(at + 60).min(b.len())]).into_owned();
                assert!(
                    &units[name] == bytes,
                    "{name} differs at {at}: {} instead of {}",
                    near(&units[name]),
                    near(bytes)
                );
            }
        }
    }
}

#[test]
#[expect(clippy::print_stdout, reason = "which case failed is for whoever reads the failure")]
fn units_make_the_bytes_of_a_run() {
    let town = town(0.01);
    let mesh = town.path().join("mesh");
    // One picture that is none, and labels, footprints and pictures of the labels.
    let broken = files(&mesh).into_keys().find(|name| name.ends_with(".jpg")).unwrap();
    std::fs::write(mesh.join(&broken), b"no picture").unwrap();
    let truth = town.path().join("truth");
    let city = truth.join("truth.city.jsonl").display().to_string();
    let cases: [&[(&str, &str)]; 3] = [
        &[],
        &[("method", "zhu2018"), ("output.report", "false"), ("sampling.step", "0.5"), ("output.terrain", "false")],
        &[
            ("segmentation.footprints", &city),
            ("segmentation.labels", truth.to_str().unwrap()),
            ("modeling.roofs", &city),
            ("output.labels", "true"),
            ("output.report", "false"),
        ],
    ];
    for settings in cases {
        println!("{settings:?}");
        let params = params(settings);
        let out = tempfile::tempdir().unwrap();
        let _ = run(&mesh, out.path(), &params, &Unobserved).unwrap();
        let made = job(&mesh, &params, &|_| None);
        assert_eq!(made.history.failed, []);
        for stage in Stage::ALL {
            assert!(made.units.iter().any(|(s, _)| *s == stage), "no unit of {stage}");
        }
        same(&result(&made), &files(out.path()));
        let listed = String::from_utf8(made.artefacts["buildings.jsonl"].clone()).unwrap();
        let index: serde_json::Value = serde_json::from_slice(&made.artefacts["result/index.json"]).unwrap();
        assert_eq!(listed.lines().count() as u64, index["buildings"].as_u64().unwrap());
    }
}

#[test]
fn a_unit_that_fails_costs_its_block_only() {
    let town = town(0.01);
    let mesh = town.path().join("mesh");
    let params = params(&[]);
    let whole = job(&mesh, &params, &|_| None);
    for (stage, unit) in [(Stage::Sample, "1_1"), (Stage::Segment, "0_0"), (Stage::Write, "1_1")] {
        let made = job(&mesh, &params, &|task| {
            (task.stage == stage && task.unit == unit).then(|| "used more memory than it may".to_owned())
        });
        assert_eq!(made.history.failed.len(), 1, "{:?}", made.history.failed);
        let summary = timeless(&made.artefacts["result/report.json"]);
        assert_eq!(summary.status, RunStatus::Partial);
        assert!(
            summary.failed_blocks().count() > 0 && summary.failed_blocks().count() < summary.blocks.len()
                || stage == Stage::Segment
        );
        let index = String::from_utf8(made.artefacts["result/index.json"].clone()).unwrap();
        assert!(index.contains("used more memory than it may"), "{index}");
        if stage == Stage::Write {
            for (name, bytes) in result(&whole) {
                if name.starts_with("tiles/") && !name.contains("1_1") {
                    assert!(result(&made)[&name] == bytes, "{name}");
                }
            }
        }
    }
}

#[test]
fn artefacts_of_a_block_do_not_tell_where_the_source_lies() {
    let town = town(0.01);
    let elsewhere = tempfile::tempdir().unwrap();
    let moved = elsewhere.path().join("moved/mesh");
    for (name, bytes) in files(&town.path().join("mesh")) {
        let place = moved.join(name);
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        std::fs::write(place, bytes).unwrap();
    }
    let params = params(&[("output.report", "false")]);
    let (a, b) = (job(&town.path().join("mesh"), &params, &|_| None), job(&moved, &params, &|_| None));
    for (name, bytes) in &a.artefacts {
        // The last names the files of the source, and the middle two hold times.
        let differs =
            name == "textures.json" || name.starts_with("seen/") || name == "sampled.json" || name == "split.json";
        assert!(differs || &b.artefacts[name] == bytes, "{name} differs");
    }
}
