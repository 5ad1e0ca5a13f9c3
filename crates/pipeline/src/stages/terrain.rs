//! What has to be known of the whole city before a part of it is labelled: the ground surface, and how colourful it is.

use super::Context;
use super::split::Blocks;
use crate::failure::{Failures, guarded, is_local};
use crate::mosaic::Mosaic;
use crate::{PipelineError, Stage};
use gable_ortho::Orthograph;
use gable_segmentation::{CoarseHeights, GreenExcess, Terrain, TerrainParams};

/// The ground under all sampled tiles, and the factor that brings their colours to one measure. Memory is that of the
/// coarse cells: 64 bytes for each 4 m².
///
/// A tile that cannot be read is left out of the mosaic, and its block has failed.
pub(crate) fn terrain(
    context: &Context<'_>,
    blocks: &Blocks,
    ortho: &mut Mosaic<Orthograph>,
    failures: &mut Failures,
) -> Result<(Terrain, f32), PipelineError> {
    let tiles = ortho.tiles().len();
    context.observer.stage(Stage::Terrain, tiles);
    let mut coarse = CoarseHeights::new(context.params.segmentation.terrain_cell);
    let mut green = GreenExcess::default();
    let mut lost = Vec::new();
    for (i, tile) in ortho.tiles().iter().enumerate() {
        context.check_cancelled()?;
        let name = tile.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match guarded(Stage::Terrain, &name, || ortho.tile(i)) {
            Ok(maps) => {
                coarse.accumulate(&maps.height);
                green.accumulate(&maps.colour, &maps.photographed);
            }
            Err(error) if is_local(&error) => {
                failures.add_window(blocks, tile.window, &error.to_string());
                lost.push(i);
            }
            Err(error) => return Err(error),
        }
        context.observer.done(Stage::Terrain, &name);
    }
    ortho.leave_out(&lost);
    Ok((Terrain::from_coarse(&coarse, &TerrainParams::default()), green.saturation()))
}
