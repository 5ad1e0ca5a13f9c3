//! Every parameter of the list does something: another value makes another result, or it is said here why it must not.

use gable_tests::{bytes_of_models, run_gable, town};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Another value, which changes the models of a small town, for the methods that have the parameter.
const CHANGES: &[(&str, &str)] = &[
    ("grid.block_size", "40"),
    ("grid.columns", "3"),
    ("grid.rows", "3"),
    ("modeling.beta", "200"),
    ("modeling.beta_pixel", "5000"),
    ("modeling.collinear", "0"),
    ("modeling.extension", "0"),
    ("modeling.facade_angle", "3"),
    ("modeling.line_length", "6"),
    ("modeling.max_planes", "1"),
    ("modeling.min_cell_area", "30"),
    ("modeling.party_wall_step", "0"),
    ("modeling.plane_angle", "3"),
    ("modeling.plane_area", "30"),
    ("modeling.plane_distance", "0.05"),
    ("modeling.superstructure_area", "200"),
    ("modeling.work", "1"),
    ("output.contact_email", "geo@town.example"),
    ("output.identifier", "town-1"),
    ("output.lineage", "made for a test"),
    ("output.reference_date", "2025-06-30"),
    ("output.terrain", "false"),
    ("output.terrain_tolerance", "2"),
    ("output.title", "Another town"),
    ("sampling.step", "0.5"),
    ("segmentation.building_tree_share", "0.02"),
    ("segmentation.closing", "3"),
    ("segmentation.doubt", "0.3"),
    ("segmentation.features", "geometric"),
    ("segmentation.h_trunc", "5"),
    ("segmentation.min_area", "60"),
    ("segmentation.min_height", "6"),
    ("segmentation.min_width", "9"),
    ("segmentation.mu", "20"),
    ("segmentation.narrow_share", "0.9"),
    ("segmentation.opening", "2"),
    ("segmentation.probability", "0.9"),
    ("segmentation.steepness", "0.5"),
    ("segmentation.step_smoothness", "1"),
    ("segmentation.terrain", "constant"),
    ("segmentation.terrain_cell", "4"),
    ("segmentation.tree_share", "0.95"),
    ("segmentation.tree_weight", "5"),
    ("segmentation.wall_share", "0.95"),
    ("validation.planarity", "0.000001"),
    ("validation.snap", "0.1"),
];

/// Parameters that change nothing here, each with the reason or with the test that holds it.
const OTHERS: &[(&str, &str)] = &[
    ("input.crs", "says what the coordinates are: crates/pipeline, geography; tests/bad_input"),
    ("input.error", "of 3D Tiles alone: crates/scene, tiles3d"),
    ("input.origin", "moves a mesh in local coordinates: crates/scene, origin"),
    ("input.strict", "of damaged input alone: tests/bad_input"),
    ("input.up", "refuses or turns the mesh: tests/bad_input"),
    ("modeling.method", "tests/methods"),
    ("modeling.roofs", "a file: tests/measured, through gable bench"),
    ("output.contact_name", "goes with output.contact_email, which is set above"),
    ("output.formats", "crates/pipeline, formats"),
    ("output.geoid", "of 3D Tiles on the globe alone: tests/tiles3d"),
    ("output.labels", "pictures beside the models: tests/measured"),
    ("output.report", "pages beside the models: tests/small_city"),
    ("resources.memory", "nothing of the result depends on it"),
    ("resources.texture_cache", "nothing of the result depends on it"),
    ("resources.threads", "nothing of the result depends on it: tests/small_city"),
    ("segmentation.footprints", "a file: tests/growth"),
    ("segmentation.hole_area", "of courts that nothing is built over: crates/segmentation, cleanup"),
    ("segmentation.labels", "a folder: tests/measured"),
    ("segmentation.margin", "how the work is cut: labels should not depend on it"),
    ("segmentation.method", "tests/methods"),
    ("segmentation.patch", "how the work is cut: labels should not depend on it"),
    ("segmentation.roof_tree_area", "of plants that a roof encloses: crates/segmentation, cleanup"),
    ("segmentation.weights", "a file: tests/measured"),
    ("validation.normals", "of faces that are hardly planar: crates/city-model, validate"),
];

/// One run of the town: a method, and a parameter with its value.
struct Case<'a> {
    method: &'static str,
    setting: Option<(&'a str, &'static str)>,
}

fn models(mesh: &Path, case: &Case<'_>, folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let out = folder.join("out");
    let mut arguments: Vec<String> =
        ["run", mesh.to_str().unwrap(), "--out", out.to_str().unwrap(), "--quiet"].map(str::to_owned).to_vec();
    for setting in ["resources.threads=1", "output.report=false", "output.contact_name=City"] {
        arguments.extend(["--set".to_owned(), setting.to_owned()]);
    }
    let usual = [("sampling.step", "0.4"), ("output.contact_email", "city@town.example")];
    let settings = usual.iter().copied().filter(|(name, _)| case.setting.is_none_or(|(set, _)| set != *name));
    for (name, value) in settings.chain(case.setting) {
        arguments.extend(["--set".to_owned(), format!("{name}={value}")]);
    }
    if !case.method.is_empty() {
        arguments.extend(["--method".to_owned(), case.method.to_owned()]);
    }
    let _ = run_gable(&arguments).success();
    bytes_of_models(&out)
}

/// The models of all cases, on two threads.
fn run_all(mesh: &Path, cases: &[Case<'_>]) -> Vec<BTreeMap<String, Vec<u8>>> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(vec![BTreeMap::new(); cases.len()]);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(number) else { break };
                    let folder = tempfile::tempdir().unwrap();
                    let made = models(mesh, case, folder.path());
                    results.lock().unwrap()[number] = made;
                }
            });
        }
    });
    results.into_inner().unwrap()
}

#[test]
fn every_parameter_does_something() {
    let list = run_gable(&["params", "--json"]).success().json();
    let listed: BTreeMap<&str, Vec<&str>> = list["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| {
            let methods = p["methods"].as_array().unwrap().iter().map(|m| m.as_str().unwrap());
            (p["name"].as_str().unwrap(), methods.collect())
        })
        .collect();
    let mut spoken_of: Vec<&str> = CHANGES.iter().chain(OTHERS).map(|(name, _)| *name).collect();
    spoken_of.sort_unstable();
    assert_eq!(spoken_of, listed.keys().copied().collect::<Vec<_>>(), "each parameter is tried, or said why not");

    let mesh: PathBuf = town(3, 0.01).join("mesh");
    let mut cases = vec![Case { method: "", setting: None }, Case { method: "zhu2018", setting: None }];
    for (name, value) in CHANGES {
        let methods = &listed[name];
        if methods.iter().any(|method| *method != "zhu2018") || methods.is_empty() {
            cases.push(Case { method: "", setting: Some((name, value)) });
        }
        if methods.contains(&"zhu2018") {
            cases.push(Case { method: "zhu2018", setting: Some((name, value)) });
        }
    }
    let made = run_all(&mesh, &cases);
    let mut idle = Vec::new();
    for (case, models) in cases.iter().zip(&made).skip(2) {
        let usual = if case.method.is_empty() { &made[0] } else { &made[1] };
        if models == usual {
            idle.push(format!("{:?} of {:?}", case.setting, case.method));
        }
    }
    assert!(idle.is_empty(), "these change nothing: {idle:#?}");
}
