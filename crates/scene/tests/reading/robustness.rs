//! No bytes make a reader panic, hang or fill the memory.

use crate::town::{Folder, Read, png, read, town};
use gable_files::Reach;
use gable_scene::{OpenOptions, load_texture};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Reads a file of the given bytes; whatever comes of it must be a result.
fn survive(folder: &Folder, name: &str, bytes: &[u8]) {
    let path = folder.write(name, bytes);
    if let Ok(Read { triangles, counts, materials, .. }) = read(&path, &OpenOptions::default()) {
        assert_eq!(triangles.len() as u64, counts.triangles);
        assert!(triangles.iter().flat_map(|t| t.corners).all(|c| c.is_finite()));
        for material in &materials {
            let _ = load_texture(material, &Reach::everything());
        }
    }
}

fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let (town, png) = (town(), png());
    let (json, buffer) = town.gltf("", &png);
    let data = format!("data:;base64,{}", crate::town::base64(&buffer));
    vec![
        ("a.obj", town.obj().into_bytes()),
        ("a.off", town.off().into_bytes()),
        ("ascii.ply", town.ply("ascii")),
        ("little.ply", town.ply("binary_little_endian")),
        ("big.ply", town.ply("binary_big_endian")),
        ("a.glb", town.glb(&png)),
        ("a.gltf", json.replace("\"byteLength\"", &format!("\"uri\":\"{data}\",\"byteLength\"")).into_bytes()),
        ("inside.gltf", town.gltf(&data, &png).0.into_bytes()),
    ]
}

/// A change of some bytes: what a bad disk, a bad transfer or a careless edit does.
#[derive(Clone, Debug)]
enum Change {
    Set(prop::sample::Index, u8),
    Cut(prop::sample::Index),
    Remove(prop::sample::Index, usize),
    Insert(prop::sample::Index, Vec<u8>),
    Double(prop::sample::Index, usize),
}

fn change() -> impl Strategy<Value = Change> {
    let at = || any::<prop::sample::Index>();
    let text = prop_oneof![
        Just(b"-1".to_vec()),
        Just(b"99999999999999999999".to_vec()),
        Just(b"nan ".to_vec()),
        Just(b"1e308".to_vec()),
        Just(b"\\\n".to_vec()),
        Just(b"\n".to_vec()),
        Just(b"4294967295".to_vec()),
        Just(b"/".to_vec()),
        proptest::collection::vec(any::<u8>(), 1..9),
    ];
    prop_oneof![
        4 => (at(), any::<u8>()).prop_map(|(at, byte)| Change::Set(at, byte)),
        1 => at().prop_map(Change::Cut),
        2 => (at(), 1usize..40).prop_map(|(at, n)| Change::Remove(at, n)),
        4 => (at(), text).prop_map(|(at, text)| Change::Insert(at, text)),
        1 => (at(), 1usize..60).prop_map(|(at, n)| Change::Double(at, n)),
    ]
}

fn apply(bytes: &mut Vec<u8>, change: &Change) {
    if bytes.is_empty() {
        return;
    }
    let length = bytes.len();
    match change {
        Change::Set(at, byte) => bytes[at.index(length)] = *byte,
        Change::Cut(at) => bytes.truncate(at.index(length)),
        Change::Remove(at, n) => {
            let at = at.index(length);
            bytes.drain(at..(at + n).min(length));
        }
        Change::Insert(at, text) => {
            let at = at.index(length);
            bytes.splice(at..at, text.iter().copied());
        }
        Change::Double(at, n) => {
            let at = at.index(length);
            let part = bytes[at..(at + n).min(length)].to_vec();
            bytes.splice(at..at, part);
        }
    }
}

proptest! {
    // The same bytes each time.
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(18), ..ProptestConfig::with_cases(400) })]
    #[test]
    fn changed_files(changes in proptest::collection::vec(change(), 1..4)) {
        let folder = Folder::new();
        for (name, mut bytes) in samples() {
            changes.iter().for_each(|change| apply(&mut bytes, change));
            survive(&folder, name, &bytes);
        }
    }

    #[test]
    fn random_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..300), header in 0usize..8) {
        let folder = Folder::new();
        for (name, sample) in samples() {
            // With and without the start of a good file in front.
            let cut = sample.len() * header / 8;
            survive(&folder, name, &[&sample[..cut], &bytes].concat());
        }
    }
}

#[test]
fn counts_that_promise_too_much() {
    let folder = Folder::new();
    let huge = "99999999999";
    survive(&folder, "a.off", format!("OFF\n{huge} {huge} 0\n0 0 0\n").as_bytes());
    for format in ["ascii", "binary_little_endian"] {
        let header = format!(
            "ply\nformat {format} 1.0\nelement nothing {huge}\nelement vertex {huge}\nproperty float x\nproperty float y\n\
             property float z\nelement face {huge}\nproperty list uint int vertex_indices\nend_header\n"
        );
        survive(&folder, "a.ply", header.as_bytes());
    }
    let (json, buffer) = town().gltf("a.bin", &png());
    folder.write("a.bin", &buffer);
    for key in ["\"count\":", "\"byteLength\":", "\"byteOffset\":"] {
        survive(&folder, "a.gltf", json.replace(key, &format!("{key}9")).as_bytes());
        survive(&folder, "a.gltf", json.replace(key, &format!("{key}99999999999999")).as_bytes());
    }
    survive(&folder, "a.gltf", json.replace("\"children\":[0]", "\"children\":[1]").as_bytes());
    survive(&folder, "a.gltf", json.replace("\"children\":[0]", "\"children\":[0,0]").as_bytes());
}
