//! Real meshes, where they are at hand.

use gable_tests::{assert_citygml, assert_cityjson, assert_solids, read_city, run_gable, skip, test_data};

#[test]
fn a_block_of_real_multi_view_stereo() {
    const TEST: &str = "a_block_of_real_multi_view_stereo";
    let Some(mesh) = test_data("block/block.off") else {
        return skip(TEST, "block/block.off is not among the test data");
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let arguments =
        ["run", mesh.to_str().unwrap(), "--out", out, "--grid", "1x1", "--step", "0.2", "--json", "--quiet"];
    let summary = run_gable(&arguments).success().json();
    let faces = summary["faces"].as_u64().unwrap();
    assert!((20..=200).contains(&faces), "{faces} faces");
    let city = read_city(&folder.path().join("city.city.jsonl"), None);
    let area: f64 = city.buildings.iter().filter_map(|b| b.lods.footprint.as_ref()).map(|s| s.footprint_area()).sum();
    assert!(area > 1000.0, "{area} m² are built over");

    let figures = run_gable(&["eval", "--result", out, "--mesh", mesh.to_str().unwrap(), "--json"]).success().json();
    let roofs = &figures["lod2_roofs_to_mesh"];
    assert!(roofs["count"].as_u64().unwrap() > 2000, "{roofs}");
    assert!(roofs["rms"].as_f64().unwrap() <= 0.40, "{roofs}");
    assert_eq!(figures["validity"]["lod2"], 1.0, "{}", figures["validity"]);
    assert!(assert_solids(folder.path()) >= 2);
    assert_cityjson(folder.path());
    assert_citygml(TEST, folder.path());
}

/// All that is written of a real city is valid, whatever its meshes are like.
fn is_valid(test: &str, data: &str, least: usize) {
    let Some(mesh) = test_data(data) else { return skip(test, &format!("{data} is not among the test data")) };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    // The pixels of the preset "fast": what is valid does not hang on them, and it saves half a minute.
    let arguments =
        ["run", mesh.to_str().unwrap(), "--out", out.to_str().unwrap(), "--grid", "4x4", "--step", "0.4", "--quiet"];
    let _ = run_gable(&arguments).success();
    let solids = assert_solids(out);
    assert!(solids >= least, "{solids} solids");
    assert!(assert_cityjson(out) >= least / 2);
    assert_citygml(test, out);
}

#[test]
fn a_real_city_with_gable_roofs_is_valid() {
    is_valid("a_real_city_with_gable_roofs_is_valid", "frankfurt/mesh.obj", 200);
}

#[test]
fn overlapping_tiles_of_real_halls_are_valid() {
    is_valid("overlapping_tiles_of_real_halls_are_valid", "dayanta", 80);
}
