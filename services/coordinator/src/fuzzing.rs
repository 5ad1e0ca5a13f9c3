//! What fuzzers reach besides the crate's own surface: `tests/fuzz`.

use crate::Limits;
use std::fs::File;
use std::io::{Seek as _, Write as _};
use std::path::Path;

/// Unpacks bytes that may be an archive into a folder; gives whether they are one that is taken.
///
/// # Panics
/// If no temporary file can be written.
pub fn unpack(archive: &[u8], folder: &Path) -> bool {
    // In memory where the folder is.
    let beside = folder.parent().unwrap_or(folder);
    let mut file: File = tempfile::tempfile_in(beside).expect("a temporary file");
    file.write_all(archive).and_then(|()| file.rewind()).expect("a temporary file");
    crate::unpack::unpack(file, folder, &Limits { unpacked: 16 << 20, files: 1000, ..Limits::default() }).is_ok()
}
