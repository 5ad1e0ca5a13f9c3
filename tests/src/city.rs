//! Synthetic cities, made once for all tests of a process.

use crate::run_gable;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;

static MADE: Mutex<BTreeMap<Vec<String>, TempDir>> = Mutex::new(BTreeMap::new());

/// The folder of a city that `gable synth` makes with these arguments.
fn city(arguments: &[&str]) -> PathBuf {
    let key: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = made.entry(key.clone()).or_insert_with(|| {
        let folder = TempDir::new().expect("a temporary folder");
        let out = folder.path().display().to_string();
        let all: Vec<&str> = ["synth", "--quiet", "--out", &out].into_iter().chain(arguments.iter().copied()).collect();
        let _ = run_gable(&all).success();
        folder
    });
    folder.path().to_owned()
}

/// A procedural town of `area` km²: `mesh/` and `truth/` in the folder.
#[must_use]
pub fn town(seed: u64, area: f64) -> PathBuf {
    city(&["--procedural", "--seed", &seed.to_string(), "--area", &area.to_string()])
}

/// A small scene with a roof of a certain kind.
#[must_use]
pub fn case(name: &str) -> PathBuf {
    city(&["--case", name])
}
