//! A thousand real buildings (3DBAG) against themselves and against spoilt copies.

use gable_city_model::{CityModel, ReadOptions, read_cityjson};
use gable_evaluation::{Inputs, Options, evaluate};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The buildings of Delft, unpacked; `None`, with a printed reason, where the data or `xz` is absent.
#[expect(clippy::print_stderr, reason = "says why the test does nothing")]
fn delft() -> Option<CityModel> {
    let root = std::env::var_os("GABLE_TEST_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let packed = root.join("delft-3dbag/delft.city.jsonl.xz");
    if !packed.exists() {
        eprintln!("skipped: {} is absent", packed.display());
        return None;
    }
    let unpacked = Command::new("xz").arg("-dc").arg(&packed).output().ok().filter(|o| o.status.success());
    let Some(unpacked) = unpacked else {
        eprintln!("skipped: xz cannot unpack {}", packed.display());
        return None;
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("delft.city.jsonl");
    std::fs::write(&path, unpacked.stdout).unwrap();
    Some(read_cityjson(&path, &ReadOptions::default()).unwrap().model)
}

#[test]
fn delft_against_itself_and_spoilt() {
    let Some(truth) = delft() else { return };
    let options = Options { density: 0.5, ..Options::default() };
    let e = evaluate(Inputs::new(&truth, &truth), &options).unwrap();
    for d in &e.objects {
        assert_eq!((d.found, d.correct), (d.truth, d.result));
        assert!(d.per_area.quality > 1.0 - 1e-6);
    }
    assert_eq!(e.objects.iter().map(|d| d.truth).collect::<Vec<_>>(), [1115, 951, 697]);
    assert!(e.footprints.buildings.mean_iou > 1.0 - 1e-6 && e.footprints.blocks.mean_iou > 1.0 - 1e-6);
    assert_eq!((e.roofs.matched, e.roofs.covered, e.roofs.height_rmse), (1115, 1.0, 0.0));
    assert_eq!((e.roofs.planes.one_to_one_area, e.roofs.planes.missed, e.roofs.planes.invented), (1.0, 0, 0));
    assert!(e.distances.truth_to_model.max < 1e-5 && e.distances.model_to_truth.max < 1e-5);
    assert!((e.complexity.against_truth.triangles - 1.0).abs() < 1e-12);

    // Every ninth building or so gone, all others 0.2 m too high.
    let mut spoilt = truth.clone();
    spoilt.buildings.retain(|b| b.id.bytes().map(usize::from).sum::<usize>() % 9 != 0);
    spoilt.buildings.iter_mut().flat_map(|b| &mut b.lods.lod2).flat_map(|s| &mut s.vertices).for_each(|v| v.z += 0.2);
    let kept = spoilt.buildings.len();
    let e = evaluate(Inputs::new(&truth, &spoilt), &options).unwrap();
    // Footprints of neighbours overlap by millimetres, never by half.
    assert_eq!((e.objects[0].found, e.objects[0].correct, e.roofs.matched), (kept, kept, kept));
    assert!((e.roofs.height_rmse_median - 0.2).abs() < 1e-6 && (e.roofs.ridge_bias - 0.2).abs() < 0.01);
    assert!(e.distances.truth_to_model_found_from_50.max < 0.2 + 1e-6);
}
