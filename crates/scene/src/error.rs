//! What can be wrong with a scene, said so that the person at the terminal can act on it.

use gable_files::{FileError, Refusal};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a text file, counted from 1.
    Line(u64),
    /// A byte of a binary file, counted from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// A scene that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The input does not exist.
    #[error("{}: no such file or folder", path.display())]
    NotFound {
        /// The input.
        path: PathBuf,
    },
    /// The operating system could not read a file.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file whose ending names no format that is read.
    #[error(
        "{}: file type {extension:?} is not read: give an .obj, .ply, .off, .glb or .gltf file, a tileset.json, or a folder of them{}",
        path.display(), converter(extension)
    )]
    UnsupportedType {
        /// The file.
        path: PathBuf,
        /// Its ending.
        extension: String,
    },
    /// A folder without any mesh.
    #[error(
        "{}: no .obj, .ply, .off, .glb or .gltf file and no tileset.json in this folder or the folders in it{}",
        path.display(), converter(found)
    )]
    EmptyFolder {
        /// The folder.
        path: PathBuf,
        /// The ending of a mesh in it that is not read; empty if there is none.
        found: String,
    },
    /// The first bytes are not those of the format.
    #[error("{}: is not {expected}: it starts with {found}", path.display())]
    WrongMagic {
        /// The file.
        path: PathBuf,
        /// The format that the file's ending promises.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// A statement that cannot be understood.
    #[error("{}: {place}: {what}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// What is wrong.
        what: String,
    },
    /// The file ends too early.
    #[error("{}: {place}: the file ends too early, {what}: is it a complete copy?", path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Where it ends.
        place: Place,
        /// What is missing.
        what: String,
    },
    /// A face names a vertex that there is not.
    #[error("{}: {place}: a face names {kind} {index}, but there are {count}", path.display())]
    IndexOutOfRange {
        /// The file.
        path: PathBuf,
        /// Where the face stands.
        place: Place,
        /// "vertex" or "texture coordinate".
        kind: &'static str,
        /// The index as written.
        index: i64,
        /// How many there are up to this place.
        count: u64,
    },
    /// A coordinate that is no number or infinite.
    #[error("{}: {place}: a coordinate is {value}: coordinates must be finite numbers", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// The coordinate as written.
        value: String,
    },
    /// Nothing to work on.
    #[error("{}: there are no triangles in it", path.display())]
    NoTriangles {
        /// The input.
        path: PathBuf,
    },
    /// A reference system that is not understood.
    #[error(
        "{}: unknown reference system {text:?}: pass --crs EPSG:code (or ENU:latitude,longitude) to say which it is",
        path.display()
    )]
    UnknownCrs {
        /// The metadata file.
        path: PathBuf,
        /// What stands there.
        text: String,
    },
    /// A reference system in which there is no modelling, or none that goes with another.
    #[error("{}: {what}", path.display())]
    UnfitCrs {
        /// The file that tells it, or the input.
        path: PathBuf,
        /// What it is, and what to do.
        what: String,
    },
    /// A metadata file that cannot be understood.
    #[error("{}: the metadata cannot be understood: {what}", path.display())]
    Metadata {
        /// The metadata file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// The model lies on its side.
    #[error(
        "{}: the model seems to be {seems} up, not {assumed} up: {area_y:.0} m² of it face along the side and {area_z:.0} m² along \
         {assumed}, and it measures {:.0} × {:.0} × {:.0} m: pass --up={seems} to turn it, or --up {assumed} if it is {assumed} up",
        path.display(), extent[0], extent[1], extent[2]
    )]
    OnItsSide {
        /// The input.
        path: PathBuf,
        /// The axis that was taken to point up.
        assumed: &'static str,
        /// The axis that seems to.
        seems: &'static str,
        /// Area projected along the side that seems to be up, m².
        area_y: f64,
        /// Area projected along the axis that was assumed, m².
        area_z: f64,
        /// Extent, metres.
        extent: [f64; 3],
    },
    /// The model stands on its head.
    #[error(
        "{}: the model seems to stand on its head: its faces look down, and most of it lies high: pass --up={seems} to turn it, \
         or --up {assumed} if it is right",
        path.display()
    )]
    OnItsHead {
        /// The input.
        path: PathBuf,
        /// The axis that was taken to point up.
        assumed: &'static str,
        /// The axis that seems to.
        seems: &'static str,
    },
    /// The extent is not that of a city in metres.
    #[error(
        "{}: the model measures {extent_x:.6} × {extent_y:.6} in plan: {what}",
        path.display()
    )]
    NonsenseScale {
        /// The input.
        path: PathBuf,
        /// Extent along x, in the file's units.
        extent_x: f64,
        /// Extent along y, in the file's units.
        extent_y: f64,
        /// What seems to be wrong, and what to do.
        what: &'static str,
    },
    /// A feature of a format that is not read.
    #[error("{}: {what}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The feature, and what to do.
        what: String,
    },
    /// A file that may not be read: it lies elsewhere, is none, or is too long.
    #[error(transparent)]
    File(FileError),
    /// More than a city has; see the README for the figures.
    #[error("{}: {what}", path.display())]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// Of what, and how much is read.
        what: String,
    },
    /// A texture that cannot be used.
    #[error("{}: the texture cannot be used: {what}", path.display())]
    Texture {
        /// The image, or the file that holds it.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

impl SceneError {
    /// Whether it is about the content of one mesh file, so that the others of a city can be read without it. What the
    /// system refuses, what may not be read and what is too much is not.
    pub(crate) fn is_damage(&self) -> bool {
        matches!(
            self,
            Self::WrongMagic { .. }
                | Self::Syntax { .. }
                | Self::Truncated { .. }
                | Self::IndexOutOfRange { .. }
                | Self::NotFinite { .. }
                | Self::Unsupported { .. }
        )
    }

    /// The error for a failed system call: a missing file gets its own.
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::NotFound => Self::NotFound { path },
            _ => Self::Read { path, source },
        }
    }

    /// The error for more of something than is read.
    pub(crate) fn too_much(path: &Path, what: impl Into<String>) -> Self {
        Self::TooMuch { path: path.to_owned(), what: what.into() }
    }

    /// The error for more vertices than are read of a file.
    pub(crate) fn too_many_vertices(path: &Path) -> Self {
        let most = crate::budget::VERTICES / 1_000_000;
        Self::too_much(path, format!("it has more than {most} million vertices: split it into tiles"))
    }

    /// A statement that cannot be understood.
    pub(crate) fn syntax(path: &Path, place: Place, what: impl Into<String>) -> Self {
        Self::Syntax { path: path.to_owned(), place, what: what.into() }
    }

    /// A file that ends too early.
    pub(crate) fn truncated(path: &Path, place: Place, what: impl Into<String>) -> Self {
        Self::Truncated { path: path.to_owned(), place, what: what.into() }
    }
}

impl From<FileError> for SceneError {
    fn from(error: FileError) -> Self {
        match error.kind {
            Refusal::NotFound => Self::NotFound { path: error.path },
            Refusal::Read(source) => Self::Read { path: error.path, source },
            _ => Self::File(error),
        }
    }
}

/// What makes a mesh of another kind one that is read.
fn converter(extension: &str) -> &'static str {
    match extension.trim_start_matches('.').to_ascii_lowercase().as_str() {
        "osgb" | "osg" | "ive" => {
            ". OSGB: convert it by `osgconv Tile.osgb Tile.obj` of OpenSceneGraph, one tile after the other, or export 3D Tiles or OBJ from the program \
             that made it"
        }
        "fbx" | "dae" | "3ds" | "stl" | "blend" | "x3d" | "wrl" => {
            ": import it in Blender, and export it as OBJ or glTF"
        }
        "i3s" | "slpk" => {
            ": convert it by `npx @loaders.gl/cli tile-converter`, or export 3D Tiles or OBJ from the program that made it"
        }
        "3mx" | "3mxb" | "s3c" => ": export 3D Tiles or OBJ from the program that made it",
        "las" | "laz" | "e57" | "pcd" | "xyz" => ": it is a point cloud: give the mesh that was made of it",
        _ => "",
    }
}

/// Bytes for an error message: readable characters as they are, at most 40 of them.
pub(crate) fn shown(bytes: &[u8]) -> String {
    let cut = &bytes[..bytes.len().min(40)];
    let text: String = String::from_utf8_lossy(cut).escape_debug().collect();
    let dots = if cut.len() < bytes.len() { "…" } else { "" };
    format!("\"{text}{dots}\"")
}
