//! Real meshes, where they are at hand.

use gable_tests::{read_city, run_gable, skip, test_data};

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
}
