//! What each kind of bad input says.

use crate::town::{Folder, png, town};
use gable_files::Reach;
use gable_geometry::Crs;
use gable_scene::{Material, OpenOptions, Scene, TextureSource, load_texture};

fn said(name: &str, bytes: impl AsRef<[u8]>) -> String {
    let folder = Folder::new();
    let path = folder.write(name, bytes);
    folder.said(&path, &OpenOptions::default())
}

/// What strict reading says, which puts up with nothing that is broken.
fn strictly(name: &str, bytes: impl AsRef<[u8]>) -> String {
    let folder = Folder::new();
    let path = folder.write(name, bytes);
    folder.said(&path, &OpenOptions { strict: true, ..OpenOptions::default() })
}

#[test]
fn missing_and_foreign_files() {
    let folder = Folder::new();
    assert_eq!(folder.said(&folder.path().join("no.obj"), &OpenOptions::default()), "no.obj: no such file or folder");
    assert_eq!(
        said("city.fbx", "x"),
        "city.fbx: file type \".fbx\" is not read: give an .obj, .ply, .off, .glb or .gltf file, a tileset.json, or a folder of them: import it in Blender, and export it as OBJ or glTF"
    );
    assert_eq!(
        folder.said(folder.path(), &OpenOptions::default()),
        ".: no .obj, .ply, .off, .glb or .gltf file and no tileset.json in this folder or the folders in it"
    );
}

#[test]
fn wrong_magic() {
    assert_eq!(
        said("a.obj", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"),
        "a.obj: is not an OBJ text file (ASCII, UTF-8): it starts with \"\u{fffd}PNG\\r\\n\\u{1a}\\n\\0\\0\\0\\rIHDR\""
    );
    // Zero bytes at the end of a file are passed over; the others tell enough.
    assert!(said("a.obj", b"PK\x03\x04\0\0").starts_with("a.obj: is not an OBJ text file (ASCII, UTF-8): "));
    assert!(said("a.obj", b"\xff\xfev\0 \0").starts_with("a.obj: is not an OBJ text file (ASCII, UTF-8): "));
    assert_eq!(said("a.ply", "solid x\n"), "a.ply: is not a PLY file (ply): it starts with \"solid x\\n\"");
    assert_eq!(
        said("a.off", "three 4 5\n"),
        "a.off: is not an OFF file (OFF, COFF, NOFF, STOFF): it starts with \"three\""
    );
    assert_eq!(said("a.glb", "JFIF...."), "a.glb: is not a GLB or glTF file: it starts with \"JFIF....\"");
    assert_eq!(
        said("a.glb", b"glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0"),
        "a.glb: it is glTF of version 1: convert it to version 2"
    );
    assert!(said("a.gltf", "{\"asset\":3}").starts_with("a.gltf: this is not a glTF 2.0 scene that can be read: "));
}

#[test]
fn truncated_files() {
    let again = "is it a complete copy?";
    assert_eq!(
        said("a.obj", "v 0 0 0\nv 9 0 0\nv 9 9"),
        format!("a.obj: line 3: the file ends too early, a vertex without z: {again}")
    );
    let square = "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nf 1 2 3\n";
    let cut = |last: &str| said("a.obj", format!("{square}{last}"));
    let face = |what: &str| format!("a.obj: line 6: the file ends too early, {what}: {again}");
    assert_eq!(cut("f 3"), face("within a face"));
    assert_eq!(cut("f 3 4"), face("within a face"));
    assert_eq!(cut("f"), face("within a statement"));
    let (town, png) = (town(), png());
    let binary = town.ply("binary_little_endian");
    let short = &binary[..binary.len() - 3];
    assert_eq!(
        said("a.ply", short),
        format!(
            "a.ply: byte {}: the file ends too early, where a vertex of a face is expected: {again}",
            binary.len() - 4
        )
    );
    let ascii = String::from_utf8(town.ply("ascii")).expect("text");
    let lines = ascii.lines().count();
    let cut = ascii.trim_end().rsplit_once(' ').expect("has blanks").0;
    assert_eq!(
        said("a.ply", cut),
        format!("a.ply: line {lines}: the file ends too early, where a vertex of a face is expected: {again}")
    );
    assert_eq!(
        said("a.ply", "ply\nformat ascii 1.0\nelement ver"),
        format!("a.ply: line 3: the file ends too early, within the header: {again}")
    );
    assert_eq!(
        said("a.off", "OFF\n3 1 0\n0 0 0\n9 0 0\n9 9 0\n"),
        format!("a.off: line 6: the file ends too early, where the number of a face's corners is expected: {again}")
    );
    let glb = town.glb(&png);
    assert_eq!(
        said("a.glb", &glb[..glb.len() - 10]),
        format!("a.glb: byte {}: the file ends too early, 10 bytes before its end: {again}", glb.len() - 10)
    );
    let folder = Folder::new();
    let (json, buffer) = town.gltf("town.bin", &png);
    let path = folder.write("town.gltf", json);
    folder.write("town.bin", &buffer[..100]);
    let text = folder.said(&path, &OpenOptions::default());
    assert!(text.starts_with("town.bin: byte 100: the file ends too early, where bytes "), "{text}");
}

#[test]
fn indices_out_of_range() {
    let vertices = "v 0 0 0\nv 9 0 0\nv 9 9 0\nvt 0 0\n";
    let face = |face: &str| strictly("a.obj", format!("{vertices}{face}\n"));
    assert_eq!(face("f 1 2 4"), "a.obj: line 5: a face names vertex 4, but there are 3");
    assert_eq!(face("f 1 2 0"), "a.obj: line 5: a face names vertex 0, but there are 3");
    assert_eq!(face("f 1 2 -4"), "a.obj: line 5: a face names vertex -4, but there are 3");
    assert_eq!(face("f 1/1 2/1 3/2"), "a.obj: line 5: a face names texture coordinate 2, but there are 1");
    assert_eq!(face("f 1/1 2/1 3/0"), "a.obj: line 5: a face names texture coordinate 0, but there are 1");
    let head = "OFF\n3 1 0\n0 0 0\n9 0 0\n9 9 0\n";
    assert_eq!(strictly("a.off", format!("{head}3 0 1 3\n")), "a.off: line 6: a face names vertex 3, but there are 3");
    let town = town();
    let text = String::from_utf8(town.ply("ascii")).expect("text");
    let lines = text.lines().count();
    let wrong = text.trim_end().rsplit_once(' ').expect("has blanks").0.to_owned() + " -1\n";
    assert_eq!(strictly("a.ply", wrong), format!("a.ply: line {lines}: a face names vertex -1, but there are 12"));
    let (json, mut buffer) = town.gltf("town.bin", &[]);
    let folder = Folder::new();
    let path = folder.write(
        "town.gltf",
        json.replace(
            "\"images\":[{\"bufferView\":3,\"mimeType\":\"image/png\"}],",
            "\"images\":[{\"uri\":\"no.png\"}],",
        ),
    );
    buffer[12 * 20] = 99;
    folder.write("town.bin", &buffer);
    let text = folder.said(&path, &OpenOptions { strict: true, ..OpenOptions::default() });
    assert_eq!(text, "town.gltf: byte 240: a face names vertex 99, but there are 12");
}

#[test]
fn coordinates_that_are_no_numbers() {
    assert_eq!(
        strictly("a.obj", "v 0 0 0\nv 9 NaN 0\n"),
        "a.obj: line 2: a coordinate is \"NaN\": coordinates must be finite numbers"
    );
    assert_eq!(
        strictly("a.obj", "v 0 0 1e999\n"),
        "a.obj: line 1: a coordinate is \"1e999\": coordinates must be finite numbers"
    );
    assert_eq!(
        strictly("a.off", "OFF\n3 1 0\n0 0 0\n9 inf 0\n"),
        "a.off: line 4: a coordinate is inf: coordinates must be finite numbers"
    );
    let head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    assert_eq!(
        strictly("a.ply", format!("{head}0 nan 0\n")),
        "a.ply: line 10: a coordinate is NaN: coordinates must be finite numbers"
    );
    let binary = head.replace("ascii", "binary_little_endian");
    let mut bytes = binary.clone().into_bytes();
    [0.0, 0.0, f32::INFINITY].iter().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
    let place = binary.len();
    assert_eq!(
        strictly("a.ply", bytes),
        format!("a.ply: byte {place}: a coordinate is inf: coordinates must be finite numbers")
    );
    let mut glb = town().glb(&png());
    let at = glb.windows(4).position(|w| w == b"BIN\0").expect("has a chunk") + 4;
    glb[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let text = strictly("a.glb", glb);
    assert!(text.starts_with("a.glb: byte 0: a coordinate is (NaN, "), "{text}");
}

#[test]
fn statements_that_make_no_sense() {
    assert_eq!(
        said("a.obj", "v 0 0 0\n\nf 1 2/x 3\n"),
        "a.obj: line 3: \"2/x\" is no corner of a face: write v, v/vt or v/vt/vn"
    );
    assert_eq!(said("a.off", "OFF\nx\n"), "a.off: line 2: \"x\" stands where the number of vertices is expected");
    let header = |line: &str| said("a.ply", format!("ply\nformat ascii 1.0\n{line}\nend_header\n"));
    assert_eq!(header("propeller 3"), "a.ply: line 3: \"propeller 3\" does not belong in a PLY header");
    assert_eq!(header("property float x"), "a.ply: line 3: \"property float x\" is no property");
    assert_eq!(header("element face -2"), "a.ply: line 3: \"-2\" is no number of elements");
    assert_eq!(
        header("element tristrips 1\nproperty list int int vertex_indices").lines().last(),
        Some("a.ply: line 6: the file ends too early, where the length of a list is expected: is it a complete copy?")
    );
    let faces_first = "element face 1\nproperty list uchar int vertex_indices\nelement vertex 0\nproperty float x";
    assert_eq!(
        header(faces_first),
        "a.ply: the faces stand before the vertices, which is not read: write the vertices first"
    );
    assert_eq!(header("element vertex 0\nproperty float x"), "a.ply: its vertices have no x, y and z");
}

#[test]
fn no_triangles() {
    assert_eq!(said("a.obj", ""), "a.obj: there are no triangles in it");
    assert_eq!(said("a.obj", "v 0 0 0\nv 1 1 1\nf 1 2 1\n"), "a.obj: there are no triangles in it");
    assert_eq!(said("a.off", "OFF 0 0 0"), "a.off: there are no triangles in it");
}

/// A grid of n × n cells with hills, in OBJ, by a function of the lattice.
fn sheet(n: usize, place: impl Fn(f64, f64, f64) -> [f64; 3]) -> String {
    let mut text = String::new();
    for j in 0..=n {
        for i in 0..=n {
            let (x, y) = (i as f64 * 5.0, j as f64 * 5.0);
            let [x, y, z] = place(x, y, 3.0 * (x / 20.0).sin() * (y / 30.0).cos());
            text += &format!("v {x} {y} {z}\n");
        }
    }
    for j in 0..n {
        for i in 1..=n {
            let a = j * (n + 1) + i;
            text += &format!("f {} {} {} {}\n", a, a + 1, a + n + 2, a + n + 1);
        }
    }
    text
}

#[test]
fn models_that_are_no_city_in_metres() {
    assert_eq!(
        said("side.obj", sheet(20, |x, y, z| [x, z, -y])),
        "side.obj: the model seems to be y up, not z up: 10000 m² of it face along the side and 397 m² along z, and it measures \
         100 × 6 × 100 m: pass --up=y to turn it, or --up z if it is z up"
    );
    let down = said("down.obj", sheet(20, |x, y, z| [x, -z, y]));
    assert!(down.contains("seems to be -y up, not z up") && down.contains("pass --up=-y to turn it"), "{down}");
    let head = |x: f64, y: f64, z: f64| {
        [x, -y, -0.2 * z - if x > 20.0 && x < 30.0 && y > 20.0 && y < 30.0 { 9.0 } else { 0.0 }]
    };
    assert_eq!(
        said("head.obj", sheet(20, head)),
        "head.obj: the model seems to stand on its head: its faces look down, and most of it lies high: pass --up=-z to turn it, \
         or --up z if it is right"
    );
    assert_eq!(
        said("small.obj", sheet(20, |x, y, z| [x / 1e3, y / 1e3, z / 1e3])),
        "small.obj: the model measures 0.100000 × 0.100000 in plan: a city measures more than a metre: \
         are the units kilometres, or is it scaled?"
    );
    assert_eq!(
        said("large.obj", sheet(20, |x, y, z| [x * 1e5, y * 1e5, z])),
        "large.obj: the model measures 10000000.000000 × 10000000.000000 in plan: a city measures less than \
         1000 km: are the units millimetres, or are there stray vertices?"
    );
    assert_eq!(
        said("degrees.obj", sheet(20, |x, y, z| [8.6 + x / 1e5, 50.1 + y / 1e5, z + 100.0])),
        "degrees.obj: the model measures 0.001000 × 0.001000 in plan: these look like degrees: \
         give coordinates in a projected system, in metres"
    );
    let far = said("earth.obj", sheet(20, |x, y, z| [x + 4.0e6, y + 6.0e5, z + 4.9e6]));
    assert!(far.ends_with("these look like earth-centred coordinates: give them in a projected or local system, z up"));
}

#[test]
fn reference_systems() {
    let folder = Folder::new();
    let path = folder.write("town.obj", town().obj());
    folder.write("metadata.xml", "<ModelMetadata><SRS>LOCAL_CS[&quot;x&quot;]</SRS></ModelMetadata>");
    assert_eq!(
        folder.said(&path, &OpenOptions::default()),
        "metadata.xml: unknown reference system \"x\": pass --crs EPSG:code \
         (or ENU:latitude,longitude) to say which it is"
    );
    let options = OpenOptions { crs: Some(Crs::Epsg(25832)), ..OpenOptions::default() };
    assert!(Scene::open(&path, &options).is_ok());
    folder.write("metadata.xml", "<ModelMetadata><SRSOrigin>1,2</SRSOrigin></ModelMetadata>");
    assert_eq!(
        folder.said(&path, &options),
        "metadata.xml: the metadata cannot be understood: SRSOrigin is \"1,2\": three numbers x,y,z are expected"
    );
}

#[test]
fn textures() {
    let folder = Folder::new();
    let load = |name: &str| {
        let texture = Some(TextureSource::File(folder.path().join(name)));
        let error = load_texture(&Material { texture, ..Material::default() }, &Reach::everything())
            .expect_err("cannot be decoded");
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    assert_eq!(load("no.png"), "no.png: the texture cannot be used: no such file or folder");
    let image = png();
    folder.write("cut.png", &image[..image.len() / 2]);
    assert!(load("cut.png").starts_with("cut.png: the texture cannot be used: "));
    folder.write("a.bmp", "BM");
    assert_eq!(
        load("a.bmp"),
        "a.bmp: the texture cannot be used: it is no JPEG, PNG, TIFF, BMP, TGA, WebP or JPEG 2000 image: it starts with \"BM\""
    );
    assert_eq!(load_texture(&Material::default(), &Reach::everything()).expect("nothing to do"), None);
}
