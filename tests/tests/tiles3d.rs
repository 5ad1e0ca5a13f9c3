//! 3D Tiles as they are written by a run, held against the validators of those who made the formats.

use gable_tests::{files_of, run_gable, run_node, skip, test_data, town};
use serde_json::Value;
use std::path::Path;

/// Runs with 3D Tiles; gives what the validators counted, if they are there.
fn validated(test: &str, mesh: &Path, out: &Path, more: &[&str]) -> Option<Value> {
    let (mesh, folder) = (mesh.to_str().unwrap(), out.to_str().unwrap());
    let formats = ["--formats", "cityjson,3dtiles,mesh-3dtiles", "--set", "output.report=false"];
    let arguments = [&["run", mesh, "--out", folder, "--quiet"], &formats[..], more].concat();
    let _ = run_gable(&arguments).success();
    run_node(test, "validate.mjs", "gltf-validator", &[out.join("3dtiles").to_str().unwrap()])
}

fn buildings(out: &Path) -> u64 {
    let index: Value = serde_json::from_slice(&std::fs::read(out.join("index.json")).unwrap()).unwrap();
    index["buildings"].as_u64().unwrap()
}

#[test]
fn a_town_passes_the_validators() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a");
    let town = town(4, 0.02).join("mesh");
    let more = ["--step", "0.5", "--grid", "4x4"];
    let counted = validated("a_town_passes_the_validators", &town, &out, &more);
    if let Some(counted) = counted {
        assert_eq!(counted["buildings"].as_u64(), Some(buildings(&out)), "{counted}");
        assert_eq!(counted["warnings"], 0, "{counted}");
        assert!(counted["surfaces"].as_u64() > Some(5 * buildings(&out)), "{counted}");
        let triangles: Vec<u64> =
            counted["meshTriangles"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
        assert!(triangles.len() == 3 && triangles.windows(2).all(|w| w[0] > 3 * w[1]), "{counted}");
    }
    // The same mesh, by another number of threads and over an older result of a finer grid: the same files and bytes.
    let again = folder.path().join("b");
    let mesh = town.to_str().unwrap();
    let write = |grid: &str, threads: &str| {
        let (out, formats) = (again.to_str().unwrap(), "cityjson,3dtiles,mesh-3dtiles");
        let set = ["--step", "0.5", "--grid", grid, "--threads", threads, "--formats", formats];
        let _ =
            run_gable(&[&["run", mesh, "--out", out, "--quiet", "--set", "output.report=false"], &set[..]].concat())
                .success();
    };
    write("8x8", "2");
    write("4x4", "1");
    let (first, second) = (files_of(&out), files_of(&again));
    assert_eq!(first.keys().collect::<Vec<_>>(), second.keys().collect::<Vec<_>>());
    for kind in [".ground.glb", ".ground-overview.glb", ".mesh-0.glb"] {
        assert!(first.keys().any(|name| name.starts_with("3dtiles/") && name.ends_with(kind)), "{kind}");
    }
    assert!(first.iter().all(|(name, bytes)| second[name] == *bytes));
}

#[test]
fn a_real_city_passes_the_validators() {
    const TEST: &str = "a_real_city_passes_the_validators";
    let Some(mesh) = test_data("frankfurt/mesh.obj") else {
        skip(TEST, "the mesh of Frankfurt is not there");
        return;
    };
    let out = tempfile::tempdir().unwrap();
    let Some(counted) = validated(TEST, &mesh, out.path(), &["--step", "1", "--grid", "4x4"]) else { return };
    assert_eq!(counted["buildings"].as_u64(), Some(buildings(out.path())), "{counted}");
    assert!(buildings(out.path()) > 50, "{counted}");
}
