//! What has to be known of the whole city before a part of it is labelled: the ground surface, and how colourful and how noisy it
//! is.

use super::Context;
use super::split::Blocks;
use crate::failure::{Failures, guarded, is_local};
use crate::mosaic::{Mosaic, MosaicTile};
use crate::{PipelineError, Stage};
use gable_ortho::Orthograph;
use gable_segmentation::{CoarseHeights, GreenExcess, Terrain, noise};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What the flight of a city is like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Survey {
    /// The factor that brings the colours to the measure of other cities; `None` without photographs.
    pub(crate) saturation: Option<f64>,
    /// Noise of the mesh as a multiple of the usual.
    pub(crate) noise: f64,
}

/// The ground of a city, and what its flight is like, from the counts of all its parts.
pub(crate) fn whole(
    context: &Context<'_>,
    heights: &CoarseHeights,
    green: &GreenExcess,
    coloured: bool,
) -> Result<(Terrain, Survey), PipelineError> {
    let ground = Terrain::from_coarse(heights).map_err(|e| context.failed(Stage::Terrain, "the whole city", e))?;
    warn_of_little_ground(context, heights, &ground);
    let survey = Survey { saturation: coloured.then(|| f64::from(green.saturation())), noise: noise(heights, &ground) };
    Ok((ground, survey))
}

/// Share of the cells with data that should be ground at least.
const LEAST_GROUND: f64 = 0.1;

/// Says so where hardly any ground was found: then roofs may have been taken for it, or ground for roofs.
fn warn_of_little_ground(context: &Context<'_>, heights: &CoarseHeights, terrain: &Terrain) {
    let seen = heights.cells().count();
    let ground = terrain.ground().values().iter().filter(|is_ground| **is_ground).count();
    if let Some(share) = too_little(ground, seen) {
        context.observer.warning(&format!(
            "the ground is doubtful: only {:.0} % of the mesh was found to be ground; look at the labels, or give footprints \
             (segmentation.footprints)",
            100.0 * share
        ));
    }
}

/// The share of ground if it is too small to be trusted.
fn too_little(ground: usize, seen: usize) -> Option<f64> {
    let share = ground as f64 / seen.max(1) as f64;
    (share < LEAST_GROUND).then_some(share)
}

/// Tiles that are counted at a time.
const BATCH: usize = 16;

/// The ground under all sampled tiles, and what their flight is like. Memory is that of the coarse cells: 64 bytes for each 4 m².
///
/// A tile that cannot be read is left out of the mosaic, and its block has failed.
pub(crate) fn terrain(
    context: &Context<'_>,
    blocks: &Blocks,
    ortho: &mut Mosaic<Orthograph>,
    coloured: bool,
    failures: &mut Failures,
) -> Result<(Terrain, Survey), PipelineError> {
    let tiles = ortho.tiles().len();
    context.observer.stage(Stage::Terrain, tiles);
    let mut coarse = CoarseHeights::new(context.params.segmentation.terrain_cell);
    let mut green = GreenExcess::default();
    let mut lost = Vec::new();
    let tiles: Vec<usize> = (0..tiles).collect();
    for batch in tiles.chunks(BATCH) {
        context.check_cancelled()?;
        let counted: Vec<Result<(CoarseHeights, GreenExcess), PipelineError>> = batch
            .par_iter()
            .map(|&i| {
                let name = name(&ortho.tiles()[i]);
                let maps = guarded(Stage::Terrain, &name, || ortho.tile(i));
                context.observer.done(Stage::Terrain, &name);
                let maps = maps?;
                let (mut heights, mut colours) = (CoarseHeights::new(coarse.cell()), GreenExcess::default());
                heights.accumulate(&maps.height);
                colours.accumulate(&maps.colour, &maps.photographed);
                Ok((heights, colours))
            })
            .collect();
        for (&i, counted) in batch.iter().zip(counted) {
            match counted {
                Ok((heights, colours)) => {
                    coarse.merge(&heights);
                    green.merge(&colours);
                }
                Err(error) if is_local(&error) => {
                    failures.add_window(blocks, ortho.tiles()[i].window, &error.to_string());
                    lost.push(i);
                }
                Err(error) => return Err(error),
            }
        }
    }
    ortho.leave_out(&lost);
    whole(context, &coarse, &green, coloured)
}

fn name(tile: &MosaicTile) -> String {
    tile.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hardly_any_ground_is_doubtful() {
        assert_eq!(too_little(900, 1000), None);
        assert_eq!(too_little(100, 1000), None);
        assert_eq!(too_little(50, 1000), Some(0.05));
        assert_eq!(too_little(0, 0), Some(0.0));
    }
}
