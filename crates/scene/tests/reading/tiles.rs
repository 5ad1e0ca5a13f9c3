//! 3D Tiles as a mesh, and glTF files that write their numbers in another way.

use crate::town::{Folder, Read, png, read, town};
use gable_geometry::{Crs, DVec3, dvec3};
use gable_scene::{OpenOptions, Scene, SceneError, Up, WarningKind, load_texture};
use serde_json::{Value, json};

fn positions(read: &Read) -> Vec<[DVec3; 3]> {
    read.triangles.iter().map(|t| t.corners).collect()
}

/// How far the corners of what was read are off the town's, at most, metres.
fn off(read: &Read, expected: &[[DVec3; 3]]) -> f64 {
    let found = positions(read);
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().flatten().zip(expected.iter().flatten());
    pairs.map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max)
}

/// A tile of version 1.0 around a GLB.
fn b3dm(glb: &[u8], features: &str) -> Vec<u8> {
    let mut table = features.as_bytes().to_vec();
    while !(28 + table.len()).is_multiple_of(8) {
        table.push(b' ');
    }
    let mut tile = b"b3dm\x01\0\0\0".to_vec();
    for number in [28 + table.len() + glb.len(), table.len(), 0, 0, 0] {
        tile.extend_from_slice(&(number as u32).to_le_bytes());
    }
    tile.extend_from_slice(&table);
    tile.extend_from_slice(glb);
    tile
}

fn tileset(root: Value) -> String {
    json!({"asset": {"version": "1.0"}, "geometricError": 500, "root": root}).to_string()
}

/// The matrix from a plane at 52.01° north, 4.36° east, 12 m above the ellipsoid, to earth-centred coordinates, by columns.
fn on_earth() -> Vec<f64> {
    let (latitude, longitude) = (52.01_f64.to_radians(), 4.36_f64.to_radians());
    let ((s, c), (sl, cl)) = (latitude.sin_cos(), longitude.sin_cos());
    let e2 = 0.006_694_379_990_141_317;
    let n = 6_378_137.0 / (1.0 - e2 * s * s).sqrt();
    let [x, y, z] = [(n + 12.0) * c * cl, (n + 12.0) * c * sl, (n * (1.0 - e2) + 12.0) * s];
    vec![-sl, cl, 0.0, 0.0, -s * cl, -s * sl, c, 0.0, c * cl, c * sl, s, 0.0, x, y, z, 1.0]
}

const AROUND: [f64; 12] = [20.0, 15.0, 3.0, 20.0, 0.0, 0.0, 0.0, 15.0, 0.0, 0.0, 0.0, 3.0];

#[test]
fn tiles_on_the_earth_end_in_a_plane_at_the_right_place() {
    let glb = town().glb(&png());
    let matrix = on_earth();
    let up = dvec3(0.0, 0.0, 12.0);
    let expected: Vec<[DVec3; 3]> = town().corners().iter().map(|t| t.map(|c| c + up)).collect();
    // Coordinates of models relative to a point 100 m east of the origin; the frames of tiles as they are.
    let shift = [-100.0, 0.0, 0.0];
    let (mut json, buffer) = town().gltf("town.bin", &png());
    json = json.replacen(
        "\"scene\":0",
        "\"extensionsUsed\":[\"CESIUM_RTC\"],\"extensions\":{\"CESIUM_RTC\":{\"center\":[100,0,0]}},\"scene\":0",
        1,
    );
    let moved = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, shift[0], shift[1], shift[2], 1]);
    for (case, file, bytes, below) in [
        (0, "a.b3dm", b3dm(&glb, "{\"BATCH_LENGTH\":0}"), Value::Null),
        (1, "a.glb", glb.clone(), Value::Null),
        (2, "a.b3dm", b3dm(&glb, "{\"BATCH_LENGTH\":0,\"RTC_CENTER\":[100,0,0]}"), moved.clone()),
        (3, "a.gltf", json.into_bytes(), moved),
    ] {
        let folder = Folder::new();
        folder.write("city/Data/town.bin", &buffer);
        folder.write(&format!("city/Data/{file}"), bytes);
        let mut child = json!({"boundingVolume": {"box": AROUND}, "geometricError": 0, "content": {"uri": format!("Data/{file}?v=1")}});
        if !below.is_null() {
            child["transform"] = below;
        }
        let root = json!({"transform": matrix, "boundingVolume": {"box": AROUND}, "geometricError": 100, "refine": "REPLACE", "children": [child]});
        let path = folder.write("city/tileset.json", tileset(root));
        for input in [path, folder.path().join("city")] {
            let found = read(&input, &OpenOptions::default()).expect("reads");
            assert_eq!(*found.scene.crs(), Crs::Enu { latitude: 52.01, longitude: 4.36, height: 0.0 });
            assert!(off(&found, &expected) < 2e-4, "case {case}: {}", off(&found, &expected));
            assert!(found.counts.warnings.is_empty(), "case {case}: {:?}", found.counts.warnings);
            let image = load_texture(&found.materials[0], found.scene.reach()).expect("decodes").expect("an image");
            assert_eq!(image.dimensions(), (2, 2));
        }
        // A plane that is given; and what cannot be.
        let plane = Crs::Enu { latitude: 52.01, longitude: 4.36, height: 12.0 };
        let given = OpenOptions { crs: Some(plane.clone()), ..OpenOptions::default() };
        let found = read(&folder.path().join("city"), &given).expect("reads");
        assert!(*found.scene.crs() == plane && off(&found, &town().corners()) < 2e-4);
        let given = OpenOptions { crs: Some(Crs::Epsg(28992)), ..OpenOptions::default() };
        let said = folder.said(&folder.path().join("city"), &given);
        assert!(said.contains("leave --crs out") && said.contains("ENU:52.01,4.36"), "{said}");
        let given = OpenOptions { origin: Some(DVec3::X), ..OpenOptions::default() };
        assert!(folder.said(&folder.path().join("city"), &given).contains("leave --origin out"));
    }
}

#[test]
fn the_finest_tiles_are_read_or_those_that_are_fine_enough() {
    let folder = Folder::new();
    // Each level is the town with so many quads that it is known by their number.
    let level = |quads: usize| {
        let mut town = town();
        town.quads.truncate(quads);
        town.glb(&png())
    };
    for quads in 1..=9 {
        folder.write(&format!("t/{quads}.glb"), level(quads));
    }
    let tile = |quads: usize, error: f64, children: Vec<Value>| json!({"boundingVolume": {"sphere": [20, 15, 3, 30]}, "geometricError": error, "content": {"url": format!("{quads}.glb")}, "children": children});
    let leaf = |quads: usize| tile(quads, 0.0, vec![]);
    let write = |refine: &str| {
        let external = tileset(tile(2, 4.0, vec![leaf(3), leaf(4)]));
        folder.write("t/inner/../more.json", external);
        let inner = json!({"boundingVolume": {"sphere": [20, 15, 3, 30]}, "geometricError": 5, "content": {"uri": "more.json"}});
        let mut root = tile(1, 20.0, vec![inner, tile(5, 2.0, vec![leaf(6)])]);
        root["refine"] = json!(refine);
        folder.write("t/tileset.json", tileset(root))
    };
    let triangles = |path: &std::path::Path, error: f64| {
        read(path, &OpenOptions { error, up: Up::Y, ..OpenOptions::default() }).expect("reads").triangles.len()
    };
    std::fs::create_dir_all(folder.path().join("t/inner")).expect("made");
    let path = write("REPLACE");
    assert_eq!(triangles(&path, 0.0), 2 * (3 + 4 + 6));
    assert_eq!(triangles(&path, 2.0), 2 * (3 + 4 + 5));
    assert_eq!(triangles(&path, 4.0), 2 * (2 + 5));
    assert_eq!(triangles(&path, 20.0), 2);
    let path = write("ADD");
    assert_eq!(triangles(&path, 0.0), 2 * (1 + 3 + 4 + 5 + 6), "the other tileset says for itself how it is refined");
    // A tile that is not there, and a tileset that is broken, cost their places.
    std::fs::remove_file(folder.path().join("t/6.glb")).expect("removed");
    let path = write("REPLACE");
    folder.write("t/more.json", "{");
    let found = read(&path, &OpenOptions { up: Up::Y, error: 0.0, ..OpenOptions::default() });
    assert!(found.is_err(), "nothing is left");
    folder.write("t/6.glb", level(6));
    let found = read(&path, &OpenOptions { up: Up::Y, ..OpenOptions::default() }).expect("reads");
    assert_eq!((found.triangles.len(), found.counts.warnings.count(WarningKind::BrokenFile)), (12, 1));
    assert!(read(&path, &OpenOptions { strict: true, ..OpenOptions::default() }).is_err());
}

#[test]
fn tiles_in_a_frame_of_their_own_take_the_place_that_is_told() {
    let folder = Folder::new();
    folder.write("city/a.b3dm", b3dm(&town().glb(&png()), "{}"));
    let root = json!({"boundingVolume": {"box": AROUND}, "geometricError": 0, "content": {"uri": "a.b3dm"}});
    folder.write("city/tileset.json", tileset(root));
    folder.write(
        "city/metadata.xml",
        "<ModelMetadata><SRS>EPSG:25832</SRS><SRSOrigin>691000,5334000,40</SRSOrigin></ModelMetadata>",
    );
    let found = read(&folder.path().join("city"), &OpenOptions::default()).expect("reads");
    let place = dvec3(691_000.0, 5_334_000.0, 40.0);
    let expected: Vec<[DVec3; 3]> = town().corners().iter().map(|t| t.map(|c| c + place)).collect();
    assert_eq!(*found.scene.crs(), Crs::Epsg(25832));
    assert!(off(&found, &expected) < 1e-4);
}

#[test]
fn tilesets_that_cannot_be_read_say_why() {
    let said = |root: Value| {
        let folder = Folder::new();
        folder.said(&folder.write("tileset.json", tileset(root)), &OpenOptions::default())
    };
    let volume = json!({"box": AROUND});
    let implicit =
        json!({"boundingVolume": volume, "geometricError": 9, "implicitTiling": {"subdivisionScheme": "QUADTREE"}});
    assert!(said(implicit).contains("implicit (in subtree files), which is not read: export it with explicit tiles"));
    let none = json!({"boundingVolume": volume, "geometricError": 9});
    assert_eq!(said(none), "tileset.json: there are no triangles in it");
    let folder = Folder::new();
    let own = json!({"boundingVolume": volume, "geometricError": 9, "content": {"uri": "tileset.json"}});
    let path = folder.write("tileset.json", tileset(own));
    assert!(matches!(Scene::open(&path, &OpenOptions::default()), Err(SceneError::TooMuch { .. })));
    let outside = json!({"boundingVolume": volume, "geometricError": 9, "content": {"uri": "../secret.glb"}});
    folder.write("secret.glb", town().glb(&png()));
    let path = folder.write("root/tileset.json", tileset(outside));
    let reach = gable_files::Reach::within([folder.path().join("root")]).expect("is there");
    let said = folder.said(&path, &OpenOptions { reach, ..OpenOptions::default() });
    assert!(said.contains("lies outside of what may be read here"), "{said}");
    for (mark, name) in [("i3dm", "instances"), ("pnts", "points"), ("cmpt", "several tiles")] {
        let path = folder.write(&format!("{mark}.glb"), format!("{mark}{}", "\0".repeat(60)));
        assert!(folder.said(&path, &OpenOptions::default()).contains(&format!("it is a tile of {name} ({mark})")));
    }
    let tile = b3dm(&town().glb(&png()), "{}");
    let path = folder.write("cut.b3dm", &tile[..tile.len() - 9]);
    assert!(folder.said(&path, &OpenOptions::default()).contains("the file ends too early, 9 bytes before its end"));
}

/// The town's glTF with what `change` makes of its JSON and its buffer.
fn changed(change: impl FnOnce(&mut Value, &mut Vec<u8>)) -> (String, Vec<u8>) {
    let (text, mut buffer) = town().gltf("town.bin", &png());
    let mut json: Value = serde_json::from_str(&text).expect("JSON");
    change(&mut json, &mut buffer);
    json["buffers"][0]["byteLength"] = json!(buffer.len());
    (json.to_string(), buffer)
}

fn add_view(json: &mut Value, buffer: &mut Vec<u8>, bytes: &[u8]) -> usize {
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let views = json["bufferViews"].as_array_mut().expect("views");
    views.push(json!({"buffer": 0, "byteOffset": buffer.len(), "byteLength": bytes.len()}));
    buffer.extend_from_slice(bytes);
    views.len() - 1
}

#[test]
fn quantised_and_sparse_numbers_are_read() {
    // Positions in steps of 1/8 m, as 16 bits; the node scales them back. All of the town's are multiples of it.
    let quantise = |json: &mut Value, buffer: &mut Vec<u8>, normalised: bool| {
        let town = town();
        let steps =
            town.positions.iter().flat_map(|p| [p.x - 7.0, p.z, -p.y].map(|v| (v * 8.0) as i16).into_iter().chain([0]));
        let bytes: Vec<u8> = steps.flat_map(i16::to_le_bytes).collect();
        let view = add_view(json, buffer, &bytes);
        json["bufferViews"][view]["byteStride"] = json!(8);
        let accessor = &mut json["accessors"][0];
        accessor["bufferView"] = json!(view);
        accessor["componentType"] = json!(5122);
        accessor["normalized"] = json!(normalised);
        let scale = if normalised { 32_767.0 / 8.0 } else { 1.0 / 8.0 };
        json["nodes"][0]["scale"] = json!([scale, scale, scale]);
        json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    };
    // The first four vertices are elsewhere, and put right by a sparse accessor.
    let sparse = |json: &mut Value, buffer: &mut Vec<u8>, with_view: bool| {
        let right = buffer[..12 * 12].to_vec();
        let count = if with_view { 4 } else { 12 };
        if with_view {
            buffer[..4 * 12].fill(0);
        } else {
            json["accessors"][0].as_object_mut().expect("an object").remove("bufferView");
        }
        let values = add_view(json, buffer, &right[..count * 12]);
        let numbers: Vec<u8> = (0..count as u16).flat_map(u16::to_le_bytes).collect();
        let indices = add_view(json, buffer, &numbers);
        json["accessors"][0]["sparse"] = json!({
            "count": count,
            "indices": {"bufferView": indices, "componentType": 5123},
            "values": {"bufferView": values},
        });
    };
    let cases = [
        changed(|json, buffer| quantise(json, buffer, false)),
        changed(|json, buffer| quantise(json, buffer, true)),
        changed(|json, buffer| sparse(json, buffer, true)),
        changed(|json, buffer| sparse(json, buffer, false)),
    ];
    for (case, (json, buffer)) in cases.into_iter().enumerate() {
        let folder = Folder::new();
        folder.write("town.bin", buffer);
        let found = read(&folder.write("town.gltf", json), &OpenOptions::default()).expect("reads");
        assert!(off(&found, &town().corners()) < 2e-3, "case {case}: {}", off(&found, &town().corners()));
        assert!(load_texture(&found.materials[0], found.scene.reach()).expect("decodes").is_some());
    }
    // Few bytes that stand for very many zeros, and indices of what is not there.
    let folder = Folder::new();
    for (count, index) in [(200_000_000, 0_u16), (12, 12)] {
        let (json, buffer) = changed(|json, buffer| {
            let values = add_view(json, buffer, &[0; 12]);
            let indices = add_view(json, buffer, &index.to_le_bytes());
            json["accessors"][0].as_object_mut().expect("an object").remove("bufferView");
            json["accessors"][0]["count"] = json!(count);
            json["accessors"][0]["sparse"] = json!({"count": 1, "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}});
        });
        folder.write("town.bin", buffer);
        assert!(read(&folder.write("town.gltf", json), &OpenOptions::default()).is_err(), "{count}");
    }
}

#[test]
fn what_is_compressed_names_what_unpacks_it_and_what_changes_no_shape_is_read() {
    let required = |names: &[&str]| {
        let folder = Folder::new();
        let (json, buffer) = changed(|json, _| {
            json["extensionsUsed"] = json!(names);
            json["extensionsRequired"] = json!(names);
        });
        folder.write("town.bin", buffer);
        let path = folder.write("town.gltf", json);
        read(&path, &OpenOptions::default()).map(|read| read.triangles.len()).map_err(|e| e.to_string())
    };
    for (name, command) in [
        ("KHR_draco_mesh_compression", "gltf-pipeline -i in.glb -o out.glb"),
        ("EXT_meshopt_compression", "gltfpack -noq -i in.glb -o out.glb"),
    ] {
        let said = required(&[name]).expect_err("it is compressed");
        assert!(said.contains(name) && said.contains(command), "{said}");
    }
    let harmless = [
        "KHR_materials_unlit",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "KHR_materials_variants",
        "EXT_mesh_features",
    ];
    assert_eq!(required(&harmless), Ok(18));
    assert!(required(&["EXT_mesh_gpu_instancing"]).is_err());
}

#[test]
fn osgb_and_others_name_a_converter() {
    let folder = Folder::new();
    let path = folder.write("city/Data/Tile_1/Tile_1.osgb", "x");
    for input in [path.clone(), folder.path().join("city")] {
        let said = folder.said(&input, &OpenOptions::default());
        assert!(said.contains("osgconv") && said.contains("3D Tiles or OBJ"), "{said}");
    }
    let said = |name: &str| folder.said(&folder.write(name, "x"), &OpenOptions::default());
    assert!(
        said("a.fbx").contains("Blender")
            && said("a.laz").contains("point cloud")
            && !said("a.dwg").contains("Blender")
    );
}
