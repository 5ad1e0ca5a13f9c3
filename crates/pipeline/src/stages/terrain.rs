//! The ground surface of the whole city.

use super::Context;
use crate::mosaic::Mosaic;
use crate::{PipelineError, Stage};
use gable_ortho::Orthograph;
use gable_segmentation::{CoarseHeights, Terrain, TerrainParams};

/// The ground under all sampled tiles. Memory is that of the coarse cells: 64 bytes for each 4 m².
pub(crate) fn terrain(context: &Context<'_>, ortho: &Mosaic<Orthograph>) -> Result<Terrain, PipelineError> {
    let tiles = ortho.tiles().len();
    context.observer.stage(Stage::Terrain, tiles);
    let mut coarse = CoarseHeights::new(context.params.segmentation.terrain_cell);
    for (i, tile) in ortho.tiles().iter().enumerate() {
        context.check_cancelled()?;
        coarse.accumulate(&ortho.tile(i)?.height);
        let name = tile.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        context.observer.done(Stage::Terrain, &name);
    }
    Ok(Terrain::from_coarse(&coarse, &TerrainParams::default()))
}
