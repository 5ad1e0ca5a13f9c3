//! Unpacks an archive that a user has sent, and refuses what would harm: paths that lead elsewhere, links, archives that
//! unpack to far more than they are, and more files than a mesh has.
//!
//! What nobody needs of an archive (notes of file managers, lock files) is passed over, and so is an entry with an odd name that no mesh
//! names.

mod entry;
mod sevenz;
mod tar;
mod zip;

use crate::Limits;
use entry::Intake;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _};
use std::path::{Path, PathBuf};

/// Ends of names that archives bear.
pub(crate) const ARCHIVES: [&str; 7] = ["zip", "7z", "tar", "tar.gz", "tgz", "tar.zst", "tzst"];

/// Why an archive is refused.
#[derive(Debug, thiserror::Error)]
pub(crate) enum UnpackError {
    /// It is no archive, or damaged.
    #[error("the archive cannot be read: {0}")]
    Damaged(String),
    /// An entry that no mesh has.
    #[error("entry {0:?} of the archive {1}")]
    Entry(String, &'static str),
    /// More files than an upload may have.
    #[error("the archive has {0} entries, more than the {1} of an upload")]
    Entries(usize, usize),
    /// It unpacks to more than it may.
    #[error("the archive unpacks to more than {0} MB")]
    Size(u64),
    /// No file.
    #[error("the archive has no file")]
    Empty,
    /// No mesh.
    #[error("the archive has no mesh (.obj, .ply, .off, .glb, .gltf), but {0}")]
    NoMesh(String),
    /// The local disk.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl UnpackError {
    fn damaged(error: &dyn std::fmt::Display) -> Self {
        Self::Damaged(error.to_string())
    }
}

/// Text of a mesh shrinks to a tenth at best: what grows by more than this, beyond some room for small archives, is made to harm.
const RATIO: u64 = 200;
const ROOM: u64 = 64 << 20;

/// Unpacks into a folder; gives the paths of the files within it, parts joined by `/`. The kind of archive is known by its first bytes.
pub(crate) fn unpack(mut archive: File, folder: &Path, limits: &Limits) -> Result<Vec<String>, UnpackError> {
    let wrong = |source| UnpackError::File { path: folder.to_owned(), source };
    let packed = archive.metadata().map_err(wrong)?.len();
    let most = limits.unpacked.min(packed.saturating_mul(RATIO).saturating_add(ROOM));
    let mut start = Vec::new();
    archive.by_ref().take(300).read_to_end(&mut start).map_err(wrong)?;
    archive.rewind().map_err(wrong)?;
    let mut intake = Intake::new(folder, most, limits.files);
    let reader = BufReader::with_capacity(1 << 16, archive);
    if start.starts_with(b"7z\xbc\xaf\x27\x1c") {
        sevenz::unpack(reader, &mut intake)?;
    } else if start.starts_with(b"\x1f\x8b") {
        tar::unpack(flate2::read::MultiGzDecoder::new(reader), &mut intake)?;
    } else if start.starts_with(b"\x28\xb5\x2f\xfd") {
        let decoder = zstd::Decoder::with_buffer(reader).and_then(|mut decoder| {
            // A frame may ask for more memory than this.
            decoder.window_log_max(27)?;
            Ok(decoder)
        });
        tar::unpack(decoder.map_err(|e| UnpackError::damaged(&e))?, &mut intake)?;
    } else if start.get(257..262) == Some(b"ustar") {
        tar::unpack(reader, &mut intake)?;
    } else {
        zip::unpack(reader, &mut intake)?;
    }
    intake.finish()
}

#[cfg(test)]
mod tests;
