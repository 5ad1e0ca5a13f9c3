//! Why a file is not opened.

use std::io;
use std::path::{Path, PathBuf};

/// A file that cannot be had. No message has bytes of the file in it.
#[derive(Debug, thiserror::Error)]
#[error("{}: {kind}", path.display())]
pub struct FileError {
    /// The path as it was given.
    pub path: PathBuf,
    /// Why.
    pub kind: Refusal,
}

/// Why a file is not opened, or not read.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// Nothing is there.
    #[error("no such file or folder")]
    NotFound,
    /// It leads out of the folders that may be read. The same whether something is there or not.
    #[error("lies outside of what may be read here: what a source names has to lie inside of its source root")]
    Outside,
    /// A folder, a pipe, a device.
    #[error("is no regular file")]
    NotRegular,
    /// It has more bytes than what reads it takes.
    #[error("has more than the {} that are read of such a file", bytes(*most))]
    TooLong {
        /// The most that are read, bytes.
        most: u64,
    },
    /// A folder has more in it than is looked at.
    #[error("has more than {most} entries")]
    TooMany {
        /// The most that are looked at.
        most: usize,
    },
    /// It is no UTF-8 text.
    #[error("byte {at} is not UTF-8: this is no text file")]
    NotText {
        /// Where it ends to be text, bytes.
        at: usize,
    },
    /// The operating system could not read it.
    #[error("cannot be read: {0}")]
    Read(#[source] io::Error),
}

impl FileError {
    /// The error for a failed system call.
    pub(crate) fn of(path: &Path, source: io::Error) -> Self {
        let kind = match source.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => Refusal::NotFound,
            _ => Refusal::Read(source),
        };
        kind.at(path)
    }
}

impl Refusal {
    /// The error about a path.
    pub(crate) fn at(self, path: &Path) -> FileError {
        FileError { path: path.to_owned(), kind: self }
    }
}

/// A number of bytes as a person reads it.
fn bytes(count: u64) -> String {
    match count {
        0..1024 => format!("{count} bytes"),
        1024..1_048_576 => format!("{} KiB", count >> 10),
        1_048_576..1_073_741_824 => format!("{} MiB", count >> 20),
        _ => format!("{} GiB", count >> 30),
    }
}
