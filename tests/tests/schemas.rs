//! What is written is valid: CityJSON by its schema, CityGML by its schema, solids by ISO 19107.

use gable_tests::{read_city, run_gable, schemas, skip, tiles, town};
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// A result that all tests here look at.
fn result() -> PathBuf {
    static RESULT: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = RESULT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let mesh = town(1, 0.02).join("mesh");
        let arguments =
            ["run", mesh.to_str().unwrap(), "--out", folder.path().to_str().unwrap(), "--grid", "2x2", "--quiet"];
        let _ = run_gable(&arguments).success();
        folder
    });
    folder.path().to_owned()
}

fn check(validator: &cjval::CJValidator, name: &str) {
    for (criterion, outcome) in validator.validate() {
        assert!(!outcome.has_errors(), "{name}, {criterion}: {:?}", outcome.get_errors());
    }
    assert!(validator.is_valid(), "{name}");
}

#[test]
fn cityjson_follows_its_schema() {
    let tiles = tiles(&result());
    assert!(!tiles.is_empty());
    for tile in tiles {
        let text = std::fs::read_to_string(&tile.cityjson).unwrap();
        check(&cjval::CJValidator::from_str(&text), &tile.name);
    }
}

#[test]
fn cityjsonseq_follows_its_schema() {
    let text = std::fs::read_to_string(result().join("city.city.jsonl")).unwrap();
    let mut lines = text.lines();
    let mut validator = cjval::CJValidator::from_str(lines.next().unwrap());
    check(&validator, "first line");
    let mut features = 0;
    for line in lines {
        validator.from_str_cjfeature(line).unwrap();
        check(&validator, &format!("feature {features}"));
        features += 1;
    }
    assert!(features > 5, "{features} features");
}

#[test]
fn citygml_follows_its_schema() {
    const TEST: &str = "citygml_follows_its_schema";
    let Some(schema) = schemas() else {
        return skip(TEST, "the schemas of CityGML 2.0 are not here");
    };
    if Command::new("xmllint").arg("--version").output().is_err() {
        return skip(TEST, "xmllint is not installed (Debian: libxml2-utils)");
    }
    let tiles = tiles(&result());
    let files = tiles.iter().map(|tile| &tile.citygml);
    let output =
        Command::new("xmllint").args(["--noout", "--nonet", "--schema"]).arg(&schema).args(files).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn solids_are_valid() {
    let city = read_city(&result().join("city.city.jsonl"), None);
    let tolerances = gable_city_model::Tolerances::default();
    let mut solids = 0;
    for building in &city.buildings {
        for shell in building.lods.lod1.iter().chain(&building.lods.lod2) {
            let issues = gable_city_model::validate_solid(shell, &tolerances);
            assert!(issues.is_empty(), "{}: {issues:?}", building.id);
            solids += 1;
        }
    }
    assert!(solids > 10, "{solids} solids");
}
