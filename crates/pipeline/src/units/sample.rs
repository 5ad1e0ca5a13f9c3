//! The sampling of a block.

use super::names::{GRID, SeenBlock, coarse_file, materials_file, seen_file};
use super::textures::{self, BlockMaterial};
use super::{Unit, UnitResult, map};
use crate::stages::split::Blocks;
use crate::stages::{mesh_tiles, sample as stage};
use crate::{PipelineError, artefact};
use gable_blocks::SplitReport;
use gable_ortho::Orthograph;
use gable_segmentation::{CoarseHeights, GreenExcess};

/// Reads: `grid.json`, the block, its materials, their textures. Makes: `ortho/`, `seen/{ix}_{iy}.json`, `coarse/{ix}_{iy}.low`, its picture in
/// `map/parts/`, `mesh/` where it is to be shown.
pub(super) fn sample(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, folder, name) = (unit.context, unit.folder, unit.task.unit.as_str());
    let [ix, iy] = unit.block()?;
    let blocks = Blocks { report: unit.read::<SplitReport>(GRID)?, folder: folder.join("blocks") };
    let materials: Vec<BlockMaterial> = unit.read(&materials_file(name))?;
    let textures = textures::open(&materials, folder, context.params, context.reach);
    let seen = stage::block(context, &blocks, &textures, ix, iy)?;

    let mut heights = CoarseHeights::new(context.params.segmentation.terrain_cell);
    let mut green = GreenExcess::default();
    let mut picture = blocks.core(ix, iy).map(map::Part::new);
    for piece in &seen.pieces {
        let maps = Orthograph::read(&folder.join(&piece.file)).map_err(|e| unit.failed(e))?;
        heights.accumulate(&maps.height);
        green.accumulate(&maps.colour, &maps.photographed);
        if let Some(picture) = &mut picture {
            picture.add(&maps);
        }
    }
    for file in [seen_file(name), coarse_file(name)] {
        if let Some(parent) = folder.join(file).parent() {
            artefact::create_dir(parent)?;
        }
    }
    super::coarse_file::write(&folder.join(coarse_file(name)), &heights, &green)?;
    let mut made = vec![seen_file(name), coarse_file(name)];
    if let Some(picture) = picture.filter(|_| seen.covered > 0) {
        picture.write(unit, &map::part_file(name))?;
        made.push(map::part_file(name));
    }
    made.extend(seen.pieces.iter().map(|p| p.file.clone()));
    made.extend(seen.mesh.iter().flat_map(|layer| &layer.levels).map(mesh_tiles::file));
    unit.write(&seen_file(name), &SeenBlock { seen, textures: textures::failures(&textures, folder) })?;
    Ok(UnitResult { made, ..UnitResult::default() })
}
