//! Holes of the mesh as seen from above: places inside the city where no surface is.

use super::Context;
use super::segment::Labelled;
use super::split::Blocks;
use crate::PipelineError;
use crate::artefact::NO_LABEL;
use gable_geometry::DVec2;
use gable_stitching::{TileComponents, unite};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// A hole.
#[derive(Clone, Debug)]
pub(crate) struct Hole {
    /// m².
    pub(crate) area: f64,
    /// Mean of its pixels, local metres.
    pub(crate) centre: DVec2,
}

/// All holes larger than those that sampling fills (1 m²), largest first.
///
/// Pixels without a surface that hang together along their sides, over all patches, are a hole unless they reach the
/// outside: the edge of a patch beside which none is. The patches hang on a lattice of their own, so the grid changes
/// nothing. What lies in a block that failed is no hole of the mesh. Memory: the edges of the patches.
pub(crate) fn holes(
    context: &Context<'_>,
    blocks: &Blocks,
    labelled: &Labelled,
    failed: &[[u32; 2]],
) -> Result<Vec<Hole>, PipelineError> {
    let tiles = labelled.labels.tiles();
    let empty: Vec<TileComponents> = (0..tiles.len())
        .into_par_iter()
        .map(|i| {
            context.check_cancelled()?;
            Ok(TileComponents::of(&labelled.labels.tile(i)?.0, |&l| l == NO_LABEL).0)
        })
        .collect::<Result<_, PipelineError>>()?;
    let there: BTreeSet<[i64; 2]> = empty.iter().map(|t| t.corner).collect();
    // Components at an edge of a patch that has no neighbour there.
    let open: Vec<BTreeSet<u32>> = empty
        .iter()
        .map(|tile| {
            let ([x, y], w, h) = (tile.corner, tile.width() as i64, tile.height() as i64);
            let sides = [
                (&tile.west, [x - w, y]),
                (&tile.east, [x + w, y]),
                (&tile.south, [x, y - h]),
                (&tile.north, [x, y + h]),
            ];
            let free = sides.into_iter().filter(|(_, beside)| !there.contains(beside));
            free.flat_map(|(side, _)| side.iter().filter(|&&mark| mark > 0).map(|mark| mark - 1)).collect()
        })
        .collect();
    let step = context.params.sampling.step;
    let gone: Vec<_> = failed.iter().filter_map(|[ix, iy]| blocks.core(*ix, *iy)).collect();
    let mut holes: Vec<Hole> = unite(&empty)
        .iter()
        .filter(|whole| !whole.pieces.iter().any(|(tile, component)| open[*tile].contains(component)))
        .filter(|whole| !gone.iter().any(|core| !core.intersection(&whole.window(step)).is_empty()))
        .map(|whole| Hole { area: whole.area(step), centre: whole.centroid(step) })
        .collect();
    holes.sort_by(|a, b| b.area.total_cmp(&a.area));
    Ok(holes)
}
