//! `gable bench real`: on a mesh that is made here, with outlines of its own, and on real ones where they are at hand.

use gable_tests::{run_gable, skip, test_data};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// A floor of 60 m × 40 m at 2 m with two boxes, 12 m × 10 m and 8 m × 8 m, whose roofs are at 8 m: an untextured OFF file.
fn write_mesh(file: &Path) {
    let boxes = [[10.0, 10.0, 22.0, 20.0], [40.0, 20.0, 48.0, 28.0]];
    let (mut vertices, mut faces) = (String::new(), String::new());
    let mut counts = [0, 0];
    let mut quad = |corners: [[f64; 3]; 4]| {
        for [x, y, z] in corners {
            writeln!(vertices, "{x} {y} {z}").unwrap();
        }
        let n = counts[0];
        writeln!(faces, "3 {} {} {}\n3 {} {} {}", n, n + 1, n + 2, n, n + 2, n + 3).unwrap();
        counts = [n + 4, counts[1] + 2];
    };
    for x in 0..60 {
        for y in 0..40 {
            let (x0, y0) = (f64::from(x), f64::from(y));
            let roof = boxes.iter().any(|b| x0 >= b[0] && y0 >= b[1] && x0 < b[2] && y0 < b[3]);
            let z = if roof { 8.0 } else { 2.0 };
            let (x1, y1) = (x0 + 1.0, y0 + 1.0);
            quad([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]);
        }
    }
    for [x0, y0, x1, y1] in boxes {
        let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        for k in 0..4 {
            let ([ax, ay], [bx, by]) = (corners[k], corners[(k + 1) % 4]);
            quad([[ax, ay, 2.0], [bx, by, 2.0], [bx, by, 8.0], [ax, ay, 8.0]]);
        }
    }
    std::fs::write(file, format!("OFF\n{} {} 0\n{vertices}{faces}", counts[0], counts[1])).unwrap();
}

fn rectangle(class: &str, id: Option<&str>, [x0, y0, x1, y1]: [f64; 4]) -> Value {
    json!({
        "type": "Feature", "properties": { "class": class, "id": id },
        "geometry": { "type": "Polygon", "coordinates": [[[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]] },
    })
}

fn write_outlines(file: &Path, features: &[Value]) {
    std::fs::write(file, json!({ "type": "FeatureCollection", "features": features }).to_string()).unwrap();
}

#[test]
fn a_made_mesh_against_outlines_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::create_dir(path("outlines")).unwrap();
    write_mesh(Path::new(&path("made.off")));
    let scenes = json!([
        { "name": "right", "half": "tuning", "mesh": "made.off" },
        { "name": "wrong", "half": "testing", "mesh": "made.off" },
        { "name": "absent", "half": "tuning", "mesh": "nowhere.off" },
    ]);
    std::fs::write(path("outlines/scenes.json"), scenes.to_string()).unwrap();
    let ground = rectangle("ground", None, [1.0, 1.0, 59.0, 39.0]);
    let large = rectangle("building", Some("large"), [10.0, 10.0, 22.0, 20.0]);
    let small = rectangle("building", Some("small"), [40.0, 20.0, 48.0, 28.0]);
    write_outlines(Path::new(&path("outlines/right.geojson")), &[ground.clone(), large.clone(), small]);
    // A truth in which the small box is ground and another building stands where there is none.
    let missing = rectangle("building", Some("missing"), [40.0, 5.0, 50.0, 15.0]);
    write_outlines(Path::new(&path("outlines/wrong.geojson")), &[ground, large, missing]);

    let arguments = |more: &[&str]| -> Vec<String> {
        let fixed = ["bench", "real", "--data", &path(""), "--outlines", &path("outlines"), "--out", &path("out")];
        fixed.iter().chain(more).map(|a| (*a).to_owned()).collect()
    };
    let finished = run_gable(&arguments(&["--write", &path("kept"), "--json"])).success();
    assert!(
        finished.stderr.contains("skipped absent") && finished.stderr.contains("nowhere.off"),
        "{}",
        finished.stderr
    );
    let records = finished.json();
    assert_eq!(records.as_array().unwrap().len(), 2, "{records}");

    let at = |record: &Value, path: &str| -> f64 {
        record.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {record}"))
    };
    let right = &records[0];
    assert_eq!((&right["scene"], &right["half"], &right["row"]), (&json!("right"), &json!("tuning"), &json!("today")));
    for (figure, least) in [("objects/correctness", 0.95), ("objects/completeness", 0.95), ("labels/building", 0.95)] {
        assert!(at(right, &format!("/figures/{figure}")) >= least, "{right}");
    }
    let counts = |record: &Value| {
        ["buildings", "found", "merged", "split", "missed", "objects", "invented", "crowns"]
            .map(|count| at(record, &format!("/figures/objects/{count}")) as usize)
    };
    assert_eq!(counts(right), [2, 2, 0, 0, 0, 2, 0, 0]);
    assert!(at(right, "/figures/labels/ground_called_building") < 0.01, "{right}");
    assert!(at(right, "/figures/ground/rms") < 0.05 && at(right, "/figures/ground/missing") == 0.0, "{right}");
    // 58 m × 38 m without the boxes, whose sides lie on the lattice of the cells.
    assert_eq!(at(right, "/figures/ground/cells"), 58.0 * 38.0 - 120.0 - 64.0);
    assert!(at(right, "/run/pixels") > 50_000.0, "{right}");

    let wrong = &records[1];
    assert_eq!(counts(wrong), [2, 1, 0, 0, 1, 2, 1, 0]);
    let close = |figure: &str, wanted: f64| {
        assert!((at(wrong, &format!("/figures/{figure}")) - wanted).abs() < 0.03, "{figure}: {wrong}");
    };
    close("objects/correctness", 120.0 / 184.0);
    close("objects/completeness", 120.0 / 220.0);
    close("labels/building", 120.0 / 284.0);
    close("labels/ground_called_building", 64.0 / (58.0 * 38.0 - 220.0));

    let page = std::fs::read_to_string(path("kept/README.md")).unwrap();
    assert!(page.contains("| right | tuning | today |") && page.contains("| 1 of 2 |"), "{page}");
    let picture = image_size(&path("kept/pictures/real-right.jpg"));
    assert_eq!(picture, [600, 400]);
    assert!(!folder.path().join("out/real/right").exists(), "results go, without --keep");

    let tuning = run_gable(&arguments(&["--tuning", "--json", "--quiet", "--row", "other"])).success().json();
    assert_eq!(tuning.as_array().unwrap().len(), 1);
    assert_eq!((&tuning[0]["scene"], &tuning[0]["row"]), (&json!("right"), &json!("other")));
    for (more, what) in [
        (["--only", "absent"], "nothing was measured"),
        (["--only", "unknown"], "there is no real mesh"),
        (["--rows", "default"], "leave out --rows"),
    ] {
        let finished = run_gable(&arguments(&more));
        assert!(finished.code == 2 && finished.stderr.contains(what), "{}: {}", finished.code, finished.stderr);
    }
}

/// Width and height that a JPEG's frame header tells.
fn image_size(file: &str) -> [u16; 2] {
    let bytes = std::fs::read(file).unwrap();
    let frame = bytes.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    let number = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
    [number(frame + 7), number(frame + 5)]
}

#[test]
fn two_real_halls() {
    const TEST: &str = "two_real_halls";
    if test_data("halls/mesh.obj").is_none() {
        return skip(TEST, "halls/mesh.obj is not among the test data");
    }
    let data = test_data("").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let outlines = concat!(env!("CARGO_MANIFEST_DIR"), "/real");
    let (data, out) = (data.to_str().unwrap(), folder.path().to_str().unwrap());
    let arguments =
        ["bench", "real", "--only", "halls", "--data", data, "--outlines", outlines, "--out", out, "--json", "--quiet"];
    let record = &run_gable(&arguments).success().json()[0];
    let objects = &record["figures"]["objects"];
    assert_eq!((&objects["buildings"], &objects["found"], &objects["missed"]), (&json!(2), &json!(2), &json!(0)));
    assert!(
        objects["correctness"].as_f64().unwrap() > 0.9 && objects["completeness"].as_f64().unwrap() > 0.9,
        "{record}"
    );
    assert!(record["figures"]["ground"]["rms"].as_f64().unwrap() < 0.5, "{record}");
    assert!(folder.path().join("pictures/real-halls.jpg").is_file());
}

#[test]
fn a_real_wood_without_texture_is_no_town() {
    const TEST: &str = "a_real_wood_without_texture_is_no_town";
    if test_data("wood/mesh.obj").is_none() {
        return skip(TEST, "wood/mesh.obj is not among the test data");
    }
    let data = test_data("").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let outlines = concat!(env!("CARGO_MANIFEST_DIR"), "/real");
    let (data, out) = (data.to_str().unwrap(), folder.path().to_str().unwrap());
    let real = ["bench", "real", "--only", "wood", "--data", data, "--outlines", outlines, "--out", out];
    let thinned = [&real[..], &["--thin", "0.7", "--json", "--quiet"]].concat();
    let record = &run_gable(&thinned).success().json()[0];
    assert_eq!(record["row"], json!("0.7 faces per m², no texture"));
    let objects = &record["figures"]["objects"];
    // It was 88 invented buildings before crowns of a few facets were told by their steep sides.
    assert_eq!((&objects["found"], &objects["buildings"]), (&json!(1), &json!(1)), "{record}");
    assert!(objects["invented"].as_u64().unwrap() <= 3, "{record}");
    assert!(record["figures"]["labels"]["tree"].as_f64().unwrap() > 0.9, "{record}");
    assert!(!folder.path().join("thinned/wood").exists(), "the thinned mesh goes");
}

#[test]
fn outlines_teach_a_classifier() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    write_mesh(Path::new(&path("made.off")));
    let boxes = [[10.0, 10.0, 22.0, 20.0], [40.0, 20.0, 48.0, 28.0]];
    // The small box is called a crown, so that both classes are there.
    write_outlines(
        Path::new(&path("made.geojson")),
        &[rectangle("building", Some("large"), boxes[0]), rectangle("tree", None, boxes[1])],
    );
    let train = |more: &[&str]| {
        let (mesh, labels, out) = (path("made.off"), path("made.geojson"), path("weights.json"));
        let fixed = ["train", "--mesh", &mesh, "--labels", &labels, "--rounds", "5", "--out", &out, "--json"];
        run_gable(&[&fixed[..], more].concat())
    };
    let report = train(&["--features", "geometric", "--thin", "1,0.5"]).success().json();
    assert_eq!(report["rasters"], json!(3), "as it is, and thinned twice: {report}");
    let weights: Value = serde_json::from_str(&std::fs::read_to_string(path("weights.json")).unwrap()).unwrap();
    assert_eq!((&weights["features"], &weights["trained_on"]), (&json!("geometric"), &json!("made/outlines")));
    let coloured = train(&["--features", "full", "--thin", "1"]);
    assert!(coloured.code == 2 && coloured.stderr.contains("--features geometric"), "{}", coloured.stderr);
}
