//! What is written is valid: CityJSON by its schema, CityGML by its schema, solids by ISO 19107.

use gable_tests::{assert_citygml, assert_cityjson, assert_solids, run_gable, tiles, town};
use std::path::PathBuf;
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

#[test]
fn cityjson_follows_its_schema() {
    let features = assert_cityjson(&result());
    assert!(features > 5 && !tiles(&result()).is_empty(), "{features} features");
}

#[test]
fn citygml_follows_its_schema() {
    assert_citygml("citygml_follows_its_schema", &result());
}

#[test]
fn solids_are_valid_in_every_file() {
    let solids = assert_solids(&result());
    assert!(solids > 10, "{solids} solids");
}
