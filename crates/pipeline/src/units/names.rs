//! Names of the artefacts of units, and what some of them hold.

use crate::params::Params;
use crate::stages::sample::{Piece, Seen};
use gable_raster::GridWindow;
use serde::{Deserialize, Serialize};

/// The grid of the blocks and the city's lowest corner, and nothing that a change of one block would change: a
/// [`SplitReport`](gable_blocks::SplitReport) without blocks.
pub(super) const GRID: &str = "grid.json";
/// What the split found: a [`SplitReport`](gable_blocks::SplitReport) without materials.
pub(super) const SPLIT: &str = "split.json";
/// Which files of the source the textures come from.
pub(super) const TEXTURES: &str = "textures.json";
/// What was sampled, city-wide: [`Sampled`].
pub(super) const SAMPLED: &str = "sampled.json";
/// What was stitched, city-wide: [`Stitched`].
pub(super) const STITCHED: &str = "stitched.json";
/// Where buildings cross the borders of blocks, for those who watch: a list of [`Seam`].
pub(super) const SEAMS: &str = "seams.json";
/// The buildings of the finished city.
pub(super) const BUILDINGS: &str = "buildings.jsonl";

pub(super) fn block_file(name: &str) -> String {
    format!("blocks/{name}.block")
}

pub(super) fn materials_file(name: &str) -> String {
    format!("blocks/{name}.materials.json")
}

pub(super) fn seen_file(name: &str) -> String {
    format!("seen/{name}.json")
}

pub(super) fn coarse_file(name: &str) -> String {
    format!("coarse/{name}.low")
}

pub(super) fn tasks_file(name: &str) -> String {
    format!("buildings/{name}.json")
}

pub(super) fn written_file(name: &str) -> String {
    format!("written/{name}.json")
}

/// The lines of a tile in the file of the whole city.
pub(super) fn lines_file(name: &str, part: &str) -> String {
    format!("lines/{name}.{part}.jsonl")
}

/// What was seen in a block, with the textures that could not be read.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SeenBlock {
    pub(super) seen: Seen,
    /// Name of the texture, and the reason.
    pub(super) textures: Vec<(String, String)>,
}

/// What was sampled in the whole city.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Sampled {
    pub(super) blocks: Vec<SeenBlock>,
    /// Whether most of what is seen is photographed.
    pub(super) coloured: bool,
    /// Window of the terrain's cells.
    pub(super) terrain: GridWindow,
}

impl Sampled {
    pub(super) fn pieces(&self) -> impl Iterator<Item = &Piece> {
        self.blocks.iter().flat_map(|b| &b.seen.pieces)
    }
}

/// What was stitched in the whole city.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Stitched {
    /// Holes of the mesh, largest first: area and centre.
    pub(super) holes: Vec<(f64, [f64; 2])>,
    /// The patches with their labels.
    pub(super) labels: Vec<LabelFile>,
}

/// Blocks that have buildings in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Seam {
    /// The blocks, by row, then column: `{ix}_{iy}`.
    pub(super) blocks: Vec<String>,
    /// The tile that owns the buildings, and models them.
    pub(super) owner: String,
    /// How many buildings.
    pub(super) buildings: usize,
}

/// Where the labels of a patch lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LabelFile {
    pub(super) file: String,
    pub(super) window: GridWindow,
}

/// Hash of the parameters of some groups, as what depends on them has it in its input.
pub(super) fn basis(params: &Params, groups: &[&str]) -> String {
    blake3::hash(super::given::portable(params).canonical(groups).as_bytes()).to_hex().to_string()
}
