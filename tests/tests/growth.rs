//! A scene that is one building as a whole ends as surely as one of many, and its model says what it lacks.

use gable_tests::{bytes_of_models, read_city, run_gable, town};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

/// A footprint around all of a town, as a cadastre would give it.
fn footprint_of_all(town: &Path, file: &Path) {
    let truth = read_city(&town.join("truth/truth.city.jsonl"), None);
    let corners: Vec<_> =
        truth.buildings.iter().filter_map(|b| b.lods.footprint.as_ref()).flat_map(|shell| &shell.vertices).collect();
    let low = corners.iter().fold(corners[0].truncate(), |low, p| low.min(p.truncate())).floor();
    let high = corners.iter().fold(corners[0].truncate(), |high, p| high.max(p.truncate())).ceil();
    let corner = |x: f64, y: f64| json!([x as i64, y as i64, 0]);
    let city = json!({
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [1.0, 1.0, 1.0], "translate": truth.origin},
        "CityObjects": {"all": {
            "type": "Building",
            "geometry": [{"type": "MultiSurface", "lod": "0", "boundaries": [[[0, 1, 2, 3]]]}]
        }},
        "vertices": [corner(low.x, low.y), corner(high.x, low.y), corner(high.x, high.y), corner(low.x, high.y)]
    });
    std::fs::write(file, city.to_string()).unwrap();
}

/// Models a town as one building.
fn as_one_building(area: f64, more: &[&str]) -> (TempDir, Value) {
    let folder = tempfile::tempdir().unwrap();
    let town = town(1, area);
    let file = folder.path().join("all.city.json");
    footprint_of_all(&town, &file);
    let (mesh, out) = (town.join("mesh"), folder.path().join("out"));
    let footprints = format!("segmentation.footprints={}", file.display());
    let mut arguments = vec!["run", mesh.to_str().unwrap(), "--out", out.to_str().unwrap(), "--json", "--quiet"];
    arguments.extend(["--set", &footprints, "--set", "output.report=false"]);
    arguments.extend(more);
    let summary = run_gable(&arguments).success().json();
    assert_eq!(summary["building_records"].as_array().unwrap().len(), 1, "{}", summary["building_records"]);
    (folder, summary)
}

fn seconds_of_modelling(summary: &Value) -> f64 {
    let stages = summary["stages"].as_array().unwrap();
    stages.iter().find(|stage| stage["stage"] == "model").and_then(|stage| stage["core"].as_f64()).unwrap()
}

#[test]
fn the_time_of_one_building_grows_with_its_area() {
    let small = seconds_of_modelling(&as_one_building(0.01, &[]).1);
    let large = seconds_of_modelling(&as_one_building(0.04, &[]).1);
    // Linear would be four times; a step that looks at all pairs of planes, sixteen, and at all of them for each, sixty-four.
    assert!(large < 9.0 * small + 1.0, "{small} s for 0.01 km², {large} s for 0.04 km²");
}

#[test]
fn a_simpler_model_says_why_and_does_not_depend_on_threads() {
    let (one, summary) = as_one_building(0.01, &["--threads", "1", "--set", "modeling.work=1"]);
    let record = &summary["building_records"][0];
    let note = record["note"].as_str().unwrap_or_default();
    assert!(note.contains("modeling.work"), "{record}");
    assert!(["lod1", "lod2"].contains(&record["lod"].as_str().unwrap()), "{record}");
    let city = std::fs::read_to_string(one.path().join("out/city.city.jsonl")).unwrap();
    assert!(city.contains(note), "the note stands in the attributes");
    let (two, _) = as_one_building(0.01, &["--threads", "2", "--set", "modeling.work=1"]);
    assert!(bytes_of_models(&one.path().join("out")) == bytes_of_models(&two.path().join("out")));
}
