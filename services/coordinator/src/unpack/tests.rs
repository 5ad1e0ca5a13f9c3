//! Archives of every kind, good ones and bad ones.

use super::{UnpackError, unpack};
use crate::Limits;
use ::zip::write::SimpleFileOptions;
use ::zip::{CompressionMethod, ZipWriter};
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};

fn file(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().expect("a file");
    file.write_all(bytes).and_then(|()| file.rewind()).expect("written");
    file
}

fn bytes(mut file: File) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).expect("read");
    bytes
}

fn archive(fill: impl FnOnce(&mut ZipWriter<&mut File>)) -> File {
    let mut file = tempfile::tempfile().expect("a file");
    let mut writer = ZipWriter::new(&mut file);
    fill(&mut writer);
    writer.finish().expect("written");
    file.rewind().expect("rewound");
    file
}

fn deflated() -> SimpleFileOptions {
    SimpleFileOptions::default().compression_method(CompressionMethod::Deflated)
}

fn with(entries: &[(&str, &[u8])]) -> File {
    archive(|zip| {
        for (name, content) in entries {
            zip.start_file(*name, deflated()).expect("begun");
            zip.write_all(content).expect("written");
        }
    })
}

fn tar_of(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut tar = ::tar::Builder::new(Vec::new());
    for (name, content) in entries {
        let mut header = ::tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        // The library refuses what is tested here.
        let field = &mut header.as_mut_bytes()[..name.len()];
        field.copy_from_slice(name.as_bytes());
        header.set_cksum();
        tar.append(&header, *content).expect("written");
    }
    tar.into_inner().expect("written")
}

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    out.write_all(bytes).expect("written");
    out.finish().expect("written")
}

/// `City/mesh.obj` with `v 1 2 3`, and `City/empty`, as 7-Zip 16 writes it, with LZMA.
const SEVEN_ZIP: &str = include_str!("tests/city.7z.hex");

fn from_hex(text: &str) -> Vec<u8> {
    let digits: Vec<u8> = text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
    digits
        .chunks(2)
        .map(|two| u8::from_str_radix(std::str::from_utf8(two).expect("text"), 16).expect("digits"))
        .collect()
}

fn unpacked(archive: File) -> (tempfile::TempDir, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut files = unpack(archive, folder.path(), &Limits::default()).expect("unpacked");
    files.sort();
    (folder, files)
}

fn told(archive: File, limits: &Limits) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let inner = folder.path().join("inner");
    let result = unpack(archive, &inner, limits);
    let around: Vec<_> = std::fs::read_dir(folder.path()).expect("read").flatten().map(|e| e.file_name()).collect();
    assert!(around.iter().all(|name| name == "inner"), "{around:?}");
    result.expect_err("it is refused").to_string()
}

#[test]
fn a_folder_of_tiles_is_unpacked_from_every_kind() {
    let names = ["City/Data/Tile_1/Tile 1.obj", "City/metadata.xml"];
    let entries: Vec<(&str, &[u8])> = names.iter().map(|name| (*name, name.as_bytes())).collect();
    let zip = archive(|zip| {
        zip.add_directory("City/Data/", deflated()).expect("a folder");
        for name in names {
            zip.start_file(name, deflated()).expect("begun");
            zip.write_all(name.as_bytes()).expect("written");
        }
    });
    let tar = tar_of(&entries);
    for packed in [
        bytes(zip),
        gzipped(&tar),
        // Two streams one after the other, as pigz and others write them.
        [gzipped(&tar[..512]), gzipped(&tar[512..])].concat(),
        zstd::encode_all(&tar[..], 1).expect("packed"),
        tar,
    ] {
        let (folder, files) = unpacked(file(&packed));
        assert_eq!(files, names);
        for name in &files {
            assert_eq!(std::fs::read(folder.path().join(name)).expect("read"), name.as_bytes());
        }
    }
    let (folder, files) = unpacked(file(&from_hex(SEVEN_ZIP)));
    assert_eq!(files, ["City/empty", "City/mesh.obj"]);
    assert_eq!(std::fs::read(folder.path().join("City/mesh.obj")).expect("read"), b"v 1 2 3\n");
}

/// `mesh.obj` of 8 bytes, packed with Deflate64 by 7-Zip.
#[test]
fn deflate64_is_read() {
    let (folder, files) = unpacked(file(&from_hex(include_str!("tests/deflate64.zip.hex"))));
    assert_eq!(files, ["mesh.obj"]);
    let text = std::fs::read_to_string(folder.path().join("mesh.obj")).expect("read");
    assert!(text.lines().count() == 2000 && text.lines().all(|line| line == "v 1 2 3"));
}

#[test]
fn names_are_read_in_the_encoding_that_they_are_in() {
    // Neither is told to be UTF-8: the first is, as some programs leave it; the second is in code page 437.
    for (written, name) in
        [("Stra\u{df}e_/a.obj".as_bytes(), "Straße_/a.obj"), (b"Stra\xe1e__/a.obj".as_slice(), "Straße__/a.obj")]
    {
        let place = "Straxxe_/a.obj";
        assert_eq!(place.len(), written.len());
        let mut packed = bytes(with(&[(place, b"v")]));
        for at in 0..packed.len() - place.len() {
            if &packed[at..at + place.len()] == place.as_bytes() {
                packed[at..at + place.len()].copy_from_slice(written);
            }
        }
        assert_eq!(unpacked(file(&packed)).1, [name]);
    }
}

#[test]
fn what_nobody_needs_is_passed_over() {
    let mesh: (&str, &[u8]) = ("City/mesh.obj", b"v 1 2 3");
    for odd in [
        "__MACOSX/City/._mesh.obj",
        "City/.DS_Store",
        "City/._mesh.obj",
        "~$list.xlsx",
        "City/Thumbs.db",
        "City/a:b.txt",
        "City/two\nlines.txt",
    ] {
        for packed in [bytes(with(&[(odd, b"x"), mesh])), tar_of(&[mesh, (odd, b"x")])] {
            assert_eq!(unpacked(file(&packed)).1, ["City/mesh.obj"], "{odd}");
        }
    }
    let twice = [("Readme.txt", b"1".as_slice()), ("README.txt", b"2"), mesh];
    assert_eq!(unpacked(with(&twice)).1, ["City/mesh.obj", "Readme.txt"]);
    assert_eq!(unpacked(file(&gzipped(&tar_of(&twice)))).1, ["City/mesh.obj", "Readme.txt"]);
}

#[test]
fn paths_stay_in_their_folder() {
    for bad in ["../evil.obj", "a/../../evil.txt", "/evil", "..\\evil", "C:\\evil.obj"] {
        let entries: [(&str, &[u8]); 2] = [("mesh.obj", b"v 0 0 0"), (bad, b"x")];
        for packed in [bytes(with(&entries)), tar_of(&entries), gzipped(&tar_of(&entries))] {
            let said = told(file(&packed), &Limits::default());
            assert!(said.contains("leads elsewhere"), "{bad}: {said}");
        }
    }
    let said = told(with(&[("a:b.obj", b"v")]), &Limits::default());
    assert!(said.contains("has a colon"), "{said}");
}

#[test]
fn links_and_doubles_are_refused() {
    let link = archive(|zip| zip.add_symlink("mesh.obj", "/etc/passwd", deflated()).expect("a link"));
    assert!(told(link, &Limits::default()).contains("is a link"));
    for kind in [::tar::EntryType::Symlink, ::tar::EntryType::Link, ::tar::EntryType::Char, ::tar::EntryType::Fifo] {
        let mut tar = ::tar::Builder::new(Vec::new());
        let mut header = ::tar::Header::new_gnu();
        header.set_entry_type(kind);
        header.set_size(0);
        header.set_path("mesh.obj").and_then(|()| header.set_link_name("/etc/passwd")).expect("names");
        header.set_cksum();
        tar.append(&header, std::io::empty()).expect("written");
        assert!(told(file(&tar.into_inner().expect("written")), &Limits::default()).contains("is a link"), "{kind:?}");
    }
    let twice: [(&str, &[u8]); 2] = [("mesh.obj", b"1"), ("Mesh.OBJ", b"2")];
    assert!(told(with(&twice), &Limits::default()).contains("is there twice"));
    assert!(told(file(&tar_of(&twice)), &Limits::default()).contains("is there twice"));
    let none = archive(|zip| zip.add_directory("a/", deflated()).expect("a folder"));
    assert!(told(none, &Limits::default()).contains("no file"));
}

#[test]
fn archives_without_a_mesh_say_what_is_in_them() {
    let said = |name: &str| told(with(&[(name, b"x")]), &Limits::default());
    assert!(said("a.jpg").ends_with("but 1 other files, such as \"a.jpg\""), "{}", said("a.jpg"));
    assert!(said("inner.zip").ends_with("another archive, \"inner.zip\": unpack it, and send what is in it"));
    assert!(said("Data/Tile_1.osgb").contains("OSGB, which is not read: export it as OBJ or 3D Tiles"));
}

#[test]
fn bombs_are_refused() {
    let zeros = vec![0; 100 << 20];
    let packed = tar_of(&[("a.obj", &zeros)]);
    for bomb in [
        bytes(with(&[("a.obj", &zeros)])),
        gzipped(&packed),
        zstd::encode_all(&packed[..], 1).expect("packed"),
        gzipped(&tar_of(&[("._a.obj", &zeros)])),
        bytes(with(&[("__MACOSX/a", &zeros)])),
    ] {
        let text = told(file(&bomb), &Limits::default());
        assert!(text.contains("unpacks to more than"), "{text}");
    }
    let half = vec![0; 33 << 20];
    let text = told(with(&[("a", &half), ("b", &half), ("c", &half)]), &Limits::default());
    assert!(text.contains("unpacks to more than"), "{text}");
    let few = Limits { files: 2, ..Limits::default() };
    let three: [(&str, &[u8]); 3] = [("a", b""), ("b", b""), ("c", b"")];
    assert!(told(with(&three), &few).contains("3 entries"));
    assert!(told(file(&tar_of(&three)), &few).contains("3 entries"));
    assert!(told(file(&from_hex(SEVEN_ZIP)), &Limits { files: 1, ..few }).contains("entries"));
    let small = Limits { unpacked: 5, ..Limits::default() };
    assert!(told(with(&[("a", b"123"), ("b", b"456")]), &small).contains("unpacks to more than 0 MB"));
    assert!(told(file(&from_hex(SEVEN_ZIP)), &small).contains("unpacks to more than 0 MB"));

    // An archive that says of its entry that it has one byte.
    let mut lie = with(&[("a", &zeros)]);
    let mut bytes = Vec::new();
    lie.read_to_end(&mut bytes).expect("read");
    let size = (zeros.len() as u32).to_le_bytes();
    for at in 0..bytes.len() - 4 {
        if bytes[at..at + 4] == size {
            bytes[at..at + 4].copy_from_slice(&1_u32.to_le_bytes());
        }
    }
    lie.seek(SeekFrom::Start(0)).and_then(|_| lie.write_all(&bytes)).and_then(|()| lie.rewind()).expect("written");
    assert!(!told(lie, &Limits::default()).is_empty());
}

#[test]
fn what_is_no_archive_is_refused() {
    let mesh: [(&str, &[u8]); 1] = [("mesh.obj", &[7; 1000])];
    let whole = bytes(with(&mesh));
    for cut in [0, 10, whole.len() / 2, whole.len() - 1] {
        assert!(told(file(&whole[..cut]), &Limits::default()).contains("cannot be read"), "cut at {cut}");
    }
    let tar = tar_of(&mesh);
    let packed = gzipped(&tar);
    let seven = from_hex(SEVEN_ZIP);
    for cut in [&tar[..700], &packed[..packed.len() / 2], &seven[..seven.len() - 3], &seven[..20]] {
        assert!(told(file(cut), &Limits::default()).contains("cannot be read"), "{} bytes", cut.len());
    }
    let mut wrong = whole.clone();
    let at = wrong.windows(8).position(|w| w == b"mesh.obj").expect("there") + 9;
    wrong[at] ^= 0xff;
    assert!(told(file(&wrong), &Limits::default()).contains("cannot be read"));
    assert!(matches!(
        unpack(file(b"no archive"), std::path::Path::new("/none"), &Limits::default()),
        Err(UnpackError::Damaged(_))
    ));
}

#[test]
fn other_ways_of_packing_are_named_with_what_to_do() {
    // BZip2, LZMA, Zstandard, PPMd.
    for number in [12_u16, 14, 93, 98] {
        let mut whole = bytes(with(&[("a.obj", b"v 0 0 0")]));
        // The method stands in the header before the entry and in the directory at the end.
        for (signature, at) in [(b"PK\x03\x04", 8), (b"PK\x01\x02", 10)] {
            let header = whole.windows(4).position(|w| w == signature).expect("a header");
            whole[header + at..header + at + 2].copy_from_slice(&number.to_le_bytes());
        }
        let said = told(file(&whole), &Limits::default());
        assert!(said.contains("a.obj is packed as by BZip2") && said.contains("by Deflate"), "{number}: {said}");
    }
}
