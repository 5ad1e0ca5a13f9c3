//! A job in units of work, each in a folder of its own with what it says it reads and nothing else.

use gable_files::Reach;
use gable_pipeline::{
    FailedUnit, Params, RESULT, RunSummary, Stage, UnitHistory, UnitJob, UnitResult, UnitTask, Unobserved, carry_out,
    first_unit,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// What a job made: its artefacts, the units it had, and those that failed.
#[derive(Default)]
pub(crate) struct Made {
    pub(crate) artefacts: Files,
    pub(crate) units: Vec<(Stage, String)>,
    pub(crate) history: UnitHistory,
}

pub(crate) fn params(settings: &[(&str, &str)]) -> Params {
    let base = [("sampling.step", "0.4"), ("grid.columns", "3"), ("grid.rows", "3"), ("segmentation.patch", "128")];
    let all: Vec<_> = base.iter().chain(settings).map(|(n, v)| ((*n).to_owned(), (*v).to_owned())).collect();
    Params::assemble(None, None, &all).unwrap()
}

/// Every file below a folder, by name.
pub(crate) fn files(folder: &Path) -> Files {
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
pub(crate) fn job(source: &Path, params: &Params, spoil: &dyn Fn(&UnitTask) -> Option<String>) -> Made {
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
    let unit = UnitJob { source, reach: &Reach::everything(), params };
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

pub(crate) fn result(made: &Made) -> Files {
    let inside = made.artefacts.iter().filter_map(|(name, bytes)| Some((name.strip_prefix(RESULT)?, bytes)));
    inside.map(|(name, bytes)| (name.to_owned(), bytes.clone())).collect()
}

/// The summary without what differs from run to run: times, memory, threads.
pub(crate) fn timeless(bytes: &[u8]) -> RunSummary {
    let mut summary: RunSummary = serde_json::from_slice(bytes).unwrap();
    summary.stages.clear();
    summary.seconds = 0.0;
    summary.peak_memory_bytes = 0;
    summary.threads = 0;
    summary.blocks.iter_mut().for_each(|b| b.seconds = 0.0);
    summary
}

pub(crate) fn same(units: &Files, whole: &Files) {
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
