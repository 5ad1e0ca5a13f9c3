//! Small files that stand for far more than a city are refused before that much is made.

use crate::town::{Folder, Read, base64, png, read, town};
use gable_scene::{OpenOptions, WarningKind};
use std::fmt::Write;
use std::os::unix::fs::symlink;

fn options() -> OpenOptions {
    OpenOptions::default()
}

#[test]
fn a_library_is_read_once_whatever_it_is_called_and_however_often() {
    let folder = Folder::new();
    let library: String = (0..2000).map(|i| format!("newmtl m{i}\nKd 1 0 0\n")).collect();
    folder.write("a.mtl", format!("{library}newmtl brick\nKd 0 1 0\n"));
    symlink("a.mtl", folder.path().join("link.mtl")).expect("linked");
    let mentions = format!("mtllib {}", "a.mtl ./a.mtl .//a.mtl link.mtl ".repeat(75_000));
    let lines = "mtllib a.mtl\nmtllib ./a.mtl\nmtllib link.mtl\n".repeat(1000);
    for text in [mentions, lines] {
        let obj = folder.write("a.obj", town().obj().replace("mtllib town.mtl", &text));
        folder.write("b.obj", std::fs::read(&obj).expect("reads"));
        let Read { triangles, materials, counts, .. } = read(folder.path(), &options()).expect("reads");
        assert_eq!((materials.len(), counts.files), (2001, 2));
        assert!(triangles.iter().all(|t| materials[t.material as usize].name == "brick"));
    }
}

#[test]
fn libraries_that_are_not_there_are_looked_for_so_often_only() {
    let folder = Folder::new();
    let names = |count: usize, end: &str| (0..count).map(|i| format!("mtllib {i}.mtl{end}")).collect::<String>();
    for (count, refused) in [(10_000, false), (10_001, true)] {
        for text in [names(count, "\n"), format!("mtllib {}", names(count, " ").replace("mtllib ", ""))] {
            let obj = folder.write("a.obj", town().obj().replace("mtllib town.mtl", &text));
            let result = read(&obj, &options());
            match result {
                Err(error) if refused => {
                    assert!(error.to_string().ends_with("names more than 10000 material libraries"), "{error}");
                }
                Ok(Read { counts, .. }) if !refused => {
                    assert_eq!(counts.warnings.count(WarningKind::MissingMaterialLibrary), count as u64);
                }
                other => panic!("{count}: {:?}", other.map(|r| r.counts)),
            }
        }
    }
}

/// A glTF whose nodes all show one mesh, whose primitives all show the same triangles.
fn repeated(nodes: usize, primitives: usize, triangles: usize) -> String {
    let mut buffer = Vec::new();
    for v in [0.0_f32, 0.0, 0.0, 9.0, 0.0, 0.0, 9.0, 0.0, -9.0] {
        buffer.extend_from_slice(&v.to_le_bytes());
    }
    let indices = buffer.len();
    buffer.extend((0..triangles).flat_map(|_| [0_u8, 1, 2]));
    let list = |count: usize, item: &str| vec![item; count].join(",");
    let roots = (0..nodes).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{roots}]}}],"nodes":[{}],"meshes":[{{"primitives":[{}]}}],
        "buffers":[{{"uri":"data:;base64,{}","byteLength":{}}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":{indices},"byteLength":{}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,-9],"max":[9,0,0]}},
        {{"bufferView":1,"componentType":5121,"count":{},"type":"SCALAR"}}]}}"#,
        list(nodes, r#"{"mesh":0}"#),
        list(primitives, r#"{"attributes":{"POSITION":0},"indices":1}"#),
        base64(&buffer),
        buffer.len(),
        3 * triangles,
        3 * triangles
    )
}

#[test]
fn a_gltf_that_shows_the_same_without_end() {
    let folder = Folder::new();
    let Read { triangles, .. } = read(&folder.write("few.gltf", repeated(10, 5, 20)), &options()).expect("reads");
    assert_eq!(triangles.len(), 1000, "trees may be shown many times");
    let json = repeated(3000, 1000, 20_000);
    assert!(json.len() < 300_000, "{}", json.len());
    let said = folder.said(&folder.write("many.gltf", json), &options());
    assert!(said.starts_with("many.gltf: its nodes show 60000000000 triangles from 60036 bytes"), "{said}");
    // Points and triangles without area take as long to look at.
    let said = folder.said(&folder.write("none.gltf", repeated(20_000, 20_000, 1)), &options());
    assert!(said.contains("more than is read of such a file"), "{said}");
    // A file that is many buffers has no more bytes for that.
    folder.write("big.bin", vec![0; 60_036]);
    let buffers = vec![r#"{"uri":"big.bin","byteLength":60036}"#; 2000].join(",");
    let json = repeated(3000, 1000, 20_000).replace("\"buffers\":[", &format!("\"buffers\":[{buffers},"));
    let json = json.replace("\"buffer\":0", "\"buffer\":2000");
    let said = folder.said(&folder.write("many.gltf", json), &options());
    assert!(said.contains("triangles from 120072 bytes"), "{said}");
}

#[test]
fn json_whose_objects_would_fill_the_memory() {
    let folder = Folder::new();
    let materials = "{},".repeat(2_000_001);
    let json = format!(r#"{{"asset":{{"version":"2.0"}},"materials":[{}]}}"#, materials.trim_end_matches(','));
    let said = folder.said(&folder.write("a.gltf", json), &options());
    assert_eq!(said, "a.gltf: its JSON has more than 2000000 objects");
    for key in ["extras", "extensions", "nodes", "unknown"] {
        let deep = "[".repeat(1_000_000) + &"]".repeat(1_000_000);
        let json = format!(r#"{{"asset":{{"version":"2.0"}},"{key}":{deep}}}"#);
        assert!(read(&folder.write("a.gltf", json), &options()).is_err(), "{key}");
    }
}

#[test]
fn headers_that_promise_more_than_can_be() {
    let folder = Folder::new();
    let million = 1_000_000_000_000_000_000_u64;
    for format in ["ascii", "binary_little_endian"] {
        let header = format!(
            "ply\nformat {format} 1.0\nelement vertex {million}\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        );
        let said = folder.said(&folder.write("a.ply", header), &options());
        assert_eq!(said, "a.ply: it has more than 250 million vertices: split it into tiles");
    }
    let said = folder.said(&folder.write("a.off", "OFF\n300000000 1 0\n"), &options());
    assert_eq!(said, "a.off: it has more than 250 million vertices: split it into tiles");
}

#[test]
fn faces_of_a_million_corners() {
    let folder = Folder::new();
    let face = |corners: usize| {
        let mut text = town().obj();
        let _ = writeln!(text, "f{}", " 1 2 2".repeat(corners / 3));
        folder.write("a.obj", text)
    };
    assert!(read(&face(999_999), &options()).is_ok());
    let said = folder.said(&face(1_000_002), &options());
    assert!(said.ends_with("a face of more than 1000000 corners"), "{said}");
    // Three corners again and again wind around many times, and take the time of what is not convex.
    let mut text = town().obj();
    let _ = writeln!(text, "f{}", " 1 2 3".repeat(30_000));
    let said = folder.said(&folder.write("b.obj", text), &options());
    assert!(said.contains("a face that is not convex has more than 50000 corners: split it"), "{said}");
}

#[test]
fn metadata_that_is_nested_without_end() {
    let folder = Folder::new();
    let obj = folder.write("a.obj", town().obj());
    folder.write("metadata.xml", format!("<ModelMetadata>{}", "<a>".repeat(1_000_000)));
    let said = folder.said(&obj, &options());
    assert!(said.ends_with("elements are nested deeper than 64"), "{said}");
    // What is longer than any metadata is none.
    folder.write("metadata.xml", format!("<ModelMetadata>{}", " ".repeat(17 << 20)));
    assert!(read(&obj, &options()).is_ok());
}

#[test]
fn links_that_make_a_folder_endless() {
    let folder = Folder::new();
    folder.write("a.obj", town().obj());
    for i in 0..40 {
        symlink(".", folder.path().join(format!("again{i}"))).expect("linked");
    }
    let said = folder.said(folder.path(), &options());
    assert!(said.ends_with("entries"), "{said}");
}

#[test]
fn images_of_absurd_size() {
    let folder = Folder::new();
    folder.write("town.mtl", "newmtl brick\nmap_Kd a.png\n");
    let mut image = png();
    // Width and height stand after the signature and the head of the first chunk; the checksum follows the chunk.
    for (side, said) in [(30_000_u32, "30000 × 30000 pixels, more than"), (4_000_000, "limit"), (u32::MAX, "")] {
        image[16..20].copy_from_slice(&side.to_be_bytes());
        image[20..24].copy_from_slice(&side.to_be_bytes());
        // Grey, so that its pixels alone would fit.
        image[25] = 0;
        let crc = crc(&image[12..29]);
        image[29..33].copy_from_slice(&crc.to_be_bytes());
        folder.write("a.png", &image);
        let Read { scene, materials, .. } = read(&folder.write("a.obj", town().obj()), &options()).expect("reads");
        let error = gable_scene::load_texture(&materials[0], scene.reach()).expect_err("too large").to_string();
        assert!(error.to_lowercase().contains(said), "{error}");
    }
}

/// CRC-32 as PNG has it.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    })
}
