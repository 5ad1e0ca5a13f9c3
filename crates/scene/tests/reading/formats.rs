//! The same town comes out of every format.

use crate::town::{Folder, Read, base64, data, png, read, town};
use gable_files::Reach;
use gable_geometry::{Crs, dvec3};
use gable_scene::{GREY, OpenOptions, Scene, SceneError, TextureSource, Up, WarningKind, load_texture};

fn options() -> OpenOptions {
    OpenOptions::default()
}

#[test]
fn obj_with_texture() {
    let (folder, town) = (Folder::new(), town());
    let path = folder.write("town.obj", town.obj());
    folder.write(
        "town.mtl",
        "newmtl other\nKd 1 0.5 0\nnewmtl brick\nKd 1 1 1\nmap_Kd -clamp on -s 1 1 1 tex\\a b.png\n",
    );
    folder.write("tex/a b.png", png());
    let Read { triangles, counts, materials, .. } = read(&path, &options()).expect("reads");
    assert_eq!(triangles.iter().map(|t| t.corners).collect::<Vec<_>>(), town.corners());
    assert!(triangles.iter().all(|t| t.material == 1 && t.colours.is_none()));
    assert_eq!(triangles[0].uv.expect("textured"), [0, 1, 5].map(|i| town.uvs[i]));
    assert_eq!(materials[0].colour, [255, 128, 0]);
    let image = load_texture(&materials[1], &Reach::everything()).expect("decodes").expect("has a texture");
    assert_eq!((image.dimensions(), image.get_pixel(1, 0).0), ((2, 2), [0, 255, 0]));
    assert_eq!((counts.files, counts.vertices, counts.faces, counts.triangles), (1, 12, 9, 18));
    assert_eq!((counts.min, counts.max), ([0.0, 0.0, 0.25], [40.0, 30.0, 6.125]));
    assert!(counts.warnings.is_empty());
}

#[test]
fn ply_of_every_encoding_and_off() {
    let (folder, town) = (Folder::new(), town());
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let path = folder.write(&format!("{format}.ply"), town.ply(format));
        let Read { triangles, counts, .. } = read(&path, &options()).expect("reads");
        assert_eq!(triangles.iter().map(|t| t.corners).collect::<Vec<_>>(), town.corners(), "{format}");
        assert_eq!(triangles[0].colours, Some([0, 1, 5].map(|i| town.colours[i])), "{format}");
        assert_eq!(triangles[0].uv, Some([0, 1, 5].map(|i| town.uvs[i])), "{format}");
        assert!(counts.warnings.is_empty());
    }
    let path = folder.write("town.off", town.off());
    let Read { triangles, .. } = read(&path, &options()).expect("reads");
    assert_eq!(triangles.iter().map(|t| t.corners).collect::<Vec<_>>(), town.corners());
    assert_eq!(triangles[0].colours, Some([0, 1, 5].map(|i| town.colours[i])));
}

#[test]
fn ply_with_texture_at_the_corners_of_faces() {
    let folder = Folder::new();
    folder.write("a.png", png());
    let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile no.png\nelement vertex 4\n\
                property float x\nproperty float y\nproperty float z\nproperty float red\nproperty float green\n\
                property float blue\nelement face 2\nproperty list uchar uint vertex_index\n\
                property list uchar float texcoord\nproperty int texnumber\nelement edge 1\nproperty int a\nend_header\n\
                0 0 0 1 0.5 0\n9 0 0 1 0.5 0\n9 9 0 1 0.5 0\n0 9 0 1 0.5 0\n\
                3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 1 1 0 1 1\n7\n";
    let path = folder.write("t.ply", text);
    let Read { triangles, counts, materials, .. } = read(&path, &options()).expect("reads");
    assert_eq!(triangles[1].uv, Some([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]));
    assert_eq!((triangles[0].material, triangles[1].material), (0, 1));
    assert_eq!(triangles[0].colours, Some([[255, 128, 0]; 3]));
    assert_eq!(materials[0].texture, Some(TextureSource::File(folder.path().join("a.png"))));
    assert_eq!((&materials[1].texture, materials[1].colour), (&None, GREY));
    assert_eq!(counts.warnings.count(WarningKind::MissingTexture), 1);
}

#[test]
fn glb_and_gltf_are_turned_to_z_up() {
    let (folder, town) = (Folder::new(), town());
    let glb = folder.write("town.glb", town.glb(&png()));
    let (json, buffer) = town.gltf("numbers%20here.bin", &png());
    let split = folder.write("town.gltf", json);
    folder.write("numbers here.bin", &buffer);
    let (json, _) = town.gltf(&format!("data:application/octet-stream;base64,{}", base64(&buffer)), &png());
    let inside = folder.write("inside.gltf", json);
    for path in [glb, split, inside] {
        let Read { triangles, counts, materials, .. } = read(&path, &options()).expect("reads");
        assert_eq!(triangles.iter().map(|t| t.corners).collect::<Vec<_>>(), town.corners(), "{}", path.display());
        for (got, expected) in triangles[0].uv.expect("textured").iter().zip([0, 1, 5].map(|i| town.uvs[i])) {
            assert!((got[0] - expected[0]).abs() < 1e-6 && (got[1] - expected[1]).abs() < 1e-6);
        }
        assert_eq!(materials[0].name, "brick");
        assert_eq!(materials[0].texture, Some(TextureSource::Embedded { file: path.clone(), image: 0 }));
        let image = load_texture(&materials[0], &Reach::everything()).expect("decodes").expect("has a texture");
        assert_eq!(image.get_pixel(0, 1).0, [0, 0, 255]);
        assert!(counts.warnings.is_empty(), "{:?}", counts.warnings);
    }
}

#[test]
fn a_folder_of_tiles_with_metadata() {
    let (folder, town) = (Folder::new(), town());
    folder.write(
        "metadata.xml",
        "<ModelMetadata version=\"1\"><SRS>EPSG:25832</SRS><SRSOrigin>476000,5553000,100</SRSOrigin></ModelMetadata>",
    );
    for tile in ["Tile_+001_+000", "Tile_+000_+001", "Tile_+000_+000"] {
        folder.write(&format!("Data/{tile}/{tile}.obj"), town.obj().replace("town.mtl", &format!("{tile}.mtl")));
        folder.write(&format!("Data/{tile}/{tile}.mtl"), "newmtl brick\nKd 0 0 1\n");
    }
    folder.write("Data/Tile_+000_+000/extra.ply", town.ply("ascii"));
    let single = folder.path().join("Data/Tile_+001_+000/Tile_+001_+000.obj");
    let Read { scene, triangles, counts, .. } = read(folder.path(), &options()).expect("reads");
    let names: Vec<_> = scene.files().iter().map(|f| f.file_stem().expect("named").to_owned()).collect();
    assert_eq!(names, ["Tile_+000_+000", "Tile_+000_+001", "Tile_+001_+000"]);
    assert_eq!(scene.crs(), &Crs::Epsg(25832));
    assert_eq!((triangles[20].material, triangles.len(), counts.files), (1, 54, 3));
    assert_eq!(triangles[18].corners[0], town.positions[0] + dvec3(476_000.0, 5_553_000.0, 100.0));
    assert_eq!(counts.warnings.count(WarningKind::IgnoredFile), 1);
    // The metadata is found for one of the tiles too.
    let Read { scene, triangles: alone, .. } =
        read(&single, &OpenOptions { crs: Some(Crs::Epsg(7415)), ..options() }).expect("reads");
    assert_eq!((scene.crs(), alone[0].corners), (&Crs::Epsg(7415), triangles[36].corners));
}

#[test]
fn y_up_is_accepted_when_it_is_said() {
    let (folder, town) = (Folder::new(), town());
    let mut text = String::new();
    for p in &town.positions {
        text += &format!("v {} {} {}\n", p.x, p.z, -p.y);
    }
    for q in &town.quads {
        text += &format!("f {} {} {} {}\n", q[0] as i64 - 12, q[1] as i64 - 12, q[2] as i64 - 12, q[3] as i64 - 12);
    }
    let path = folder.write("side.obj", text);
    assert!(matches!(read(&path, &options()), Err(SceneError::OnItsSide { .. })));
    let Read { triangles, .. } = read(&path, &OpenOptions { up: Up::Y, ..options() }).expect("reads");
    assert_eq!(triangles.iter().map(|t| t.corners).collect::<Vec<_>>(), town.corners());
    assert!(read(&path, &OpenOptions { up: Up::Z, ..options() }).is_ok());
}

#[test]
fn what_can_go_on_goes_on_and_is_counted() {
    let folder = Folder::new();
    folder.write("m.mtl", "newmtl t\nmap_Kd no.jpg\nnewmtl u\nmap_Kd a.png\nnewmtl w\nmap_Kd w.ktx2\n");
    folder.write("a.png", png());
    folder.write("w.ktx2", "\u{ab}KTX 20");
    let text = "mtllib m.mtl\nmtllib absent.mtl\nv 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nusemtl t\nf 1 2 3\nusemtl nobody\n\
                f 1 3 4\nusemtl u\nf 1 2 4\nf 1 2 2\nf 1 2\nl 1 2\ncurv 1 2\nf 2 3 4\n";
    let path = folder.write("m.obj", text);
    let Read { triangles, counts, materials, .. } = read(&path, &options()).expect("reads");
    assert_eq!(triangles.iter().map(|t| t.material).collect::<Vec<_>>(), [0, u32::MAX, 1, 1]);
    assert_eq!((&materials[0].texture, materials[0].colour), (&None, GREY));
    let count = |kind| counts.warnings.count(kind);
    assert_eq!(count(WarningKind::MissingMaterialLibrary), 1);
    assert_eq!(count(WarningKind::MissingTexture), 2);
    assert_eq!(count(WarningKind::UnknownMaterial), 1);
    assert_eq!(count(WarningKind::MissingTextureCoordinates), 2);
    assert_eq!(count(WarningKind::DegenerateFace), 2);
    assert_eq!(count(WarningKind::IgnoredStatement), 2);
    let place = |kind| {
        let warning = counts.warnings.entries().iter().find(|w| w.kind == kind).expect("is there");
        warning.examples[0].rsplit('/').next().unwrap_or_default().to_owned()
    };
    assert_eq!(place(WarningKind::DegenerateFace), "m.obj: line 13");
    assert_eq!(place(WarningKind::MissingTexture), "no.jpg: no such file or folder");
    assert!(place(WarningKind::MissingMaterialLibrary).starts_with("absent.mtl: no such file"));
}

#[test]
fn libraries_are_read_where_the_file_names_them() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl one\nKd 1 0 0\nnewmtl two\nKd 0 1 0\n");
    folder.write("b.mtl", "newmtl two\nKd 0 0 1\nnewmtl three\nKd 0 0 1\n");
    let corners = "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\n";
    let text = format!(
        "{corners}usemtl one\nf 1 2 3\nmtllib a.mtl\nf 1 3 4\nusemtl three\nmtllib b.mtl\nmtllib a.mtl\nf 1 2 4\n\
         usemtl two\nf 2 3 4\n"
    );
    let path = folder.write("m.obj", text);
    let Read { triangles, counts, materials, .. } = read(&path, &options()).expect("reads");
    // Too late for the first face; the first definition of a name counts, and a library that is named again is the same.
    assert_eq!(triangles.iter().map(|t| t.material).collect::<Vec<_>>(), [u32::MAX, 0, 3, 1]);
    assert_eq!(materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["one", "two", "two", "three"]);
    assert_eq!(counts.warnings.count(WarningKind::UnknownMaterial), 1);
}

#[test]
fn a_visitor_may_stop_the_stream() {
    #[derive(Debug)]
    enum Stop {
        Enough,
        Bad,
    }
    impl From<SceneError> for Stop {
        fn from(_: SceneError) -> Self {
            Self::Bad
        }
    }
    let folder = Folder::new();
    let path = folder.write("town.obj", town().obj());
    let scene = Scene::open(&path, &options()).expect("opens");
    let result = scene.for_each_chunk(|_| Err(Stop::Enough));
    assert!(matches!(result, Err(Stop::Enough)));
    let bad = folder.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    let scene = Scene::open(&bad, &options()).expect("opens");
    assert!(matches!(scene.for_each_chunk(|_| Err(Stop::Enough)), Err(Stop::Bad)));
}

#[test]
fn real_meshes() {
    let Some(data) = data() else { return };
    let summary = |name: &str| {
        let Read { scene, triangles, counts, materials } = read(&data.join(name), &options()).expect("reads");
        assert_eq!(counts.triangles as usize, triangles.len());
        let extent = [0, 1, 2].map(|i| (counts.max[i] - counts.min[i]).round());
        (scene.files().len(), counts.faces, extent, materials.len())
    };
    assert_eq!(summary("frankfurt/mesh.obj"), (1, 49_427, [1033.0, 941.0, 158.0], 1));
    assert_eq!(summary("dayanta"), (63, 65_337, [336.0, 451.0, 85.0], 63));
    assert_eq!(summary("block/block.off"), (1, 47_030, [101.0, 117.0, 19.0], 0));
}
