//! Where meshes lie, by the files that programs write beside them.

use crate::town::{Folder, Read, read, town};
use gable_geometry::{Crs, DVec3, dvec3};
use gable_scene::{OpenOptions, Up, WarningKind};

const FAR: DVec3 = dvec3(691_000.0, 5_334_000.0, 0.0);
const UTM: Crs = Crs::Epsg(32632);

/// Reads an input; gives its system and what was added to each mesh, in the order of the paths.
fn places(folder: &Folder, input: &str, options: &OpenOptions) -> (Crs, Vec<DVec3>) {
    let Read { scene, triangles, .. } =
        read(&folder.path().join(input), options).unwrap_or_else(|e| panic!("{input}: {e}"));
    let town = town();
    let each = triangles.chunks_exact(town.corners().len());
    (scene.crs().clone(), each.map(|of| of[0].corners[0] - town.positions[0]).collect())
}

fn auto() -> OpenOptions {
    OpenOptions { up: Up::Z, ..OpenOptions::default() }
}

fn at(folder: &Folder, input: &str) -> (Crs, Vec<DVec3>) {
    places(folder, input, &auto())
}

fn metadata(x: f64) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<ModelMetadata version=\"1\"><SRS>EPSG:32632</SRS><SRSOrigin>{x},5334000,0</SRSOrigin></ModelMetadata>\n"
    )
}

#[test]
fn metadata_is_found_wherever_it_lies() {
    for (mesh, file) in [
        ("in/Data/Tile_1/t.obj", "in/metadata.xml"),
        ("in/Production_1/Data/Tile_1/t.obj", "in/Production_1/metadata.xml"),
        ("in/Data/Tile_1/t.obj", "in/Data/metadata.xml"),
        ("in/BlockA/t.obj", "in/BlockA/metadata.xml"),
        ("in/Data/Tile_1/t.obj", "in/Metadata.XML"),
        ("in/t.obj", "in/METADATA.xml"),
        ("in/t.obj", "metadata.xml"),
        // Beside the way from the mesh up.
        ("in/Production_1/Data/t.obj", "in/Production_1/Meta/metadata.xml"),
    ] {
        let folder = Folder::new();
        folder.write(mesh, town().obj());
        folder.write(file, metadata(691_000.0));
        assert_eq!(at(&folder, "in"), (UTM, vec![FAR]), "{mesh} {file}");
    }
}

#[test]
fn each_production_has_its_own() {
    let folder = Folder::new();
    for (name, x) in [("P1", 691_000.0), ("P2", 692_000.0)] {
        folder.write(&format!("in/{name}/Data/Tile_1/t.obj"), town().obj());
        folder.write(&format!("in/{name}/metadata.xml"), metadata(x));
    }
    assert_eq!(at(&folder, "in"), (UTM, vec![FAR, FAR + dvec3(1000.0, 0.0, 0.0)]));
    // Two systems are no plane.
    folder.write("in/P2/metadata.xml", metadata(0.0).replace("32632", "32633"));
    let said = folder.said(&folder.path().join("in"), &auto());
    assert!(said.contains("EPSG:32633 is said here, but EPSG:32632 in") && said.contains("--crs"), "{said}");
    let given = OpenOptions { crs: Some(UTM), ..auto() };
    assert_eq!(places(&folder, "in", &given).1.len(), 2);
}

#[test]
fn metadata_in_every_encoding() {
    let text = "<?xml version=\"1.0\" encoding=\"CODE\"?><ModelMetadata><!--Größe--><SRS> urn:ogc:def:crs:EPSG::32632 </SRS><SRSOrigin>691000; 5334000; 0</SRSOrigin></ModelMetadata>";
    let utf16: Vec<u8> = "\u{feff}"
        .encode_utf16()
        .chain(text.replace("CODE", "UTF-16").encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    let latin: Vec<u8> = text.replace("CODE", "ISO-8859-1").chars().map(|c| c as u8).collect();
    let mut gbk = text.replace("CODE", "GBK").replace("Größe", "@").into_bytes();
    let mark = gbk.iter().position(|b| *b == b'@').expect("there");
    gbk.splice(mark..=mark, [0xb2, 0xe2]);
    for bytes in [text.replace("CODE", "utf-8").into_bytes(), utf16, latin, gbk] {
        let folder = Folder::new();
        folder.write("t.obj", town().obj());
        folder.write("metadata.xml", bytes);
        assert_eq!(at(&folder, "t.obj"), (UTM, vec![FAR]));
    }
}

#[test]
fn opendronemap_and_pix4d() {
    let folder = Folder::new();
    folder.write("odm/odm_texturing/odm_textured_model_geo.obj", town().obj());
    folder.write("odm/odm_georeferencing/coords.txt", "WGS84 UTM 32N\n691000 5334000\n1.0 2.0 3.0\n");
    for input in ["odm", "odm/odm_texturing", "odm/odm_texturing/odm_textured_model_geo.obj"] {
        assert_eq!(at(&folder, input), (UTM, vec![FAR]), "{input}");
    }
    // A system that the first line does not tell stands in proj.txt.
    folder.write("odm/odm_georeferencing/coords.txt", "a site\n691000.0 5334000.0\n");
    folder.write("odm/odm_georeferencing/proj.txt", "+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs\n");
    assert_eq!(at(&folder, "odm"), (UTM, vec![FAR]));

    let prj = "PROJCS[\"WGS 84 / UTM zone 32N\",GEOGCS[\"WGS 84\",DATUM[\"World Geodetic System 1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],\
               PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"central_meridian\",9],UNIT[\"metre\",1]]";
    folder.write("pix/city_simplified_3d_mesh.obj", town().obj());
    folder.write("pix/city_offset.xyz", "691000.000 5334000.000 0.000\n");
    folder.write("pix/city_wkt.prj", prj);
    assert_eq!(at(&folder, "pix/city_simplified_3d_mesh.obj"), (UTM, vec![FAR]));
    folder.write("p4d/2_densification/3d_mesh/city_simplified_3d_mesh.obj", town().obj());
    folder.write("p4d/1_initial/params/city_offset.xyz", "691000.000 5334000.000 0.000\n");
    folder.write("p4d/1_initial/params/city_wkt.prj", prj);
    assert_eq!(at(&folder, "p4d/2_densification/3d_mesh/city_simplified_3d_mesh.obj"), (UTM, vec![FAR]));
}

#[test]
fn a_prj_beside_any_mesh() {
    for (name, bytes) in
        [("t.obj", town().obj().into_bytes()), ("t.ply", town().ply("ascii")), ("t.off", town().off().into_bytes())]
    {
        let folder = Folder::new();
        folder.write(name, bytes);
        folder.write("t.prj", "EPSG:25832");
        folder.write("other.prj", "EPSG:4326");
        assert_eq!(at(&folder, name), (Crs::Epsg(25832), vec![DVec3::ZERO]), "{name}");
        folder.write("t.prj", "GEOGCS[\"WGS 84\",AUTHORITY[\"EPSG\",\"4326\"]]");
        let said = folder.said(&folder.path().join(name), &auto());
        assert!(said.contains("t.prj") && said.contains("is in degrees"), "{said}");
    }
}

#[test]
fn an_origin_that_is_given_holds() {
    let folder = Folder::new();
    folder.write("in/t.obj", town().obj());
    folder.write("in/metadata.xml", metadata(1.0));
    let options = OpenOptions { origin: Some(FAR), ..auto() };
    assert_eq!(places(&folder, "in", &options), (UTM, vec![FAR]));
}

#[test]
fn what_is_found_and_not_used_is_said() {
    let folder = Folder::new();
    folder.write("in/a/t.obj", town().obj());
    folder.write("in/a/metadata.xml", metadata(691_000.0));
    folder.write("in/b/metadata.xml", metadata(1.0));
    let Read { counts, scene, .. } = read(&folder.path().join("in"), &auto()).expect("reads");
    assert_eq!(counts.warnings.count(WarningKind::UnusedGeoreference), 1);
    let named =
        &counts.warnings.entries().iter().find(|w| w.kind == WarningKind::UnusedGeoreference).expect("there").examples
            [0];
    assert!(named.ends_with("b/metadata.xml"), "{named}");
    assert_eq!(scene.described_by(), [folder.path().join("in/a/metadata.xml")]);
    // OpenDroneMap's model in a frame of its own.
    let folder = Folder::new();
    folder.write("odm_texturing/odm_textured_model.obj", town().obj());
    folder.write("odm_georeferencing/coords.txt", "WGS84 UTM 32N\n691000 5334000\n");
    let Read { counts, scene, .. } = read(folder.path(), &auto()).expect("reads");
    assert_eq!((scene.crs(), counts.warnings.count(WarningKind::UnusedGeoreference)), (&Crs::Unknown, 1));
}

#[test]
fn feet_become_metres() {
    let folder = Folder::new();
    let path = folder.write("t.obj", town().obj());
    let foot = 0.304_800_609_601_219_24;
    let options = OpenOptions { crs: Some(Crs::Epsg(2263)), origin: Some(dvec3(980_000.0, 190_000.0, 0.0)), ..auto() };
    let Read { scene, counts, .. } = read(&path, &options).expect("reads");
    assert_eq!((scene.crs(), counts.warnings.count(WarningKind::ScaledUnits)), (&Crs::Epsg(32118), 1));
    assert_eq!(counts.min, (dvec3(980_000.0, 190_000.0, 0.25) * foot).to_array());
    assert_eq!(counts.max, (dvec3(980_040.0, 190_030.0, 6.125) * foot).to_array());
    for (code, why) in
        [(4326, "is in degrees"), (4978, "is earth-centred"), (5773, "heights alone"), (9122, "is no reference system")]
    {
        let said = folder.said(&path, &OpenOptions { crs: Some(Crs::Epsg(code)), ..auto() });
        assert!(said.contains(why), "{said}");
    }
}

#[test]
fn rounded_coordinates_are_said() {
    let wide = |format: &dyn Fn(f64) -> String| {
        let mut text = String::new();
        for i in 0..20 {
            for j in 0..20 {
                let (x, y) = (691_000.3 + f64::from(i) * 2.17, 5_334_000.7 + f64::from(j) * 11.39);
                text += &format!("v {} {} {}\n", format(x), format(y), format(40.0 + f64::from(i * j) * 0.013));
            }
        }
        for i in 0..19 {
            for j in 1..20 {
                text += &format!("f {} {} {} {}\n", i * 20 + j, i * 20 + j + 20, i * 20 + j + 21, i * 20 + j + 1);
            }
        }
        let folder = Folder::new();
        let path = folder.write("t.obj", text);
        let Read { counts, .. } = read(&path, &auto()).expect("reads");
        counts.warnings.count(WarningKind::CoarseCoordinates)
    };
    assert_eq!(wide(&|v| format!("{v:.4}")), 0);
    assert_eq!(wide(&|v| format!("{:.4}", v as f32)), 2);
    assert_eq!(wide(&|v| format!("{v:.5e}")), 2);
}
