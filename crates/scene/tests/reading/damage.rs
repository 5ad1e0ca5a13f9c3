//! Damage costs what it touches, and is told; strict reading refuses it.

use crate::town::{Folder, Read, Town, png, read, town};
use gable_scene::{OpenOptions, SceneError, WarningKind};
use std::path::Path;

fn strict() -> OpenOptions {
    OpenOptions { strict: true, ..OpenOptions::default() }
}

/// The town in every format; its last vertex, a corner of the roof, stands where `broken` says: in text, or as bytes.
fn formats(town: &Town, broken: [&str; 3]) -> Vec<(&'static str, Vec<u8>)> {
    let value = |text: &str| text.parse::<f64>().unwrap_or(f64::NAN);
    let last = town.positions[11];
    let text_of = |p: gable_geometry::DVec3| format!("{} {} {}", p.x, p.y, p.z);
    let put = |text: String| text.replacen(&text_of(last), &broken.join(" "), 1).into_bytes();
    let put_bytes = |mut bytes: Vec<u8>, old: Vec<u8>, new: Vec<u8>| {
        let at = bytes.windows(old.len()).position(|w| w == old).expect("the vertex is there");
        bytes[at..at + new.len()].copy_from_slice(&new);
        bytes
    };
    let doubles = |p: [f64; 3], big: bool| -> Vec<u8> {
        p.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() }).collect()
    };
    let [x, y, z] = broken.map(value);
    let (before, after) = (last.to_array(), [x, y, z]);
    // As the town's glTF has it: y up, half the size, shifted.
    let floats = |p: [f64; 3]| -> Vec<u8> {
        [p[0] - 7.0, p[2], -p[1]].iter().flat_map(|v| ((v / 2.0) as f32).to_le_bytes()).collect()
    };
    vec![
        ("a.obj", put(town.obj())),
        ("a.off", put(town.off())),
        ("text.ply", put(String::from_utf8(town.ply("ascii")).expect("text"))),
        ("little.ply", put_bytes(town.ply("binary_little_endian"), doubles(before, false), doubles(after, false))),
        ("big.ply", put_bytes(town.ply("binary_big_endian"), doubles(before, true), doubles(after, true))),
        ("a.glb", put_bytes(town.glb(&png()), floats(before), floats(after))),
    ]
}

#[test]
fn a_vertex_that_is_no_number_costs_its_faces() {
    let town = town();
    let folder = Folder::new();
    // The last corner of the roof: two walls and the roof use it, four triangles of three quads.
    let all = town.corners();
    let whole: Vec<_> = all.iter().filter(|t| t.iter().all(|c| *c != town.positions[11])).copied().collect();
    for broken in [["nan", "nan", "nan"], ["20", "-nan(ind)", "6"], ["inf", "0", "0"], ["1e999", "1", "-1.#IND"]] {
        for (name, bytes) in formats(&town, broken) {
            let path = folder.write(name, bytes);
            let Read { triangles, counts, .. } = read(&path, &OpenOptions::default()).expect("reads");
            let told = &counts.warnings;
            assert_eq!(told.count(WarningKind::BrokenVertex), 1, "{name} {broken:?}");
            let quads = if name.ends_with("glb") { 4 } else { 3 };
            assert_eq!(told.count(WarningKind::BrokenFace), quads, "{name} {broken:?}");
            assert!(counts.min[0] >= 0.0 && counts.max[0] <= 40.0, "{name} {broken:?}");
            let kept: Vec<_> = triangles.iter().map(|t| t.corners).collect();
            // A quad that lost a corner is left out as a whole; triangles of glTF one by one.
            assert!(kept.iter().all(|t| whole.contains(t)), "{name} {broken:?}");
            assert_eq!(kept.len(), all.len() - if name.ends_with("glb") { 4 } else { 6 }, "{name} {broken:?}");
            let vertex = told.entries().iter().find(|w| w.kind == WarningKind::BrokenVertex).expect("told");
            assert!(vertex.examples[0].contains(name) && vertex.examples[0].contains(" is "), "{:?}", vertex.examples);
            assert!(matches!(read(&path, &strict()), Err(SceneError::NotFinite { .. })), "{name} {broken:?}");
        }
    }
}

#[test]
fn a_face_of_what_is_not_there_is_left_out() {
    let town = town();
    let folder = Folder::new();
    let last = "8 9 10 11";
    let ply = String::from_utf8(town.ply("ascii")).expect("text");
    for (name, text) in [
        ("a.obj", town.obj().replace("f 9/9 10/10 11/11 12/12", "f 9/9 10/10 11/11 99/12")),
        ("b.obj", town.obj().replace("f 9/9 10/10 11/11 12/12", "f 9/9 10/10 0/11 12/12")),
        ("c.obj", town.obj().replace("f 9/9 10/10 11/11 12/12", "f 9/9 10/10 11/11 12/-99")),
        ("a.off", town.off().replace(last, "8 9 10 99")),
        ("a.ply", ply.replace(last, "8 -1 99 11")),
    ] {
        let path = folder.write(name, text);
        let Read { triangles, counts, .. } = read(&path, &OpenOptions::default()).expect("reads");
        assert_eq!(triangles.len(), 16, "{name}");
        assert_eq!(counts.warnings.count(WarningKind::BrokenFace), 1, "{name}");
        assert!(matches!(read(&path, &strict()), Err(SceneError::IndexOutOfRange { .. })), "{name}");
    }
    // Where most faces name what is not there, the numbers are those of another file.
    let path = folder.write("all.obj", town.obj().replace("f ", "f 77/1 "));
    assert!(matches!(read(&path, &OpenOptions::default()), Err(SceneError::IndexOutOfRange { index: 77, .. })));
}

/// Writes the town twice, 100 m apart, and a third tile of these bytes between.
fn tiles(folder: &Folder, end: &str, whole: &[u8], broken: &[u8]) {
    for (at, bytes) in [whole, broken, whole].into_iter().enumerate() {
        folder.write(&format!("{end}/Tile_{at}/Tile_{at}.{end}"), bytes);
    }
}

#[test]
fn a_broken_tile_costs_itself() {
    let town = town();
    let little = town.ply("binary_little_endian");
    let glb = town.glb(&png());
    let (obj, off) = (town.obj().into_bytes(), town.off().into_bytes());
    let cut = |bytes: &[u8], from_end: usize| bytes[..bytes.len() - from_end].to_vec();
    // What is broken, and how many triangles of it are read all the same.
    let cases: Vec<(&str, &[u8], Vec<u8>, usize)> = vec![
        ("obj", &obj, cut(&obj, 14), 16),
        ("obj", &obj, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec(), 0),
        ("obj", &obj, [b"v 1 one 3\n", &obj[..]].concat(), 0),
        ("obj", &obj, [&obj[..], b"f 1/2/3/4 2 3\nf 1 2 3\n"].concat(), 18),
        ("ply", &little, cut(&little, 4), 16),
        ("ply", &little, cut(&little, little.len() - 30), 0),
        ("ply", &little, Vec::new(), 0),
        ("off", &off, cut(&off, 20), 16),
        ("off", &off, b"Off with you".to_vec(), 0),
        ("glb", &glb, cut(&glb, 100), 0),
        ("glb", &glb, b"<html>404</html>".to_vec(), 0),
    ];
    for (case, (end, whole, broken, left)) in cases.into_iter().enumerate() {
        let folder = Folder::new();
        tiles(&folder, end, whole, &broken);
        let path = folder.path().join(end);
        let Read { triangles, counts, .. } = read(&path, &OpenOptions::default()).expect("reads the others");
        assert_eq!(triangles.len(), 36 + left, "case {case}");
        let told = counts.warnings.entries().iter().find(|w| w.kind == WarningKind::BrokenFile).expect("told");
        assert!(told.count == 1 && told.examples[0].contains(&format!("Tile_1.{end}: ")), "{told:?}");
        assert_eq!(counts.warnings.count(WarningKind::EmptyFile), 0, "case {case}");
        let said = read(&path, &strict()).expect_err("strict").to_string();
        assert!(said.contains(&format!("Tile_1.{end}: ")), "{said}");
        // Alone, it is refused.
        assert!(read(&path.join("Tile_1"), &OpenOptions::default()).is_err(), "case {case}");
    }
}

#[test]
fn tiles_that_are_all_broken_are_refused() {
    for (end, broken) in [("obj", "v 1 2 3\nf 1 x 3\n"), ("ply", "plx"), ("off", "OFF\n3 1 0\n0 0 0\n")] {
        let folder = Folder::new();
        tiles(&folder, end, broken.as_bytes(), broken.as_bytes());
        let said = folder.said(&folder.path().join(end), &OpenOptions::default());
        assert!(said.contains(&format!("Tile_0/Tile_0.{end}: ")), "{said}");
    }
}

#[test]
fn many_threads_read_broken_tiles_alike() {
    let folder = Folder::new();
    let mut long = town().obj();
    for at in 0..200_000 {
        long += &format!("v {at} 0 0\n");
    }
    let broken = format!("{long}v x\n{long}");
    tiles(&folder, "obj", long.as_bytes(), broken.as_bytes());
    let all = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let Read { triangles, counts, .. } =
            pool.install(|| read(Path::new(&folder.path().join("obj")), &OpenOptions::default())).expect("reads");
        (triangles.len(), counts)
    };
    assert_eq!(all(1), all(4));
    assert_eq!(all(4).0, 54);
}
