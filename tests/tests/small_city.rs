//! The main job on a small synthetic town: what a user gets, and that nothing of it depends on blocks or threads.

use gable_tests::{bytes_of_models, footprint_iou, footprints, read_city, run_gable, tiles, town};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const AREA: f64 = 0.02;

struct Result {
    folder: TempDir,
    summary: serde_json::Value,
}

impl Result {
    fn out(&self) -> PathBuf {
        self.folder.path().to_owned()
    }

    fn city(&self) -> PathBuf {
        self.folder.path().join("city.city.jsonl")
    }
}

/// A run without report.
fn models(more: &[&str]) -> Result {
    run(&[more, &["--set", "output.report=false"]].concat())
}

fn run(more: &[&str]) -> Result {
    let folder = tempfile::tempdir().unwrap();
    let mesh = town(1, AREA).join("mesh");
    let mut arguments =
        vec!["run", mesh.to_str().unwrap(), "--out", folder.path().to_str().unwrap(), "--json", "--quiet"];
    arguments.extend(more);
    let summary = run_gable(&arguments).success().json();
    Result { folder, summary }
}

#[test]
fn a_town_becomes_buildings() {
    let result = run(&["--grid", "3x2"]);
    let out = result.out();
    for name in ["city.city.jsonl", "index.json", "report.html", "report.json"] {
        assert!(out.join(name).is_file(), "{name} is missing");
    }
    let truth = read_city(&town(1, AREA).join("truth/truth.city.jsonl"), None);
    let city = read_city(&result.city(), Some(&truth));
    assert_eq!(result.summary["buildings"].as_u64().unwrap() as usize, city.buildings.len());
    assert_eq!(city.crs, truth.crs);

    // Each true building of some size is covered by one of ours, party walls or not.
    let (ours, theirs) = (footprints(&city), footprints(&truth));
    let all_ours: Vec<_> = ours.values().flatten().cloned().collect();
    let large: Vec<_> = theirs.values().filter(|f| f.iter().map(|p| p.area()).sum::<f64>() >= 50.0).collect();
    let covered = |polygons: &[gable_geometry::Polygon]| {
        let near: Vec<_> =
            all_ours.iter().filter(|p| polygons.iter().any(|q| p.bounds().intersects(&q.bounds()))).cloned().collect();
        footprint_iou(polygons, &near) > 0.0 && {
            let centre = polygons.iter().flat_map(|p| &p.outer).copied().sum::<gable_geometry::DVec2>()
                / polygons.iter().map(|p| p.outer.len()).sum::<usize>() as f64;
            near.iter().any(|p| p.contains(centre)) || polygons.iter().all(|p| !p.contains(centre))
        }
    };
    let found = large.iter().filter(|f| covered(f)).count();
    assert!(found * 10 >= large.len() * 9, "{found} of {} buildings of 50 m² and more are found", large.len());

    // Every building ends in LOD2 or in a stated reason.
    for record in result.summary["building_records"].as_array().unwrap() {
        assert!(record["lod"] == "lod2" || record["reason"].is_string(), "{record}");
    }
    let lod2 = city.buildings.iter().filter(|b| !b.lods.lod2.is_empty()).count();
    assert!(lod2 * 10 >= city.buildings.len() * 9, "{lod2} of {} buildings have LOD2", city.buildings.len());
    let ids: std::collections::BTreeSet<_> = city.buildings.iter().map(|b| &b.id).collect();
    assert_eq!(ids.len(), city.buildings.len(), "ids are unique");
    assert!(city.terrain.is_some(), "terrain is written");
    assert_eq!(city.buildings.len(), buildings_in_tiles(&out), "each building belongs to one tile");
}

fn buildings_in_tiles(out: &Path) -> usize {
    tiles(out).iter().map(|tile| read_city(&tile.cityjson, None).buildings.len()).sum()
}

#[test]
fn the_grid_changes_no_building() {
    let whole = models(&["--grid", "1x1"]);
    let reference = read_city(&whole.city(), None);
    let expected = footprints(&reference);
    assert!(!expected.is_empty());
    for grid in ["4x4", "16x16"] {
        let result = models(&["--grid", grid]);
        let found = footprints(&read_city(&result.city(), Some(&reference)));
        assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "ids of {grid}");
        for (id, polygons) in &expected {
            let iou = footprint_iou(polygons, &found[id]);
            assert!(iou >= 0.98, "{id} of {grid} differs: IoU {iou}");
        }
    }
}

#[test]
fn threads_change_no_byte() {
    let one = bytes_of_models(&models(&["--grid", "4x4", "--threads", "1"]).out());
    for threads in ["2", "4"] {
        let many = bytes_of_models(&models(&["--grid", "4x4", "--threads", threads]).out());
        assert_eq!(one.keys().collect::<Vec<_>>(), many.keys().collect::<Vec<_>>());
        for (name, bytes) in &one {
            assert!(bytes == &many[name], "{name} differs with {threads} threads");
        }
    }
}
