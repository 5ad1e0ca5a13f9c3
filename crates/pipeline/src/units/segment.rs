//! The labelling of a patch.

use super::names::GRID;
use super::terrain::PatchDetail;
use super::{Unit, UnitResult, terrain_file};
use crate::PipelineError;
use crate::known::Known;
use crate::stages::{sample, segment as stage};
use gable_blocks::SplitReport;
use gable_raster::GridWindow;

/// Reads: `grid.json`, the pieces and the tiles of the terrain that it sees, `given/`. Makes: `labels/{x0}_{y0}.lab` and `.json`.
pub(super) fn segment(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, params) = (unit.context, unit.context.params);
    let frame = unit.read::<SplitReport>(GRID)?.grid.frame;
    let detail: PatchDetail = unit.detail()?;
    let edge = params.segmentation.patch;
    let [x0, y0] = detail.corner;
    let patch = GridWindow { step: params.sampling.step, x0, y0, width: edge, height: edge };
    let ortho = sample::mosaic(context, &detail.pieces);
    let terrain = terrain_file::read(unit.folder)?;
    let known = params.segmentation.footprints.as_deref();
    let known = known.map(|path| Known::read(path, &frame, context)).transpose()?;
    let labelling = stage::Labelling::new(context, &frame, known.as_ref(), &detail.survey)?;
    stage::write_patch(context, patch, labelling.label(context, &ortho, &terrain, patch)?)?;
    Ok(UnitResult { made: stage::patch_files(patch).to_vec(), ..UnitResult::default() })
}
