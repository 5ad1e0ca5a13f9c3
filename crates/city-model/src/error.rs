//! What can go wrong when city models are read and written.

use std::path::{Path, PathBuf};

/// An error of reading or writing a city model.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that could not be opened, read or written.
    #[error("cannot access {path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file that may not be read: it is none, is too long, or is no text.
    #[error(transparent)]
    Unreadable(#[from] gable_files::FileError),
    /// A stream that could not be written.
    #[error("cannot write the city model: {0}")]
    Write(#[from] std::io::Error),
    /// A file that is not what it should be.
    #[error("{path}, {place}: {reason}")]
    Content {
        /// The file.
        path: PathBuf,
        /// Line, byte or object.
        place: String,
        /// What was found, and what was expected.
        reason: String,
    },
    /// A building or terrain that cannot be written as it stands.
    #[error("{id}: {reason}")]
    Object {
        /// Identifier of the object.
        id: String,
        /// Why, and what to do.
        reason: String,
    },
    /// Coordinates that do not fit the file's integers or the extent that was announced.
    #[error("a coordinate of {id} is too far from the origin {origin:?}: choose an origin nearer to the city")]
    Range {
        /// Identifier of the object.
        id: String,
        /// World coordinates of the origin.
        origin: [f64; 3],
    },
}

impl Error {
    pub(crate) fn content(path: &Path, place: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Content { path: path.to_owned(), place: place.into(), reason: reason.into() }
    }

    pub(crate) fn object(id: &str, reason: impl Into<String>) -> Self {
        Self::Object { id: id.to_owned(), reason: reason.into() }
    }
}

/// Something in a file that was read without keeping it, so that nothing disappears silently.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Identifier of the object, empty for the whole file.
    pub id: String,
    /// What was left out or assumed.
    pub message: String,
}

impl std::fmt::Display for Note {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.id.is_empty() { write!(f, "{}", self.message) } else { write!(f, "{}: {}", self.id, self.message) }
    }
}

/// A city model from a file, with what was left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The city.
    pub model: crate::CityModel,
    /// What was left out or assumed, in the order of the file.
    pub notes: Vec<Note>,
}

/// How a file is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// World coordinates that become the local origin; by default the lowest corner, rounded down to whole metres,
    /// with height 0. Give two files the same origin to compare them.
    pub origin: Option<[f64; 3]>,
}
