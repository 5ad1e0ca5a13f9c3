//! What can go wrong in writing.

use std::io;
use std::path::PathBuf;

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The disk, or a stream.
    #[error("a temporary file: {0}")]
    Spool(#[source] io::Error),
    /// A stream that is written to.
    #[error("{0}")]
    Write(#[from] io::Error),
    /// SQLite refuses.
    #[error("{}: {source}", path.display())]
    GeoPackage {
        /// The file.
        path: PathBuf,
        /// What SQLite says.
        source: rusqlite::Error,
    },
    /// FlatGeobuf refuses.
    #[error("FlatGeobuf: {0}")]
    FlatGeobuf(String),
    /// GeoJSON refuses.
    #[error("GeoJSON: {0}")]
    GeoJson(#[from] geojson::Error),
    /// A point of the city has no longitude and latitude.
    #[error("{0:.0} {1:.0} has no longitude and latitude in the reference system of the city: is that the right one?")]
    Place(f64, f64),
}
