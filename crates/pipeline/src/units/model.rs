//! The modelling of the buildings that a tile owns.

use super::names::{GRID, tasks_file};
use super::stitch::ModelDetail;
use super::{Unit, UnitResult, terrain_file};
use crate::PipelineError;
use crate::known::Known;
use crate::mosaic::{Mosaic, MosaicTile};
use crate::stages::split::Blocks;
use crate::stages::stitch::Task;
use crate::stages::{model as stage, sample};
use gable_blocks::{BlockEntry, SplitReport};

/// Reads: `grid.json`, its buildings, and the pieces, labels and tiles of the terrain that they see. Makes:
/// `models/{ix}_{iy}.json`.
pub(super) fn model(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, folder, params) = (unit.context, unit.folder, unit.context.params);
    let [ix, iy] = unit.block()?;
    let detail: ModelDetail = unit.detail()?;
    let mut report: SplitReport = unit.read(GRID)?;
    report.blocks = detail
        .blocks
        .iter()
        .filter_map(|&[ix, iy]| report.grid.core(ix, iy))
        .map(|core| BlockEntry { file: core.file_name(), core, triangles: 1, bytes: 0 })
        .collect();
    let blocks = Blocks { report, folder: folder.join("blocks") };
    let label = |l: &super::names::LabelFile| MosaicTile { window: l.window, path: folder.join(&l.file) };
    let step = params.sampling.step;
    let labels = Mosaic::new(detail.labels.iter().map(label).collect(), step, context.cache_bytes() / 8);
    let ortho = sample::mosaic(context, &detail.pieces);
    let terrain = terrain_file::read(folder)?;
    let known = params.segmentation.footprints.as_deref();
    let known = known.map(|path| Known::read(path, blocks.frame(), context)).transpose()?;
    let roofs = stage::known_roofs(context, blocks.frame())?;
    let modeller = stage::Modeller {
        blocks: &blocks,
        ortho: &ortho,
        labels: &labels,
        terrain: &terrain,
        footprints: known.as_ref(),
        roofs: roofs.as_ref(),
        photographed: detail.photographed,
    };
    let tasks: Vec<(Task, Option<String>)> = unit.read(&tasks_file(&unit.task.unit))?;
    let tasks: Vec<(&Task, Option<String>)> = tasks.iter().map(|(task, note)| (task, note.clone())).collect();
    let name = stage::model_file(ix, iy);
    unit.write(&name, &modeller.tile(context, [ix, iy], &tasks)?)?;
    Ok(UnitResult { made: vec![name], ..UnitResult::default() })
}
