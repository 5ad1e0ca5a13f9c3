//! What can go wrong with blocks.

use gable_scene::SceneError;
use std::io;
use std::path::{Path, PathBuf};

/// A scene that cannot be split, or a block file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BlocksError {
    /// The scene is bad.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file or folder could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file or folder could not be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file that is no block file.
    #[error("{}: is not a block file: it starts with {found}", path.display())]
    WrongMagic {
        /// The file.
        path: PathBuf,
        /// Its first bytes.
        found: String,
    },
    /// A block file of another version.
    #[error("{}: is a block file of version {found}, but version {expected} is read: split the scene again", path.display())]
    WrongVersion {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The version that is read.
        expected: u32,
    },
    /// A block file that ends too early.
    #[error("{}: ends at byte {found}, but {expected} bytes were written: split the scene again", path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Bytes that there should be.
        expected: u64,
        /// Bytes that there are.
        found: u64,
    },
    /// A block file whose bytes have changed.
    #[error("{}: is damaged, {what}: split the scene again", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: &'static str,
    },
    /// A grid that cannot be made.
    #[error("the grid cannot be made: {what}")]
    Grid {
        /// Why.
        what: String,
    },
    /// A scene wider than the coordinate lattice.
    #[error(
        "the scene measures {extent:.0} m, but only {limit:.0} m around its first vertex can be worked on: \
         cut it into parts, or remove stray vertices"
    )]
    TooWide {
        /// Its extent, metres.
        extent: f64,
        /// What can be worked on, metres.
        limit: f64,
    },
}

impl BlocksError {
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_owned(), source }
    }

    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.to_owned(), source }
    }
}
