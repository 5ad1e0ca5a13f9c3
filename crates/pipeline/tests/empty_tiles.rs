//! Tiles that hold nothing: neither a file nor a line of the index tells of them, whether a run writes them or units of a job.

mod common;

use common::{files, job, params, result, same};
use gable_files::Reach;
use gable_pipeline::{Params, Stage, Unobserved, run};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A path of 30 m × 420 m from south-west to north-east, of two triangles, whose boxes meet all blocks; and a house on it.
fn diagonal(folder: &Path) -> PathBuf {
    let mut text = String::new();
    let mut add = |points: &[[f64; 3]]| {
        points.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
        text += "f -3 -2 -1\n";
    };
    add(&[[0.0, 20.0, 0.0], [20.0, 0.0, 0.0], [320.0, 300.0, 0.0]]);
    add(&[[0.0, 20.0, 0.0], [320.0, 300.0, 0.0], [300.0, 320.0, 0.0]]);
    // Four walls and a flat roof, 6 m above the path.
    let (low, high) = ([152.0, 154.0], [164.0, 166.0]);
    let ring = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    for side in 0..4 {
        let ([ax, ay], [bx, by]) = (ring[side], ring[(side + 1) % 4]);
        add(&[[ax, ay, 0.0], [bx, by, 0.0], [bx, by, 6.0]]);
        add(&[[ax, ay, 0.0], [bx, by, 6.0], [ax, ay, 6.0]]);
    }
    let roof = ring.map(|[x, y]| [x, y, 6.0]);
    add(&roof[..3]);
    add(&[roof[0], roof[2], roof[3]]);
    let path = folder.join("path.obj");
    std::fs::write(&path, text).unwrap();
    path
}

/// Columns and rows of 40 m: the path lies in 22 of the 64 blocks.
fn eight_by_eight(settings: &[(&str, &str)]) -> Params {
    let grid = [("grid.columns", "8"), ("grid.rows", "8"), ("sampling.step", "0.5"), ("output.report", "false")];
    params(&[&grid, settings].concat())
}

/// Numbers of the files of tiles, of the contents of 3D Tiles, of the tiles that the index lists, and of those that hold buildings.
fn counted(out: &Path) -> [usize; 4] {
    let index: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("index.json")).unwrap()).unwrap();
    let listed = index["tiles"].as_array().unwrap();
    let names: Vec<String> = files(out).into_keys().collect();
    for file in listed.iter().flat_map(|tile| tile["files"].as_array().unwrap()) {
        assert!(names.iter().any(|name| name == file.as_str().unwrap()), "{file} is listed and not there");
    }
    let of = |start: &str, end: &str| names.iter().filter(|n| n.starts_with(start) && n.ends_with(end)).count();
    let built = listed.iter().filter(|tile| tile["buildings"].as_u64().unwrap() > 0).count();
    [of("tiles/", ""), of("3dtiles/", ".ground.glb"), listed.len(), built]
}

#[test]
fn a_tile_that_holds_nothing_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = diagonal(folder.path());
    let formats = ("output.formats", "cityjson,cityjsonseq,citygml,3dtiles");
    for (settings, wanted) in [
        (vec![formats], [2 * 22, 22, 22, 1]),
        // Without ground only the tile with the house is left.
        (vec![formats, ("output.terrain", "false")], [2, 0, 1, 1]),
        // Ground is told of by the index also where it stands in the file of the city alone.
        (vec![("output.formats", "cityjsonseq")], [0, 0, 22, 1]),
        (vec![("output.formats", "cityjsonseq"), ("output.terrain", "false")], [0, 0, 1, 1]),
    ] {
        let params = eight_by_eight(&settings);
        let out = tempfile::tempdir().unwrap();
        let summary = run(&mesh, out.path(), &params, &Reach::everything(), &Unobserved).unwrap();
        assert_eq!((summary.grid, summary.buildings), ([8, 8], 1));
        assert_eq!(counted(out.path()), wanted, "{settings:?}");
        let made = job(&mesh, &params, &|_| None);
        same(&result(&made), &files(out.path()));
        let units = |stage| made.units.iter().filter(|(s, _)| *s == stage).count();
        assert_eq!((units(Stage::Sample), units(Stage::Write)), (64, wanted[2]), "{settings:?}");
    }
}

#[test]
fn tiles_of_an_earlier_result_that_hold_nothing_now_are_gone() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = diagonal(folder.path());
    let out = tempfile::tempdir().unwrap();
    let formats = [("output.formats", "cityjson,3dtiles")];
    let _ = run(&mesh, out.path(), &eight_by_eight(&formats), &Reach::everything(), &Unobserved).unwrap();
    let bare = [formats[0], ("output.terrain", "false")];
    let _ = run(&mesh, out.path(), &eight_by_eight(&bare), &Reach::everything(), &Unobserved).unwrap();
    assert_eq!(counted(out.path()), [1, 0, 1, 1]);
}

#[test]
fn a_tile_that_failed_is_listed_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = diagonal(folder.path());
    let params = eight_by_eight(&[("output.formats", "cityjson"), ("output.terrain", "false")]);
    // A block of the path without a building, and one beside the path of which nothing would be seen.
    for block in ["1_1", "7_0"] {
        let made = job(&mesh, &params, &|task| {
            (task.stage == Stage::Sample && task.unit == block).then(|| "it was struck by lightning".to_owned())
        });
        let index: serde_json::Value = serde_json::from_slice(&made.artefacts["result/index.json"]).unwrap();
        let listed: Vec<_> = index["tiles"].as_array().unwrap().iter().filter(|t| t["failed"].is_string()).collect();
        assert_eq!(listed.len(), 1, "{index}");
        assert!(
            listed[0]["failed"].as_str().unwrap().contains("lightning") && listed[0]["files"] == serde_json::json!([])
        );
    }
}
