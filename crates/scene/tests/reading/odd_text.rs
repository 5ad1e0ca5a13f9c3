//! Text as it is found: every line end, zero bytes behind the end, commas for points; and files that are no mesh.

use crate::town::{Folder, Read, png, read, town};
use gable_geometry::DVec3;
use gable_scene::{OpenOptions, SceneError, WarningKind};

fn positions(read: &Read) -> Vec<[DVec3; 3]> {
    read.triangles.iter().map(|t| t.corners).collect()
}

fn returns(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().map(|b| if *b == b'\n' { b'\r' } else { *b }).collect()
}

/// The header of a binary PLY file with CR alone, the numbers as they are.
fn returns_in_header(bytes: &[u8]) -> Vec<u8> {
    let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
    [&returns(&bytes[..end]), &bytes[end..]].concat()
}

#[test]
fn lines_that_end_with_cr_alone() {
    let (town, folder) = (town(), Folder::new());
    folder.write("town.mtl", returns(b"newmtl brick\nmap_Kd town.png\n"));
    folder.write("town.png", png());
    let long: String = (0..400_000).map(|i| format!("# {i} of a comment\r")).collect();
    for (name, bytes) in [
        ("a.obj", returns(town.obj().as_bytes())),
        ("long.obj", [long.as_bytes(), &returns(town.obj().as_bytes())].concat()),
        ("a.off", returns(town.off().as_bytes())),
        ("text.ply", returns(&town.ply("ascii"))),
        ("little.ply", returns_in_header(&town.ply("binary_little_endian"))),
        ("big.ply", returns_in_header(&town.ply("binary_big_endian"))),
    ] {
        let read =
            read(&folder.write(name, bytes), &OpenOptions { strict: true, ..OpenOptions::default() }).expect(name);
        assert_eq!(positions(&read), town.corners(), "{name}");
        if name.ends_with("obj") {
            assert!(read.materials[0].texture.is_some(), "{name}");
        }
    }
    // Lines are counted all the same.
    let said =
        |name: &str, text: &str| folder.said(&folder.write(name, returns(text.as_bytes())), &OpenOptions::default());
    assert_eq!(
        said("b.obj", "v 0 0 0\n\nf 1 x 3\n"),
        "b.obj: line 3: \"x\" is no corner of a face: write v, v/vt or v/vt/vn"
    );
    assert_eq!(
        said("b.off", "OFF\n3 1 0\n0 0 x\n"),
        "b.off: line 3: \"x\" stands where a vertex coordinate is expected"
    );
}

#[test]
fn zero_bytes_at_the_end() {
    let (town, folder) = (town(), Folder::new());
    let (json, buffer) = town.gltf("town.bin", &png());
    folder.write("town.bin", buffer);
    for (name, bytes, told) in [
        ("a.obj", town.obj().into_bytes(), 1),
        // What follows the last number of these is not looked at.
        ("a.off", town.off().into_bytes(), 0),
        ("text.ply", town.ply("ascii"), 0),
        ("little.ply", town.ply("binary_little_endian"), 0),
        ("a.glb", town.glb(&png()), 0),
        ("a.gltf", json.into_bytes(), 0),
    ] {
        for zeros in [1, 4096, 9 << 20] {
            let path = folder.write(name, [&bytes[..], &vec![0; zeros]].concat());
            let read = read(&path, &OpenOptions::default()).expect(name);
            assert_eq!(read.triangles.len(), 18, "{name}");
            assert_eq!(read.counts.warnings.count(WarningKind::ZeroBytes), told, "{name}, {zeros} zeros");
        }
    }
    let strict = OpenOptions { strict: true, ..OpenOptions::default() };
    let said = folder.said(&folder.path().join("a.obj"), &strict);
    assert!(
        said.contains("the file ends too early, where 9437184 zero bytes follow: is it a complete copy?"),
        "{said}"
    );
    // Zeros in place of the rest, as a copy leaves them that was cut off.
    let cut = |text: String, count: usize| {
        let mut bytes = text.into_bytes();
        let from = bytes.len() - count;
        bytes[from..].fill(0);
        bytes
    };
    for (name, bytes) in [
        ("b.obj", cut(town.obj(), 14)),
        ("b.off", cut(town.off(), 16)),
        ("b.ply", cut(String::from_utf8(town.ply("ascii")).expect("text"), 6)),
    ] {
        let said = folder.said(&folder.write(name, bytes), &OpenOptions::default());
        assert!(said.contains("the file ends too early"), "{said}");
    }
    let mut hole = town.obj().into_bytes();
    hole.splice(200..200, vec![0; 10 << 20]);
    let said = folder.said(&folder.write("c.obj", hole), &OpenOptions::default());
    assert!(said.starts_with("c.obj: "), "{said}");
}

#[test]
fn commas_for_points() {
    let (town, folder) = (town(), Folder::new());
    let commas = |text: String| text.replace('.', ",").replace("town,mtl", "town.mtl").replace("1,0\n", "1.0\n");
    for (name, text) in [
        ("a.obj", commas(town.obj())),
        ("a.off", commas(town.off())),
        ("a.ply", commas(String::from_utf8(town.ply("ascii")).expect("text"))),
    ] {
        let read = read(&folder.write(name, text), &OpenOptions::default()).expect(name);
        assert_eq!(positions(&read), town.corners(), "{name}");
        assert!(read.counts.warnings.count(WarningKind::DecimalComma) > 8, "{name}: {:?}", read.counts.warnings);
        if name == "a.obj" {
            let uv = read.triangles[4].uv.expect("texture coordinates");
            assert!(uv.iter().flatten().any(|c| *c == 0.25 || *c == 0.5), "{uv:?}");
        }
    }
    let said = |name: &str, text: &str| folder.said(&folder.write(name, text), &OpenOptions::default());
    assert_eq!(said("b.obj", "v 1,234,567 0 0\n"), "b.obj: line 1: \"1,234,567\" stands where a vertex has its x");
    for face in ["1,2,3", "1/1,2/2,3/3", "1, 2, 3"] {
        let text = said("c.obj", &format!("v 0 0 0\nv 9 0 0\nv 9 9 0\nvt 0 0\nvt 0 0\nvt 0 0\nf {face}\n"));
        assert!(text.starts_with("c.obj: line 7: a comma stands in \"1"), "{text}");
        assert!(text.ends_with("write the corners of a face apart by blanks"), "{text}");
    }
}

/// A binary OFF file as Geomview writes it: big-endian, with what `keyword` says at each vertex.
fn binary_off(keyword: &str) -> Vec<u8> {
    let town = town();
    let mut bytes = format!("{keyword} BINARY\n").into_bytes();
    let int = |bytes: &mut Vec<u8>, value: usize| bytes.extend_from_slice(&(value as i32).to_be_bytes());
    let float = |bytes: &mut Vec<u8>, value: f64| bytes.extend_from_slice(&(value as f32).to_be_bytes());
    [town.positions.len(), town.quads.len(), 0].into_iter().for_each(|count| int(&mut bytes, count));
    for (at, p) in town.positions.iter().enumerate() {
        p.to_array().into_iter().for_each(|v| float(&mut bytes, v));
        if keyword.contains('N') {
            [0.0, 0.0, 1.0].into_iter().for_each(|v| float(&mut bytes, v));
        }
        if keyword.contains('C') {
            [1.0, 0.5, 0.0, 1.0].into_iter().for_each(|v| float(&mut bytes, v));
        }
        if keyword.contains("ST") {
            town.uvs[at].into_iter().for_each(|v| float(&mut bytes, f64::from(v)));
        }
    }
    for (at, quad) in town.quads.iter().enumerate() {
        int(&mut bytes, 4);
        quad.iter().for_each(|i| int(&mut bytes, *i));
        // A colour at every second face.
        let components = if at % 2 == 0 { 0 } else { 3 };
        int(&mut bytes, components);
        (0..components).for_each(|_| float(&mut bytes, 0.5));
    }
    bytes
}

#[test]
fn off_without_its_keyword_and_binary() {
    let (town, folder) = (town(), Folder::new());
    let bare = town.off().replace("COFF # a town\n", "").into_bytes();
    let marked = [b"\xef\xbb\xbf", &bare[..]].concat();
    let commented = [b"# by nobody\n", &bare[..]].concat();
    for (name, bytes) in [
        ("bare.off", bare),
        ("marked.off", marked),
        ("commented.off", commented),
        ("binary.off", binary_off("OFF")),
        ("colour.off", binary_off("COFF")),
        ("all.off", binary_off("STCNOFF")),
    ] {
        let read = read(&folder.write(name, bytes), &OpenOptions::default()).expect(name);
        let expected: Vec<_> = town.corners();
        assert_eq!(positions(&read), expected, "{name}");
        let coloured = name == "colour.off" || name == "all.off";
        assert_eq!(read.triangles[0].colours.map(|c| c[0]), coloured.then_some([255, 128, 0]), "{name}");
        assert_eq!(read.triangles[0].uv.is_some(), name == "all.off", "{name}");
    }
    let whole = binary_off("OFF");
    let said = folder.said(&folder.write("cut.off", &whole[..whole.len() - 6]), &OpenOptions::default());
    assert!(said.contains("the file ends too early, where "), "{said}");
}

#[test]
fn a_point_cloud_is_called_one() {
    let folder = Folder::new();
    let points = |format: &str, faces: &str| {
        let mut bytes = format!(
            "ply\nformat {format} 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n{faces}end_header\n"
        )
        .into_bytes();
        match format {
            "ascii" => bytes.extend_from_slice(b"0 0 0\n1 1 1\n"),
            _ => bytes.extend_from_slice(&[0; 24]),
        }
        bytes
    };
    for (format, faces) in [
        ("ascii", ""),
        ("binary_little_endian", ""),
        ("binary_big_endian", "element face 0\nproperty list uchar int vertex_indices\n"),
    ] {
        let path = folder.write("cloud/cloud.ply", points(format, faces));
        assert_eq!(
            folder.said(&path, &OpenOptions::default()),
            "cloud/cloud.ply: it is a point cloud: it has 2 points and no faces: give the mesh that was made of it"
        );
        // Beside a mesh it is passed over, and told.
        folder.write("both/cloud.ply", points(format, faces));
        folder.write("both/mesh.ply", town().ply("ascii"));
        let read = read(&folder.path().join("both"), &OpenOptions::default()).expect("reads the mesh");
        assert_eq!((read.triangles.len(), read.counts.warnings.count(WarningKind::BrokenFile)), (18, 1));
    }
    // UTF-16 is no text that is read, and says so.
    let wide: Vec<u8> = town().obj().encode_utf16().flat_map(u16::to_le_bytes).collect();
    let error = read(&folder.write("wide.obj", [b"\xff\xfe", &wide[..]].concat()), &OpenOptions::default());
    assert!(matches!(error, Err(SceneError::WrongMagic { .. })));
}
