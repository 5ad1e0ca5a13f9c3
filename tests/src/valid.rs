//! Whether a result is valid, by validators that are not those which wrote it wherever there are any.

use crate::{read_city, schemas, skip, tiles};
use gable_city_model::{CityModel, ReadOptions, Tolerances, read_citygml, validate_solid};
use std::path::Path;
use std::process::Command;

/// Holds every tile and the sequence of a result against the CityJSON schemas; returns how many features it has.
///
/// # Panics
/// If something does not hold.
pub fn assert_cityjson(out: &Path) -> usize {
    for tile in tiles(out) {
        let text = std::fs::read_to_string(&tile.cityjson).unwrap_or_else(|e| panic!("{}: {e}", tile.name));
        assert_valid(&cjval::CJValidator::from_str(&text), &tile.name);
    }
    let path = out.join("city.city.jsonl");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines();
    let mut validator = cjval::CJValidator::from_str(lines.next().unwrap_or_default());
    assert_valid(&validator, "first line");
    let mut features = 0;
    for line in lines {
        validator.from_str_cjfeature(line).unwrap_or_else(|e| panic!("feature {features}: {e}"));
        assert_valid(&validator, &format!("feature {features}"));
        features += 1;
    }
    features
}

fn assert_valid(validator: &cjval::CJValidator, name: &str) {
    for (criterion, outcome) in validator.validate() {
        assert!(!outcome.has_errors(), "{name}, {criterion}: {:?}", outcome.get_errors());
    }
    assert!(validator.is_valid(), "{name}");
}

/// Holds every tile's CityGML against the schemas, if they and xmllint are there; else `test` is skipped.
///
/// # Panics
/// If something does not hold.
pub fn assert_citygml(test: &str, out: &Path) {
    let Some(schema) = schemas() else { return skip(test, "the schemas of CityGML 2.0 are not here") };
    if Command::new("xmllint").arg("--version").output().is_err() {
        return skip(test, "xmllint is not installed (Debian: libxml2-utils)");
    }
    let tiles = tiles(out);
    assert!(!tiles.is_empty());
    let files = tiles.iter().map(|tile| &tile.citygml);
    let output = Command::new("xmllint").args(["--noout", "--nonet", "--schema"]).arg(&schema).args(files).output();
    let output = output.unwrap_or_else(|e| panic!("xmllint: {e}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Reads every file of models again and holds its solids against ISO 19107 (snap 1 mm, planarity 1 cm); returns how
/// many solids the city has. The tiles together hold the city's solids, in both formats.
///
/// # Panics
/// If something does not hold.
pub fn assert_solids(out: &Path) -> usize {
    let city = solids(&read_city(&out.join("city.city.jsonl"), None), "city");
    let (mut json, mut gml) = (0, 0);
    for tile in tiles(out) {
        json += solids(&read_city(&tile.cityjson, None), &tile.name);
        let read = read_citygml(&tile.citygml, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        gml += solids(&read.model, &tile.name);
    }
    assert_eq!((json, gml), (city, city), "solids of the CityJSON and of the CityGML tiles");
    city
}

fn solids(model: &CityModel, name: &str) -> usize {
    let tolerances = Tolerances::default();
    let mut solids = 0;
    for building in &model.buildings {
        for shell in building.lods.lod1.iter().chain(&building.lods.lod2) {
            let issues = validate_solid(shell, &tolerances);
            assert!(issues.is_empty(), "{name}, {}: {issues:?}", building.id);
            solids += 1;
        }
    }
    solids
}
