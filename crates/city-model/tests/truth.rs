//! The validator on published models: its share of valid solids must agree with what is known about them.

mod common;

use common::real;
use gable_city_model::{ReadOptions, Shell, Tolerances, read_cityjson, validate_solid};
use std::collections::BTreeMap;
use std::time::Instant;

/// Valid solids, all solids, and how often each code came first.
#[expect(clippy::print_stderr, reason = "figures for whoever runs the test with --nocapture")]
fn judge(name: &str, solids: &[&Shell], tolerances: &Tolerances) -> (usize, BTreeMap<u16, usize>) {
    let start = Instant::now();
    let mut codes = BTreeMap::new();
    let mut valid = 0;
    for solid in solids {
        match validate_solid(solid, tolerances).first() {
            None => valid += 1,
            Some(issue) => *codes.entry(issue.code.number()).or_insert(0) += 1,
        }
    }
    let faces: usize = solids.iter().map(|s| s.faces.len()).sum();
    eprintln!(
        "{name}: {valid} of {} valid ({:.1} %), {faces} faces, {:?}, first codes {codes:?}",
        solids.len(),
        100.0 * valid as f64 / solids.len() as f64,
        start.elapsed(),
    );
    (valid, codes)
}

#[test]
fn delft() {
    let dir = tempfile::tempdir().unwrap();
    let Some(path) = real(common::DELFT, &dir) else { return };
    let model = read_cityjson(&path, &ReadOptions::default()).unwrap().model;
    let solids: Vec<_> = model.buildings.iter().flat_map(|b| &b.lods.lod2).collect();
    judge("Delft LOD2.2", &solids, &Tolerances::default());
    let solids: Vec<_> = model.buildings.iter().flat_map(|b| &b.lods.lod1).collect();
    judge("Delft LOD1.3", &solids, &Tolerances::default());
}

#[test]
fn delfshaven() {
    let dir = tempfile::tempdir().unwrap();
    let Some(path) = real(common::DELFSHAVEN, &dir) else { return };
    let model = read_cityjson(&path, &ReadOptions::default()).unwrap().model;
    let solids: Vec<_> = model.buildings.iter().flat_map(|b| &b.lods.lod2).collect();
    judge("Delfshaven LOD2", &solids, &Tolerances::default());
}
