//! Maps of a block: as they are, and with checksums that fit whatever is in them.
#![no_main]

use gable_fuzz::{Folder, parts};
use gable_ortho::Orthograph;
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::default);

/// Bytes of the header after mark and version: step, column, row, columns, rows.
const WINDOW: usize = 32;

fn adler(bytes: &[u8]) -> u32 {
    let (mut a, mut b) = (1_u32, 0_u32);
    for byte in bytes {
        a = (a + u32::from(*byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    b << 16 | a
}

/// A file with this window and these sections.
fn sealed(window: &[u8], sections: &[&[u8]]) -> Vec<u8> {
    let mut bytes = b"GABLORTH\x01\0\0\0".to_vec();
    bytes.extend_from_slice(window);
    bytes.extend_from_slice(&adler(&bytes).to_le_bytes());
    for raw in sections {
        let packed = zstd::bulk::compress(raw, 1).expect("memory");
        bytes.extend_from_slice(&(packed.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&packed);
    }
    bytes
}

fuzz_target!(|data: &[u8]| {
    let _ = Orthograph::read(&FOLDER.write("plain.map", data));
    let Some((window, rest)) = data.split_at_checked(WINDOW) else { return };
    let path = FOLDER.write("sealed.map", &sealed(window, &parts::<5>(rest)));
    if let Ok(map) = Orthograph::read(&path) {
        map.write(&path).expect("it is written again");
        let _ = map.coverage();
    }
});
