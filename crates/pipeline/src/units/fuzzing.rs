//! What fuzzers reach besides the crate's own surface: `tests/fuzz`.

use super::{coarse_file, terrain_file};
use crate::Unobserved;
use crate::known::Known;
use crate::params::Params;
use crate::stages::Context;
use crate::workspace::Workspace;
use gable_files::Reach;
use gable_geometry::{Crs, Frame};
use gable_raster::GridWindow;
use gable_segmentation::{CoarseHeights, GreenExcess};
use std::path::Path;

/// Reads footprints and roof planes, and draws them on a window of 64 × 64 m.
///
/// # Panics
/// If the folder of the file cannot be written.
pub fn read_footprints(path: &Path) {
    let folder = path.parent().unwrap_or(Path::new("."));
    let (params, workspace) = (Params::default(), Workspace::at(folder).expect("the folder is there"));
    let reach = Reach::everything();
    let context = Context { params: &params, observer: &Unobserved, workspace: &workspace, reach: &reach };
    let frame = Frame { origin: [0.0; 3], crs: Crs::Unknown };
    let Ok(known) = Known::read(path, &frame, &context) else { return };
    let built = known.built(GridWindow { step: 0.5, x0: -64, y0: -64, width: 128, height: 128 });
    let _ = known.roof(&built);
}

/// Reads the tiles of the ground below a folder.
pub fn read_terrain(folder: &Path) {
    let _ = terrain_file::read(folder);
}

/// Reads what the ground is found from, of one block.
pub fn read_coarse(path: &Path) {
    let (mut heights, mut green) = (CoarseHeights::new(CoarseHeights::CELL), GreenExcess::default());
    let _ = coarse_file::add(path, &mut heights, &mut green);
}
