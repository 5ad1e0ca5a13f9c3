//! What was read, and what was put up with.

use serde::{Deserialize, Serialize};

/// Something that is wrong in the input but can be put up with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WarningKind {
    /// A material library (MTL) that is named but not there: its materials are grey.
    MissingMaterialLibrary,
    /// A face's material that no library defines: grey.
    UnknownMaterial,
    /// A texture that is missing or of an unknown image type: grey.
    MissingTexture,
    /// A triangle without texture coordinates though its material has a texture: grey.
    MissingTextureCoordinates,
    /// A face of fewer than three corners or without area: left out.
    DegenerateFace,
    /// A statement that is not understood and was passed over.
    IgnoredStatement,
    /// A file in the folder that was passed over because another format was preferred.
    IgnoredFile,
    /// A file of the folder that was passed over because another shows the same place finer.
    CoarserFile,
    /// Two files that cover the same place.
    OverlappingFiles,
    /// A file of the folder that holds no triangles.
    EmptyFile,
    /// Coordinates that were rounded to steps that can be seen in a model.
    CoarseCoordinates,
    /// Coordinates in feet, which became metres.
    ScaledUnits,
    /// A file that tells where meshes lie, but of none that is read.
    UnusedGeoreference,
    /// A vertex with a coordinate that is not finite: faces that use it are left out.
    BrokenVertex,
    /// A face that uses a broken vertex, or one that is not there: left out.
    BrokenFace,
    /// A file of several that is damaged: it is read up to the fault.
    BrokenFile,
    /// A text file that ends in zero bytes.
    ZeroBytes,
    /// A number with a comma in place of its point.
    DecimalComma,
    /// A library or texture that lies elsewhere than the mesh names it.
    FoundElsewhere,
}

/// How often a warning came up, with its first places.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warning {
    /// What it is about.
    pub kind: WarningKind,
    /// How often.
    pub count: u64,
    /// The first places, at most [`Warnings::EXAMPLES`].
    pub examples: Vec<String>,
}

/// Warnings by kind, in the order of the kinds.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Warnings {
    entries: Vec<Warning>,
}

impl Warnings {
    /// Places that are kept of each kind.
    pub const EXAMPLES: usize = 5;

    /// Counts a warning; `example` is only asked for its place where it is one of the first.
    pub fn add(&mut self, kind: WarningKind, example: impl FnOnce() -> String) {
        self.add_many(kind, 1, example);
    }

    /// Counts a warning `count` times, with one place.
    pub fn add_many(&mut self, kind: WarningKind, count: u64, example: impl FnOnce() -> String) {
        let at = match self.entries.binary_search_by_key(&kind, |w| w.kind) {
            Ok(at) => at,
            Err(at) => {
                self.entries.insert(at, Warning { kind, count: 0, examples: Vec::new() });
                at
            }
        };
        let warning = &mut self.entries[at];
        warning.count += count;
        if warning.examples.len() < Self::EXAMPLES {
            warning.examples.push(example());
        }
    }

    /// Adds what another list holds.
    pub fn merge(&mut self, other: Self) {
        for Warning { kind, count, examples } in other.entries {
            let mut examples = examples.into_iter();
            self.add_many(kind, count, || examples.next().unwrap_or_default());
            let at = self.entries.iter_mut().find(|w| w.kind == kind);
            if let Some(warning) = at {
                let room = Self::EXAMPLES - warning.examples.len();
                warning.examples.extend(examples.take(room));
            }
        }
    }

    /// The warnings, in the order of their kinds.
    #[must_use]
    pub fn entries(&self) -> &[Warning] {
        &self.entries
    }

    /// How often a kind came up.
    #[must_use]
    pub fn count(&self, kind: WarningKind) -> u64 {
        self.entries.iter().find(|w| w.kind == kind).map_or(0, |w| w.count)
    }

    /// Whether nothing came up.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

/// What a stream held.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Mesh files.
    pub files: u64,
    /// Bytes of mesh files read.
    pub bytes: u64,
    /// Vertices in the files.
    pub vertices: u64,
    /// Faces in the files, of any number of corners.
    pub faces: u64,
    /// Triangles handed on.
    pub triangles: u64,
    /// Bounds of the triangles in world coordinates, z up.
    pub min: [f64; 3],
    /// Bounds of the triangles in world coordinates, z up.
    pub max: [f64; 3],
    /// Area of the triangles, m².
    pub area: f64,
    /// What was put up with, both on opening and in the stream.
    pub warnings: Warnings,
}
