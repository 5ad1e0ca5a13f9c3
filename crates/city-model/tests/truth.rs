//! The validator on published models: its share of valid solids must agree with what is known about them.

mod common;

use common::real;
use gable_city_model::{ReadOptions, Shell, Tolerances, Value, read_cityjson, validate_solid};
use gable_geometry::Crs;
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

/// val3dity's verdict stands in the attributes of 3DBAG's buildings, made before coordinates were rounded to 1 mm.
/// What it rejects must be rejected here; what is rejected beyond that must be corners that the rounding united, a
/// sliver that it tilted, or surfaces that it made touch.
#[test]
fn delft() {
    let dir = tempfile::tempdir().unwrap();
    let Some(path) = real(common::DELFT, &dir) else { return };
    let model = read_cityjson(&path, &ReadOptions::default()).unwrap().model;
    let tolerances = Tolerances::default();
    let (mut theirs, mut ours_only) = (0, Vec::new());
    for building in &model.buildings {
        let verdict = building.attributes.get("b3_val3dity_lod22");
        let rejected = verdict != Some(&Value::Text("[]".to_owned()));
        let issues: Vec<_> = building.lods.lod2.iter().flat_map(|s| validate_solid(s, &tolerances)).collect();
        theirs += usize::from(rejected);
        assert!(!(rejected && issues.is_empty()), "{}: val3dity has {verdict:?}", building.id);
        if !rejected {
            ours_only.extend(issues.first().map(|issue| issue.code.number()));
        }
    }
    assert_eq!(theirs, 13);
    ours_only.sort_unstable();
    assert_eq!(ours_only, [101, 101, 102, 102, 102, 102, 204, 204, 306]);
    let solids: Vec<_> = model.buildings.iter().flat_map(|b| &b.lods.lod2).collect();
    let (valid, _) = judge("Delft LOD2.2", &solids, &tolerances);
    assert_eq!((valid, solids.len()), (1094, 1116));
    judge("Delft LOD2.2, strict", &solids, &Tolerances::strict());
    let solids: Vec<_> = model.buildings.iter().flat_map(|b| &b.lods.lod1).collect();
    let (valid, _) = judge("Delft LOD1.3", &solids, &tolerances);
    assert!(valid > 1100);
}

/// These are textured hulls without shared walls: nearly none is closed, and the validator must say that.
#[test]
fn delfshaven() {
    let dir = tempfile::tempdir().unwrap();
    let Some(path) = real(common::DELFSHAVEN, &dir) else { return };
    let model = read_cityjson(&path, &ReadOptions::default()).unwrap().model;
    assert_eq!((model.buildings.len(), &model.crs), (853, &Crs::Epsg(7415)));
    let solids: Vec<_> = model.buildings.iter().flat_map(|b| &b.lods.lod2).collect();
    let (valid, codes) = judge("Delfshaven LOD2", &solids, &Tolerances::default());
    assert!(valid < 50 && codes[&302] > 500);
    assert!(model.buildings.iter().all(|b| b.attributes.contains_key("TerrainHeight")));
}
