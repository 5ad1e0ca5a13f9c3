//! Bad input: each kind has a message that says what is wrong where and what to do, and leaves nothing behind.
//! What can go on goes on, and is counted.

use gable_tests::run_gable;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A flat field with one box on it, as an OBJ file: `side` metres, a vertex each metre.
fn field(side: usize) -> String {
    let mut obj = String::from("# field\n");
    for y in 0..=side {
        for x in 0..=side {
            let on_box = (10..20).contains(&x) && (10..22).contains(&y);
            // Writing to a String cannot fail.
            let _ = writeln!(obj, "v {x} {y} {}", if on_box { 6 } else { 0 });
        }
    }
    let row = side + 1;
    for y in 0..side {
        for x in 0..side {
            let a = y * row + x + 1;
            let _ = writeln!(obj, "f {} {} {}\nf {} {} {}", a, a + 1, a + row + 1, a, a + row + 1, a + row);
        }
    }
    obj
}

struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// The run fails with code 2, says all of `expected`, and leaves no result.
    fn refused(&self, input: &Path, more: &[&str], expected: &[&str]) {
        let out = self.folder.path().join("out");
        let mut arguments = vec!["run", input.to_str().unwrap(), "--out", out.to_str().unwrap(), "--grid", "1x1"];
        arguments.extend(more);
        let finished = run_gable(&arguments);
        assert_eq!(finished.code, 2, "{}", finished.stderr);
        for text in expected {
            assert!(finished.stderr.contains(text), "should say {text:?}: {}", finished.stderr);
        }
        for name in ["city.city.jsonl", "index.json", "tiles", "report.html", "report.json"] {
            assert!(!out.join(name).exists(), "{name} is left behind");
        }
    }

    /// The run goes on; its summary is returned.
    fn accepted(&self, input: &Path, more: &[&str]) -> serde_json::Value {
        let out = self.folder.path().join("out");
        let mut arguments =
            vec!["run", input.to_str().unwrap(), "--out", out.to_str().unwrap(), "--grid", "1x1", "--json", "-q"];
        arguments.extend(more);
        run_gable(&arguments).success().json()
    }
}

/// Whether a warning contains the text.
fn warned(summary: &serde_json::Value, text: &str) -> bool {
    summary["warnings"].as_object().unwrap().keys().any(|w| w.to_lowercase().contains(text))
}

#[test]
fn no_such_file() {
    let case = Case::new();
    case.refused(Path::new("/does/not/exist.obj"), &[], &["/does/not/exist.obj", "no such file"]);
}

#[test]
fn unknown_type() {
    let case = Case::new();
    let path = case.file("city.dwg", "AC1032");
    case.refused(&path, &[], &["city.dwg: file type \".dwg\"", ".obj, .ply, .off, .glb"]);
}

#[test]
fn empty_folder() {
    let case = Case::new();
    std::fs::create_dir(case.folder.path().join("tiles")).unwrap();
    let path = case.folder.path().join("tiles");
    case.refused(&path, &[], &["no .obj, .ply, .off"]);
}

#[test]
fn truncated_obj() {
    let case = Case::new();
    let obj = field(40);
    let cut = obj.find("v 7 3 0").unwrap() + 5;
    let path = case.file("cut.obj", &obj[..cut]);
    let line = obj[..cut].lines().count();
    case.refused(&path, &[], &["cut.obj", &format!("line {line}")]);
}

#[test]
fn truncated_binary_ply() {
    let case = Case::new();
    let mut ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n".to_vec();
    ply.extend([0u8; 20]);
    let path = case.file("cut.ply", ply);
    case.refused(&path, &[], &["cut.ply", "byte", "ends too early"]);
}

#[test]
fn index_out_of_range() {
    let case = Case::new();
    let obj = field(40) + "f 1 2 99999\n";
    let line = obj.lines().count();
    let path = case.file("index.obj", &obj);
    case.refused(&path, &[], &["index.obj", &format!("line {line}"), "99999"]);
}

#[test]
fn coordinates_that_are_no_numbers() {
    for (value, name) in [("nan", "nan.obj"), ("inf", "inf.obj"), ("-inf", "minus.obj")] {
        let case = Case::new();
        let obj = format!("v {value} 0 0\n{}", field(40));
        let path = case.file(name, obj);
        case.refused(&path, &[], &[name, "line 1", "finite"]);
    }
}

#[test]
fn words_for_coordinates() {
    let case = Case::new();
    let path = case.file("word.obj", field(40) + "v one two three\n");
    let line = field(40).lines().count() + 1;
    case.refused(&path, &[], &["word.obj", &format!("line {line}")]);
}

#[test]
fn no_triangles() {
    let case = Case::new();
    let path = case.file("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    case.refused(&path, &[], &["points.obj", "no triangles"]);
}

#[test]
fn wrong_magic() {
    for (name, bytes) in
        [("fake.ply", "solid city"), ("fake.off", "PLYX"), ("fake.glb", "JFIF stuff here, not glTF at all")]
    {
        let case = Case::new();
        let path = case.file(name, bytes);
        case.refused(&path, &[], &[name]);
    }
}

#[test]
fn y_up_is_detected_and_can_be_accepted() {
    let case = Case::new();
    let turned: String = field(60)
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => format!("v {x} {z} -{y}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let path = case.file("side.obj", turned.replace("--", "-").replace("-0\n", "0\n"));
    case.refused(&path, &[], &["side.obj", "y up", "--up y"]);
    let summary = case.accepted(&path, &["--up", "y"]);
    assert!(summary["area_m2"].as_f64().unwrap() > 3000.0, "{summary}");
}

#[test]
fn nonsense_scale() {
    let case = Case::new();
    let scaled = |factor: f64| -> String {
        field(40)
            .lines()
            .map(|line| {
                let mut words = line.split(' ');
                if words.next() != Some("v") {
                    return format!("{line}\n");
                }
                let numbers: Vec<String> = words.map(|w| (w.parse::<f64>().unwrap() * factor).to_string()).collect();
                format!("v {}\n", numbers.join(" "))
            })
            .collect()
    };
    let path = case.file("tiny.obj", scaled(1e-4));
    case.refused(&path, &[], &["tiny.obj", "measures"]);
    let path = case.file("huge.obj", scaled(1e6));
    case.refused(&path, &[], &["huge.obj", "measures"]);
}

#[test]
fn unknown_crs() {
    let case = Case::new();
    case.file("city/Data/Tile_+000_+000/Tile_+000_+000.obj", field(40));
    case.file(
        "city/metadata.xml",
        "<ModelMetadata version=\"1\"><SRS>Atlantis/Grid</SRS><SRSOrigin>0,0,0</SRSOrigin></ModelMetadata>",
    );
    let path = case.folder.path().join("city");
    case.refused(&path, &[], &["metadata.xml", "Atlantis/Grid", "--crs"]);
}

#[test]
fn missing_materials_and_textures_are_counted() {
    let case = Case::new();
    let path = case.file("grey.obj", format!("mtllib absent.mtl\nusemtl roof\n{}", field(60)));
    let summary = case.accepted(&path, &[]);
    assert!(warned(&summary, "missing material library"), "{}", summary["warnings"]);

    let case = Case::new();
    case.file("some.mtl", "newmtl roof\nmap_Kd absent.jpg\n");
    let path = case.file("grey.obj", format!("mtllib some.mtl\nusemtl roof\n{}", field(60)));
    let summary = case.accepted(&path, &[]);
    assert!(warned(&summary, "missing texture"), "{}", summary["warnings"]);
}

#[test]
fn degenerate_faces_are_counted() {
    let case = Case::new();
    let path = case.file("poor.obj", field(60) + "f 1 1 2\nf 5 6 5\n");
    let summary = case.accepted(&path, &[]);
    assert!(warned(&summary, "degenerate"), "{}", summary["warnings"]);
    assert_eq!(summary["status"], "successful");
}

#[test]
fn an_output_that_cannot_be_written() {
    let case = Case::new();
    let path = case.file("field.obj", field(40));
    let blocked = case.file("blocked", "a file where a folder should be");
    let finished = run_gable(&["run", path.to_str().unwrap(), "--out", blocked.to_str().unwrap(), "--quiet"]);
    assert!([1, 2].contains(&finished.code), "{}", finished.code);
    assert!(finished.stderr.contains("blocked"), "{}", finished.stderr);
    assert_eq!(std::fs::read_to_string(blocked).unwrap(), "a file where a folder should be");
}
