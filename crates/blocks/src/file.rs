//! The block file: one block's triangles, compressed and checked.

use crate::codec;
use crate::error::BlocksError;
use crate::triangle::BlockMesh;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

/// First bytes: a high byte and line ends, as PNG has them, show transfers that took it for text.
pub const MAGIC: [u8; 8] = *b"\x89GBLK\r\n\x1a";
/// Version of the format that is written and read.
pub const VERSION: u32 = 1;

/// Bytes before the body.
const HEADER: usize = 8 + 4 + 8 + 8 + 8 + 32;
/// zstd level: 3 is its default, and halves the time of 6 for a few percent.
const LEVEL: i32 = 3;

/// Writes a block file; returns its length in bytes.
///
/// The file appears under its name when it is complete, or not at all. It is not forced to the disk: what a
/// power cut leaves of it fails its checksum, and it can be made again.
///
/// # Errors
/// [`BlocksError::Write`] if the file cannot be written.
pub fn write_block(path: &Path, mesh: &BlockMesh) -> Result<u64, BlocksError> {
    let fault = |e| BlocksError::write(path, e);
    let bytes = encode_block(mesh).map_err(fault)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(fault)?;
    file.write_all(&bytes).map_err(fault)?;
    file.persist(path).map_err(|e| fault(e.error))?;
    Ok(bytes.len() as u64)
}

fn encode_block(mesh: &BlockMesh) -> std::io::Result<Vec<u8>> {
    let mut raw = Vec::new();
    codec::encode(&mesh.triangles, &mut raw);
    let body = zstd::bulk::compress(&raw, LEVEL)?;
    let mut bytes = Vec::with_capacity(HEADER + body.len());
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    for number in [mesh.triangles.len() as u64, raw.len() as u64, body.len() as u64] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    let mut hash = blake3::Hasher::new();
    hash.update(&bytes).update(&body);
    bytes.extend_from_slice(hash.finalize().as_bytes());
    bytes.extend_from_slice(&body);
    Ok(bytes)
}

/// Reads a block file.
///
/// # Errors
/// If it cannot be read, is no block file of this version, is cut short, or its bytes are not those
/// that were written.
pub fn read_block(path: &Path) -> Result<BlockMesh, BlocksError> {
    let mut bytes = Vec::new();
    File::open(path).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(|e| BlocksError::read(path, e))?;
    decode_block(path, &bytes)
}

fn decode_block(path: &Path, bytes: &[u8]) -> Result<BlockMesh, BlocksError> {
    let truncated =
        |expected: u64| BlocksError::Truncated { path: path.to_owned(), expected, found: bytes.len() as u64 };
    let corrupt = |what| BlocksError::Corrupt { path: path.to_owned(), what };
    if bytes.len() < MAGIC.len() && MAGIC.starts_with(bytes) {
        return Err(truncated(HEADER as u64));
    }
    let Some(rest) = bytes.strip_prefix(&MAGIC) else {
        let start: String = bytes.iter().take(8).map(|b| b.escape_ascii().to_string()).collect();
        return Err(BlocksError::WrongMagic { path: path.to_owned(), found: format!("\"{start}\"") });
    };
    let Some((header, body)) = rest.split_at_checked(HEADER - MAGIC.len()) else {
        return Err(truncated(HEADER as u64));
    };
    let number = |at: usize| {
        let mut eight = [0; 8];
        eight.copy_from_slice(&header[at..at + 8]);
        u64::from_le_bytes(eight)
    };
    let version = u32::from_le_bytes([header[0], header[1], header[2], header[3]]);
    if version != VERSION {
        return Err(BlocksError::WrongVersion { path: path.to_owned(), found: version, expected: VERSION });
    }
    let (triangles, raw_length, body_length) = (number(4), number(12), number(20));
    let expected = body_length.saturating_add(HEADER as u64);
    if (body.len() as u64) < body_length {
        return Err(truncated(expected));
    }
    if body.len() as u64 > body_length {
        return Err(corrupt("bytes follow its end"));
    }
    let checked = bytes.len() - body.len() - 32;
    let mut hash = blake3::Hasher::new();
    hash.update(&bytes[..checked]).update(body);
    if hash.finalize().as_bytes().as_slice() != &bytes[checked..checked + 32] {
        return Err(corrupt("its checksum does not fit"));
    }
    let raw = expand(body, raw_length).map_err(corrupt)?;
    let mut rest = raw.as_slice();
    let triangles = codec::decode(&mut rest, triangles).map_err(corrupt)?;
    if rest.is_empty() { Ok(BlockMesh { triangles }) } else { Err(corrupt("its body is too long")) }
}

/// Decompresses, never to more than was announced.
pub(crate) fn expand(body: &[u8], length: u64) -> Result<Vec<u8>, codec::Fault> {
    let decoder = zstd::stream::read::Decoder::with_buffer(body).map_err(|_| "its body cannot be decompressed")?;
    // A length that is not true must not fill the memory before that is found out.
    let likely = usize::try_from(length.min(body.len() as u64 * 64)).unwrap_or(0);
    let mut raw = Vec::with_capacity(likely);
    let read = decoder.take(length.saturating_add(1)).read_to_end(&mut raw);
    read.map_err(|_| "its body cannot be decompressed")?;
    if raw.len() as u64 == length { Ok(raw) } else { Err("its body has another length than announced") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn said(bytes: &[u8]) -> String {
        decode_block(Path::new("3_4.block"), bytes).expect_err("must be refused").to_string()
    }

    fn sample() -> BlockMesh {
        let triangle = |i: i32| crate::BlockTriangle {
            corners: [[i * 900, 0, 5], [i * 900 + 900, 0, 9], [i * 900, 800, 1]],
            ..Default::default()
        };
        BlockMesh { triangles: (0..100).map(triangle).collect() }
    }

    #[test]
    fn says_what_is_wrong_with_a_file() {
        let bytes = encode_block(&sample()).expect("memory");
        assert_eq!(
            said(b"PK\x03\x04 something"),
            "3_4.block: is not a block file: it starts with \"PK\\x03\\x04 som\""
        );
        assert!(said(&bytes[..40]).contains("ends at byte 40, but 68 bytes were written"));
        let cut = said(&bytes[..bytes.len() - 7]);
        let (found, all) = (bytes.len() - 7, bytes.len());
        assert_eq!(
            cut,
            format!("3_4.block: ends at byte {found}, but {all} bytes were written: split the scene again")
        );
        let mut other = bytes.clone();
        other[8] = 9;
        assert_eq!(
            said(&other),
            "3_4.block: is a block file of version 9, but version 1 is read: split the scene again"
        );
        let mut longer = bytes.clone();
        longer.push(0);
        assert_eq!(said(&longer), "3_4.block: is damaged, bytes follow its end: split the scene again");
        let mut flipped = bytes;
        flipped[all - 20] ^= 4;
        assert_eq!(said(&flipped), "3_4.block: is damaged, its checksum does not fit: split the scene again");
    }

    #[test]
    fn writes_whole_files_only() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("0_0.block");
        let length = write_block(&path, &sample()).expect("writes");
        assert_eq!(std::fs::metadata(&path).expect("is there").len(), length);
        assert_eq!(read_block(&path).expect("reads"), sample());
        let names: Vec<_> = std::fs::read_dir(folder.path()).expect("reads").collect();
        assert_eq!(names.len(), 1, "no temporary file is left");
        let missing = read_block(&folder.path().join("9_9.block")).expect_err("is not there").to_string();
        assert!(missing.contains("9_9.block: cannot be read: "), "{missing}");
        let nowhere = write_block(&folder.path().join("no/0_0.block"), &sample()).expect_err("no folder").to_string();
        assert!(nowhere.contains("0_0.block: cannot be written: "), "{nowhere}");
    }

    proptest! {
        #[test]
        fn blocks_come_back_and_damage_is_seen(
            triangles in crate::codec::tests::triangles(),
            at in any::<prop::sample::Index>(),
            bit in 0u32..8,
        ) {
            let mesh = BlockMesh { triangles };
            let mut bytes = encode_block(&mesh).expect("memory");
            let path = Path::new("x.block");
            let back = decode_block(path, &bytes).ok();
            prop_assert_eq!(back.as_ref(), Some(&mesh));
            let at = at.index(bytes.len());
            prop_assert!(decode_block(path, &bytes[..at]).is_err());
            bytes[at] ^= 1 << bit;
            prop_assert!(decode_block(path, &bytes).is_err());
        }
    }
}
