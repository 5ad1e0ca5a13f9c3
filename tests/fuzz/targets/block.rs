//! Block files: as they are, and with a checksum that fits whatever is in them.
#![no_main]

use gable_blocks::{MAGIC, VERSION, read_block, write_block};
use gable_fuzz::Folder;
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::default);

/// A block file of so many triangles with this body.
fn sealed(triangles: u64, raw: &[u8]) -> Vec<u8> {
    let body = zstd::bulk::compress(raw, 1).expect("memory");
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    for number in [triangles, raw.len() as u64, body.len() as u64] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    let mut hash = blake3::Hasher::new();
    hash.update(&bytes).update(&body);
    bytes.extend_from_slice(hash.finalize().as_bytes());
    bytes.extend_from_slice(&body);
    bytes
}

fuzz_target!(|data: &[u8]| {
    let _ = read_block(&FOLDER.write("plain.block", data));
    let Some((count, body)) = data.split_first_chunk::<4>() else { return };
    let path = FOLDER.write("sealed.block", &sealed(u32::from_le_bytes(*count).into(), body));
    if let Ok(mesh) = read_block(&path) {
        write_block(&path, &mesh).expect("it is written again");
        // Bits, for a coordinate of a texture may be no number.
        let again = read_block(&path).expect("it is read again");
        assert_eq!(format!("{again:?}"), format!("{mesh:?}"));
    }
});
