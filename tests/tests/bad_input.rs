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

    /// The run fails with code 2, says exactly `expected` (`{}` stands for the folder of the case), and leaves nothing
    /// behind: no file in the folder of the result but the working folder, and none there that is half-written.
    fn refused(&self, input: &Path, more: &[&str], expected: &str) {
        let out = self.folder.path().join("out");
        let mut arguments =
            vec!["run", input.to_str().unwrap(), "--out", out.to_str().unwrap(), "--grid", "1x1", "--quiet"];
        arguments.extend(more);
        let finished = run_gable(&arguments);
        assert_eq!(finished.code, 2, "{}", finished.stderr);
        let said = finished.stderr.replace(self.folder.path().to_str().unwrap(), "{}");
        assert_eq!(said.trim_end(), format!("error: {expected}"));
        assert!(finished.stdout.is_empty(), "{}", finished.stdout);
        let files = files_in(&out);
        assert!(files.iter().all(|f| f == ".work/key"), "left behind: {files:?}");
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

/// Every file below a folder, by relative path; none if there is no folder.
fn files_in(folder: &Path) -> Vec<String> {
    let mut files = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                files.push(path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned());
            }
        }
    }
    files
}

/// How often a warning came whose text starts so.
fn warned(summary: &serde_json::Value, what: &str) -> u64 {
    let found = summary["warnings"].as_array().unwrap().iter().find(|w| w["what"].as_str().unwrap().starts_with(what));
    found.map_or(0, |w| w["count"].as_u64().unwrap())
}

const AGAIN: &str = "is it a complete copy?";

#[test]
fn no_such_file() {
    Case::new().refused(Path::new("/does/not/exist.obj"), &[], "/does/not/exist.obj: no such file or folder");
}

#[test]
fn unknown_type() {
    let case = Case::new();
    let path = case.file("city.dwg", "AC1032");
    let said = "{}/city.dwg: file type \".dwg\" is not read: give an .obj, .ply, .off, .glb or .gltf file, \
                a tileset.json, or a folder of them";
    case.refused(&path, &[], said);
}

#[test]
fn empty_folder() {
    let case = Case::new();
    std::fs::create_dir(case.folder.path().join("tiles")).unwrap();
    let path = case.folder.path().join("tiles");
    case.refused(
        &path,
        &[],
        "{}/tiles: no .obj, .ply, .off, .glb or .gltf file and no tileset.json in this folder or the folders in it",
    );
}

#[test]
fn truncated_obj() {
    let whole = field(40);
    let lines = |text: &str| text.lines().count();
    let cut = |after: &str, what: &str| {
        let case = Case::new();
        let text = &whole[..whole.find(after).unwrap() + after.len()];
        let path = case.file("cut.obj", text);
        case.refused(
            &path,
            &[],
            &format!("{{}}/cut.obj: line {}: the file ends too early, {what}: {AGAIN}", lines(text)),
        );
    };
    cut("\nv 7 3", "a vertex without z");
    cut("\nf 3", "within a face");
    cut("\nf 3 4", "within a face");
    cut("\nf", "within a statement");
}

/// The headers and vertices of a field's PLY and OFF files, in text; its faces follow.
fn vertices_and_faces(side: usize) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for line in field(side).lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["v", x, y, z] => vertices.push([x, y, z].map(|w| w.parse().unwrap())),
            ["f", a, b, c] => faces.push([a, b, c].map(|w| w.parse::<u32>().unwrap() - 1)),
            _ => {}
        }
    }
    (vertices, faces)
}

fn ply(side: usize, binary: bool) -> Vec<u8> {
    let (vertices, faces) = vertices_and_faces(side);
    let format = if binary { "binary_little_endian" } else { "ascii" };
    let mut ply = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    )
    .into_bytes();
    for [x, y, z] in vertices {
        match binary {
            true => ply.extend([x, y, z].iter().flat_map(|v| v.to_le_bytes())),
            false => ply.extend(format!("{x} {y} {z}\n").bytes()),
        }
    }
    for [a, b, c] in faces {
        match binary {
            true => ply.extend([3].into_iter().chain([a, b, c].iter().flat_map(|v| v.to_le_bytes()))),
            false => ply.extend(format!("3 {a} {b} {c}\n").bytes()),
        }
    }
    ply
}

#[test]
fn truncated_ply() {
    let case = Case::new();
    let whole = ply(40, true);
    let path = case.file("cut.ply", &whole[..whole.len() - 6]);
    let said = format!(
        "{{}}/cut.ply: byte {}: the file ends too early, where a vertex of a face is expected: {AGAIN}",
        whole.len() - 8
    );
    case.refused(&path, &[], &said);

    let whole = String::from_utf8(ply(40, false)).unwrap();
    let path = case.file("text.ply", whole.trim_end().rsplit_once(' ').unwrap().0);
    let said = format!(
        "{{}}/text.ply: line {}: the file ends too early, where a vertex of a face is expected: {AGAIN}",
        whole.lines().count()
    );
    case.refused(&path, &[], &said);
    let path = case.file("head.ply", "ply\nformat ascii 1.0\nelement ver");
    case.refused(&path, &[], &format!("{{}}/head.ply: line 3: the file ends too early, within the header: {AGAIN}"));
}

fn off(side: usize) -> String {
    let (vertices, faces) = vertices_and_faces(side);
    let mut off = format!("OFF\n{} {} 0\n", vertices.len(), faces.len());
    vertices.iter().for_each(|[x, y, z]| off += &format!("{x} {y} {z}\n"));
    faces.iter().for_each(|[a, b, c]| off += &format!("3 {a} {b} {c}\n"));
    off
}

#[test]
fn truncated_off() {
    let case = Case::new();
    let whole = off(40);
    let path = case.file("cut.off", whole.trim_end().rsplit_once(' ').unwrap().0);
    let said = format!(
        "{{}}/cut.off: line {}: the file ends too early, where a vertex of a face is expected: {AGAIN}",
        whole.lines().count()
    );
    case.refused(&path, &[], &said);
}

/// A GLB file with the field.
fn glb(side: usize) -> Vec<u8> {
    let (vertices, faces) = vertices_and_faces(side);
    // y up, as glTF has it.
    let mut buffer: Vec<u8> = vertices.iter().flat_map(|[x, y, z]| [*x, *z, -*y]).flat_map(f32::to_le_bytes).collect();
    let indices = buffer.len();
    buffer.extend(faces.iter().flatten().flat_map(|i| i.to_le_bytes()));
    let side = side as f32;
    let mut json = serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": buffer.len()}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": indices},
            {"buffer": 0, "byteOffset": indices, "byteLength": buffer.len() - indices},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": vertices.len(), "type": "VEC3",
             "min": [0.0, 0.0, -side], "max": [side, 6.0, 0.0]},
            {"bufferView": 1, "componentType": 5125, "count": 3 * faces.len(), "type": "SCALAR"},
        ],
    })
    .to_string();
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    glb.extend((json.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(json.bytes());
    glb.extend((buffer.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(buffer);
    glb
}

#[test]
fn truncated_glb() {
    let case = Case::new();
    let whole = glb(40);
    let path = case.file("cut.glb", &whole[..whole.len() - 10]);
    let said =
        format!("{{}}/cut.glb: byte {}: the file ends too early, 10 bytes before its end: {AGAIN}", whole.len() - 10);
    case.refused(&path, &[], &said);
}

#[test]
fn every_format_is_read_if_it_is_whole() {
    let case = Case::new();
    let triangles = |path: &Path| case.accepted(path, &[])["triangles"].as_u64().unwrap();
    for path in [
        case.file("a.obj", field(40)),
        case.file("a.ply", ply(40, true)),
        case.file("b.ply", ply(40, false)),
        case.file("a.off", off(40)),
        case.file("a.glb", glb(40)),
    ] {
        assert_eq!(triangles(&path), 3200, "{}", path.display());
    }
}

#[test]
fn index_out_of_range() {
    let case = Case::new();
    let obj = field(40) + "f 1 2 99999\n";
    let line = obj.lines().count();
    let path = case.file("index.obj", &obj);
    let said = format!("{{}}/index.obj: line {line}: a face names vertex 99999, but there are 1681");
    case.refused(&path, &["--strict"], &said);
    let summary = case.accepted(&path, &[]);
    assert_eq!(warned(&summary, "face of a vertex that is broken"), 1, "{}", summary["warnings"]);
    assert_eq!(summary["triangles"], 3200);
    let case = Case::new();
    let off = off(40).replace("\n3 0 1 42\n", "\n3 0 1 1681\n");
    let line = off.lines().position(|l| l == "3 0 1 1681").unwrap() + 1;
    let path = case.file("index.off", &off);
    let said = format!("{{}}/index.off: line {line}: a face names vertex 1681, but there are 1681");
    case.refused(&path, &["--set", "input.strict=true"], &said);
    assert_eq!(warned(&case.accepted(&path, &[]), "face of a vertex that is broken"), 1);
}

#[test]
fn coordinates_that_are_no_numbers() {
    for value in ["nan", "-inf", "1e999", "-nan(ind)", "1.#QNAN"] {
        let case = Case::new();
        let path = case.file("a.obj", field(40).replacen("v 0 0 0", &format!("v {value} 0 0"), 1));
        let said = format!("{{}}/a.obj: line 2: a coordinate is \"{value}\": coordinates must be finite numbers");
        case.refused(&path, &["--strict"], &said);
        // A corner of the field, which two faces use.
        let summary = case.accepted(&path, &[]);
        assert_eq!(warned(&summary, "vertex that is no number"), 1, "{}", summary["warnings"]);
        assert_eq!(warned(&summary, "face of a vertex that is broken"), 2, "{}", summary["warnings"]);
        assert_eq!(summary["status"], "successful");
    }
    let case = Case::new();
    let mut bytes = ply(40, true);
    let at = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    bytes[at..at + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let path = case.file("a.ply", bytes);
    let said = format!("{{}}/a.ply: byte {at}: a coordinate is inf: coordinates must be finite numbers");
    case.refused(&path, &["--strict"], &said);
    assert_eq!(warned(&case.accepted(&path, &[]), "face of a vertex that is broken"), 2);
}

#[test]
fn a_damaged_tile_costs_its_place_only() {
    let east = |east: usize| {
        let shift = |line: &str| match line.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => format!("v {} {y} {z}\n", x.parse::<usize>().unwrap() + east),
            _ => format!("{line}\n"),
        };
        field(40).lines().map(shift).collect::<String>()
    };
    let cut = |text: String| text[..text.rfind("\nf 1").unwrap() + 5].to_owned();
    let tiles = |case: &Case, damaged: &[usize]| {
        for at in 0..3 {
            let text = if damaged.contains(&at) { cut(east(40 * at)) } else { east(40 * at) };
            case.file(&format!("city/Tile_{at}/Tile_{at}.obj"), text);
        }
        case.folder.path().join("city")
    };
    let case = Case::new();
    let whole = case.accepted(&tiles(&case, &[]), &[]);
    let case = Case::new();
    let path = tiles(&case, &[1]);
    let summary = case.accepted(&path, &[]);
    assert_eq!(warned(&summary, "mesh file that is damaged, or cannot be read"), 1, "{}", summary["warnings"]);
    let places = &summary["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .find(|w| w["what"] == "mesh file that is damaged, or cannot be read")
        .unwrap()["places"];
    assert!(places[0].as_str().unwrap().contains("Tile_1.obj: line "), "{places}");
    let boxes = |summary: &serde_json::Value| summary["buildings"].as_u64().unwrap();
    assert_eq!((boxes(&whole), boxes(&summary)), (3, 3), "what was read up to the cut holds the box");
    let case = Case::new();
    let path = tiles(&case, &[1]);
    let said = |at: usize| {
        let text = std::fs::read_to_string(path.join(format!("Tile_{at}/Tile_{at}.obj"))).unwrap();
        let lines = text.lines().count();
        format!("{{}}/city/Tile_{at}/Tile_{at}.obj: line {lines}: the file ends too early, within a face: {AGAIN}")
    };
    case.refused(&path, &["--strict"], &said(1));
    tiles(&case, &[0, 1, 2]);
    case.refused(&path, &[], &said(0));
}

#[test]
fn words_for_coordinates() {
    let case = Case::new();
    let path = case.file("word.obj", field(40) + "v one two three\n");
    let line = field(40).lines().count() + 1;
    case.refused(&path, &[], &format!("{{}}/word.obj: line {line}: \"one\" stands where a vertex has its x"));
}

#[test]
fn no_triangles() {
    let case = Case::new();
    let path = case.file("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    case.refused(&path, &[], "{}/points.obj: there are no triangles in it");
}

#[test]
fn wrong_magic() {
    let case = Case::new();
    let refused = |name: &str, bytes: &[u8], said: &str| {
        let path = case.file(name, bytes);
        case.refused(&path, &[], &format!("{{}}/{name}: {said}"));
    };
    refused("fake.ply", b"solid city", "is not a PLY file (ply): it starts with \"solid city\"");
    refused("fake.off", b"PLYX", "is not an OFF file (OFF, COFF, NOFF, STOFF): it starts with \"PLYX\"");
    refused("fake.glb", b"JFIF stuff", "is not a GLB or glTF file: it starts with \"JFIF stu\"");
    refused("fake.obj", b"PK\x03\x04\0\0", "is not an OBJ text file (ASCII, UTF-8): it starts with \"PK\\u{3}\\u{4}\"");
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
    let path = case.file("side.obj", turned.replace("-0\n", "0\n"));
    let said = "{}/side.obj: the model seems to be y up, not z up: 3600 m² of it face along the side and 120 m² along z, and it measures \
                60 × 6 × 60 m: pass --up=y to turn it, or --up z if it is z up";
    case.refused(&path, &[], said);
    let summary = case.accepted(&path, &["--up", "y"]);
    assert!(summary["area_m2"].as_f64().unwrap() > 3000.0, "{summary}");
}

#[test]
fn nonsense_scale() {
    let case = Case::new();
    let refused = |name: &str, place: &dyn Fn([f64; 3]) -> [f64; 3], said: &str| {
        let text: String = field(40)
            .lines()
            .map(|line| {
                let words: Vec<&str> = line.split(' ').collect();
                match words[..] {
                    ["v", x, y, z] => {
                        let [x, y, z] = place([x, y, z].map(|w| w.parse().unwrap()));
                        format!("v {x} {y} {z}\n")
                    }
                    _ => format!("{line}\n"),
                }
            })
            .collect();
        let path = case.file(name, text);
        case.refused(&path, &[], &format!("{{}}/{name}: the model measures {said}"));
    };
    refused(
        "kilometres.obj",
        &|p| p.map(|v| v / 1e3),
        "0.040000 × 0.040000 in plan: a city measures more than a metre: are the units kilometres, or is it scaled?",
    );
    refused(
        "millimetres.obj",
        &|p| p.map(|v| v * 1e3),
        "40000.000000 × 40000.000000 in plan: its triangles measure more than 50 m on average: \
         are the units millimetres or centimetres?",
    );
    refused(
        "micrometres.obj",
        &|[x, y, z]| [x * 1e6, y * 1e6, z],
        "40000000.000000 × 40000000.000000 in plan: its triangles measure more than 50 m on average: \
         are the units millimetres or centimetres?",
    );
    refused(
        "degrees.obj",
        &|[x, y, z]| [8.6 + x / 1e5, 50.1 + y / 1e5, z + 100.0],
        "0.000400 × 0.000400 in plan: these look like degrees: give coordinates in a projected system, in metres",
    );
    refused(
        "earth.obj",
        &|[x, y, z]| [x + 4.0e6, y + 6.0e5, z + 4.9e6],
        "40.000000 × 40.000000 in plan: heights beyond 100 km: these look like earth-centred coordinates: \
         give them in a projected or local system, z up",
    );
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
    let said = "{}/city/metadata.xml: unknown reference system \"Atlantis/Grid\": pass --crs EPSG:code \
                (or ENU:latitude,longitude) to say which it is";
    case.refused(&path, &[], said);
    assert_eq!(case.accepted(&path, &["--crs", "EPSG:25832"])["crs"], "EPSG:25832");
}

#[test]
fn missing_materials_and_textures_are_counted_and_told() {
    let case = Case::new();
    let path = case.file("grey.obj", format!("mtllib absent.mtl\nusemtl roof\n{}", field(60)));
    let summary = case.accepted(&path, &[]);
    assert_eq!(warned(&summary, "missing material library (MTL)"), 1, "{}", summary["warnings"]);
    assert_eq!(warned(&summary, "face with an unknown material"), 7200, "{}", summary["warnings"]);

    // Neither textures nor a reference system: both stand in the report, for a person.
    assert_eq!(warned(&summary, "mesh without textures"), 1, "{}", summary["warnings"]);
    assert_eq!(warned(&summary, "mesh that does not tell its reference system"), 1, "{}", summary["warnings"]);

    let case = Case::new();
    let materials: String = (0..7).map(|i| format!("newmtl m{i}\nmap_Kd absent{i}.jpg\n")).collect();
    case.file("some.mtl", materials);
    let path = case.file("grey.obj", format!("mtllib some.mtl\nusemtl m0\n{}", field(60)));
    let summary = case.accepted(&path, &[]);
    assert_eq!(warned(&summary, "missing texture"), 7, "{}", summary["warnings"]);

    // At the terminal: the first files and how many more; not with --quiet.
    let out = case.folder.path().join("told");
    let arguments = ["run", path.to_str().unwrap(), "--out", out.to_str().unwrap(), "--grid", "1x1"];
    let told = run_gable(&arguments).success().stderr;
    let place = |i: usize| format!("\n    {}/absent{i}.jpg: ", case.folder.path().display());
    assert!(told.contains("warning: 7 × missing texture: what it covers is grey\n    "), "{told}");
    assert!((0..5).all(|i| told.contains(&place(i))) && !told.contains(&place(5)), "{told}");
    assert!(told.contains("\n    and 2 more\n"), "{told}");
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("mesh without textures, or with few") && page.contains("does not tell its reference system"));
    assert!(page.contains("missing texture") && page.contains("absent4.jpg") && page.contains("and 2 more"));
    let quiet = run_gable(&[&arguments[..], &["--quiet"]].concat()).success();
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn an_undecodable_texture_is_counted_and_grey() {
    let case = Case::new();
    // The first bytes of a JPEG image, then nothing that could be decoded.
    case.file("broken.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF\0\x01 and then the copy was cut off");
    case.file("some.mtl", "newmtl roof\nmap_Kd broken.jpg\n");
    let mut obj = String::from("mtllib some.mtl\nusemtl roof\nvt 0 0\nvt 1 0\nvt 1 1\n");
    for line in field(60).lines() {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["f", a, b, c] => obj += &format!("f {a}/1 {b}/2 {c}/3\n"),
            _ => obj += &format!("{line}\n"),
        }
    }
    let summary = case.accepted(&case.file("a.obj", obj), &[]);
    assert_eq!(warned(&summary, "undecodable texture"), 1, "{}", summary["warnings"]);
    assert!(summary["warnings"][0]["places"][0].as_str().unwrap().contains("broken.jpg"), "{}", summary["warnings"]);
    assert_eq!(summary["status"], "successful");
}

#[test]
fn poor_faces_floating_parts_and_holes_are_counted_whatever_the_grid() {
    let case = Case::new();
    let mut obj = field(60);
    // Faces without area, and one of two corners.
    obj += "f 1 1 2\nf 5 6 5\nf 7 8\n";
    // The first cell's two triangles again, in other orders.
    obj += "f 63 1 2\nf 63 1 62\nf 63 62 1\n";
    // A square of 1 m in the air.
    obj += "v 40 40 9\nv 41 40 9\nv 41 41 9\nv 40 41 9\nf -4 -3 -2\nf -4 -2 -1\n";
    // A hole of 5 × 4 m across the middle.
    let row = 61;
    let gone: Vec<String> = (28..32)
        .flat_map(|y| (28..33).map(move |x| y * row + x + 1))
        .flat_map(|a| [format!("f {} {} {}", a, a + 1, a + row + 1), format!("f {} {} {}", a, a + row + 1, a + row)])
        .collect();
    let obj: String = obj.lines().filter(|l| !gone.iter().any(|g| g == l)).map(|l| format!("{l}\n")).collect();
    let path = case.file("poor.obj", obj);
    for grid in ["1x1", "2x2", "5x3"] {
        let out = case.folder.path().join(grid);
        let arguments =
            ["run", path.to_str().unwrap(), "--out", out.to_str().unwrap(), "--grid", grid, "--json", "--quiet"];
        let summary = run_gable(&arguments).success().json();
        let counts = ["degenerate face", "duplicate face", "floating part", "hole in the mesh"]
            .map(|what| warned(&summary, what));
        assert_eq!(counts, [3, 3, 1, 1], "{grid}: {}", summary["warnings"]);
        let hole =
            summary["warnings"].as_array().unwrap().iter().find(|w| w["what"].as_str().unwrap().starts_with("hole"));
        assert_eq!(hole.unwrap()["places"][0], "20.0 m² at 30.5 30.0", "{grid}");
        assert_eq!(summary["status"], "successful");
    }
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
