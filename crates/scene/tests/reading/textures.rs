//! Textures of every type that is read, wherever they lie, and libraries that are named otherwise or not at all.

use crate::town::{Folder, Read, png, read, town};
use gable_scene::{OpenOptions, WarningKind, load_texture};
use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use std::io::Cursor;

/// 4 × 4 pixels of which each is another.
fn picture() -> RgbImage {
    RgbImage::from_fn(4, 4, |x, y| Rgb([200, 60 * x as u8, 30 * y as u8]))
}

fn encoded(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::ImageRgb8(picture()).write_to(&mut bytes, format).expect("memory");
    bytes.into_inner()
}

/// The picture in JPEG 2000, without loss, as OpenJPEG 2.5 writes it.
const JP2: &str = "AAAADGpQICANCocKAAAAFGZ0eXBqcDIgAAAAAGpwMiAAAAAtanAyaAAAABZpaGRyAAAABAAAAAQAAwcHAAAAAAAPY29scgEAAAAAABAAAACyanAyY/9P/1EAL\
wAAAAAABAAAAAQAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAAAAAwcBAQcBAQcBAf9SAAwAAAABAAAEBAAB/1wABEBA/2QAJQABQ3JlYXRlZCBieSBPcGVuSlBFRyB2ZXJzaW9uIDIuNS40/5AACgAAAAAAOgAB/5PPtC\
QUAFFcCEGBagjfgGARYjW2OfK5qpkWOr/fgHASgRdN+1HxRTvOX3R4v//Z";

fn decoded(base64: &str) -> Vec<u8> {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bits = 0u32;
    let mut held = 0;
    let mut out = Vec::new();
    for letter in base64.bytes().filter(|b| *b != b'=') {
        bits = bits << 6 | LETTERS.iter().position(|l| *l == letter).expect("base 64") as u32;
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    out
}

#[test]
fn images_of_every_type_are_decoded() {
    let jp2 = decoded(JP2);
    let stream = jp2.windows(4).position(|w| w == b"\xff\x4f\xff\x51").expect("a stream");
    let folder = Folder::new();
    for (name, bytes) in [
        ("a.png", encoded(ImageFormat::Png)),
        ("a.tif", encoded(ImageFormat::Tiff)),
        ("a.bmp", encoded(ImageFormat::Bmp)),
        ("a.tga", encoded(ImageFormat::Tga)),
        ("a.webp", encoded(ImageFormat::WebP)),
        ("a.j2k", jp2[stream..].to_vec()),
        ("a.jp2", jp2),
        // The ending does not count.
        ("b.jpg", encoded(ImageFormat::Bmp)),
    ] {
        folder.write(name, &bytes);
        folder.write("town.mtl", format!("newmtl brick\nmap_Kd {name}\n"));
        let obj = read(&folder.write("town.obj", town().obj()), &OpenOptions::default()).expect("reads");
        assert!(obj.counts.warnings.is_empty(), "{name}: {:?}", obj.counts.warnings);
        let image = load_texture(&obj.materials[0], obj.scene.reach()).expect(name).expect(name);
        assert_eq!(image, picture(), "{name}");
        // The same in a PLY file and inside of a glTF file.
        let text = String::from_utf8(town().ply("ascii")).expect("text");
        let text = text.replace("comment made here", &format!("comment texturefile {name}"));
        let ply = read(&folder.write("town.ply", text), &OpenOptions::default()).expect("reads");
        assert_eq!(load_texture(&ply.materials[0], ply.scene.reach()).expect(name).expect(name), picture(), "{name}");
        let glb = read(&folder.write("town.glb", town().glb(&bytes)), &OpenOptions::default()).expect("reads");
        assert_eq!(load_texture(&glb.materials[0], glb.scene.reach()).expect(name).expect(name), picture(), "{name}");
    }
}

#[test]
fn images_that_are_not_read_are_grey_and_named() {
    let folder = Folder::new();
    let mut wide = decoded(JP2);
    let size = wide.windows(4).rposition(|w| w == [0, 0, 0, 4]).expect("a size");
    wide[size..size + 4].copy_from_slice(&[0, 0, 0xff, 0xff]);
    for (name, bytes, said) in [
        (
            "a.ktx2",
            b"\xabKTX 20\xbb\r\n\x1a\n".to_vec(),
            "it is a KTX2 image, which is not read: convert it to JPEG or PNG",
        ),
        ("a.dds", b"DDS |\0\0\0".to_vec(), "it is a DDS image, which is not read: convert it to JPEG or PNG"),
        (
            "a.txt",
            b"hello".to_vec(),
            "it is no JPEG, PNG, TIFF, BMP, TGA, WebP or JPEG 2000 image: it starts with \"hello\"",
        ),
    ] {
        folder.write(name, bytes);
        folder.write("town.mtl", format!("newmtl brick\nmap_Kd {name}\n"));
        let Read { counts, materials, .. } =
            read(&folder.write("town.obj", town().obj()), &OpenOptions::default()).expect("reads");
        assert!(materials[0].texture.is_none() && counts.warnings.count(WarningKind::MissingTexture) == 1, "{name}");
        assert!(counts.warnings.entries()[0].examples[0].ends_with(said), "{:?}", counts.warnings);
    }
    // Broken ones of the new types are errors, not panics.
    for format in [ImageFormat::Tiff, ImageFormat::Bmp, ImageFormat::Tga, ImageFormat::WebP] {
        let bytes = encoded(format);
        let cut = gable_scene::decode_image(std::path::Path::new("cut"), &bytes[..bytes.len().min(40)]);
        assert!(cut.is_err(), "{format:?}");
    }
    let jp2 = decoded(JP2);
    assert!(gable_scene::decode_image(std::path::Path::new("cut"), &jp2[..60]).is_err());
}

/// What stands in the library; where the image lies; whether it is said that it lies elsewhere.
const PLACES: [(&str, &str, bool); 12] = [
    ("map_Kd ROOF.png", "roof.PNG", false),
    ("map_Kd Maps/Roof.png", "maps/roof.png", false),
    ("map_Kd maps\\roof.png", "Maps/roof.png", false),
    ("map_Kd C:\\Users\\me\\city\\roof.png", "roof.png", true),
    ("map_Kd /home/me/city/maps/roof.png", "maps/roof.png", true),
    ("map_Kd roof.png", "maps/roof.png", true),
    ("map_Kd maps/roof.png", "roof.png", true),
    ("map_Ka roof.png", "roof.png", false),
    ("map_Ke roof.png", "roof.png", false),
    ("MAP_KD -s 1 1 1 roof.png", "roof.png", false),
    ("map_Ka none.png\nmap_Kd roof.png", "roof.png", false),
    ("map_Kd \"roof.png\"", "roof.png", false),
];

#[test]
fn textures_are_found_where_they_lie() {
    for (statement, place, elsewhere) in PLACES {
        let folder = Folder::new();
        folder.write(&format!("mesh/{place}"), png());
        folder.write("mesh/town.mtl", format!("newmtl brick\n{statement}\n"));
        let path = folder.write("mesh/town.obj", town().obj());
        let reach = gable_files::Reach::within([folder.path().join("mesh")]).expect("is there");
        let Read { counts, materials, .. } =
            read(&path, &OpenOptions { reach, ..OpenOptions::default() }).expect("reads");
        let texture = materials[0].texture.as_ref().expect(statement);
        assert_eq!(texture.file(), folder.path().join("mesh").join(place), "{statement}");
        assert_eq!(counts.warnings.count(WarningKind::FoundElsewhere), u64::from(elsewhere), "{statement}");
    }
    // Of the diffuse and the ambient texture the diffuse one counts, whatever the order.
    for text in ["map_Kd roof.png\nmap_Ka wall.png", "map_Ka wall.png\nmap_Kd roof.png"] {
        let folder = Folder::new();
        ["roof.png", "wall.png"].iter().for_each(|name| drop(folder.write(name, png())));
        folder.write("town.mtl", format!("newmtl brick\n{text}\n"));
        let Read { materials, .. } =
            read(&folder.write("town.obj", town().obj()), &OpenOptions::default()).expect("reads");
        assert!(materials[0].texture.as_ref().is_some_and(|t| t.file().ends_with("roof.png")), "{text}");
    }
}

#[test]
fn libraries_are_found_where_they_lie() {
    let obj = town().obj();
    let said = |statement: &str| obj.replace("mtllib town.mtl\n", statement);
    let faces = obj.find("f 1/1").expect("faces");
    let late = format!("{}mtllib town.mtl\n{}", said("")[..faces - 16].to_owned(), &obj[faces..]);
    // Text of the mesh; where its library lies; how often it is said that it lies elsewhere.
    let cases = [
        (obj.clone(), "Town.MTL", 0),
        (said("mtllib C:\\work\\town.mtl\n"), "town.mtl", 1),
        (said("mtllib \"./town.mtl\"\n"), "town.mtl", 0),
        (said("mtllib sub/town.mtl\n"), "town.mtl", 1),
        (said("MTLLIB town.mtl\n"), "town.mtl", 0),
        // The mesh is called a.obj.
        (said(""), "a.mtl", 1),
        (said(""), "A.mtl", 1),
        (said("mtllib lost.mtl\n"), "a.mtl", 1),
        (late, "town.mtl", 0),
    ];
    for (at, (text, place, elsewhere)) in cases.into_iter().enumerate() {
        let folder = Folder::new();
        folder.write("roof.png", png());
        folder.write(place, "NEWMTL brick\nmap_Kd roof.png\n");
        let Read { triangles, counts, materials, .. } =
            read(&folder.write("a.obj", text), &OpenOptions::default()).expect("reads");
        assert!(triangles.iter().all(|t| t.material == 0), "case {at}");
        assert!(materials[0].texture.is_some(), "case {at}");
        assert_eq!(counts.warnings.count(WarningKind::FoundElsewhere), elsewhere, "case {at}");
        assert_eq!(counts.warnings.count(WarningKind::MissingMaterialLibrary), 0, "case {at}");
    }
    // One of the file's name is taken for a file that names none, not for one whose library defines all.
    let folder = Folder::new();
    folder.write("town.mtl", "newmtl brick\nKd 1 0 0\n");
    folder.write("a.mtl", "newmtl brick\nKd 0 1 0\n");
    let Read { materials, .. } = read(&folder.write("a.obj", obj), &OpenOptions::default()).expect("reads");
    assert_eq!(materials.iter().map(|m| m.colour).collect::<Vec<_>>(), [[255, 0, 0]]);
}

#[test]
fn images_of_gltf_in_another_letter_case() {
    let folder = Folder::new();
    let (json, buffer) = town().gltf("a.bin", &[]);
    folder.write("a.bin", buffer);
    folder.write("Textures/Roof.PNG", png());
    for uri in ["textures/roof.png", "Textures/Roof.PNG", "roof.png"] {
        let json = json.replace(r#""bufferView":3,"mimeType":"image/png""#, &format!(r#""uri":"{uri}""#));
        let Read { materials, scene, .. } =
            read(&folder.write("a.gltf", json), &OpenOptions::default()).expect("reads");
        assert!(load_texture(&materials[0], scene.reach()).expect(uri).is_some(), "{uri}");
    }
}
