//! What has to be known of the whole city before a part of it is labelled.

use super::names::{GRID, SAMPLED, SPLIT, Sampled, SeenBlock, basis, coarse_file, seen_file};
use super::{Unit, UnitInput, UnitResult, UnitTask, given, map, terrain_file};
use crate::stages::prepare;
use crate::stages::sample::{self, Seen};
use crate::stages::segment as patches;
use crate::stages::split::Blocks;
use crate::stages::terrain::{Survey, whole};
use crate::{PipelineError, Stage, artefact, run};
use gable_segmentation::{CoarseHeights, GreenExcess};
use serde::{Deserialize, Serialize};

/// What a patch has to be told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PatchDetail {
    /// South-western pixel.
    pub(super) corner: [i64; 2],
    /// What the flight of the city is like.
    pub(super) survey: Survey,
    /// The pieces of the mosaic that it sees.
    pub(super) pieces: Vec<sample::Piece>,
}

/// Reads: `split.json`, `seen/`, `coarse/`, `map/parts/`. Makes: `sampled.json`, `terrain/`, `map/patches.json`, `map/picture.jpg`. Adds: the labelling of each patch.
pub(super) fn terrain(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, folder) = (unit.context, unit.folder);
    let params = context.params;
    let blocks = Blocks { report: unit.read(SPLIT)?, folder: folder.join("blocks") };
    let mut heights = CoarseHeights::new(params.segmentation.terrain_cell);
    let mut green = GreenExcess::default();
    let mut seen: Vec<SeenBlock> = Vec::new();
    for (ix, iy) in blocks.with_data() {
        let name = format!("{ix}_{iy}");
        // What failed has left nothing.
        if let Some(block) = artefact::read_json(&folder.join(seen_file(&name)))? {
            super::coarse_file::add(&folder.join(coarse_file(&name)), &mut heights, &mut green)?;
            seen.push(block);
        }
    }
    let only: Vec<Seen> = seen.iter().map(|b| b.seen.clone()).collect();
    if only.iter().all(|s| s.covered == 0) {
        let first = unit.history.failed.iter().find(|f| f.stage == Stage::Sample);
        return Err(first.map_or_else(
            || run::unseen(unit.job.source),
            |first| context.failed(Stage::Sample, "every block", &first.reason),
        ));
    }
    let coloured = run::is_coloured(&only);
    let (ground, survey) = whole(context, &heights, &green, coloured)?;
    let cells = ground.heights().window();
    artefact::create_dir(&folder.join("terrain"))?;
    let mut made = terrain_file::write(folder, &ground)?;

    let sampled = Sampled { blocks: seen, coloured, terrain: cells };
    let mosaic = sample::mosaic(context, sampled.pieces());
    let found = patches::patches(&mosaic, params.segmentation.patch);
    made.push(map::write_patches(unit, &blocks, found.iter().map(|&patch| (patches::unit_name(patch), patch)))?);
    made.push(map::write_picture(unit, &blocks)?);
    let tasks = found.into_iter().map(|patch| {
        let window = patches::seen_by(params, patch);
        let raw = prepare::seen_by(window);
        let sees = |p: &&sample::Piece| !p.window(patch.step).intersection(&raw).is_empty();
        let pieces: Vec<sample::Piece> = sampled.pieces().filter(sees).cloned().collect();
        let mut reads = vec![GRID.to_owned()];
        reads.extend(pieces.iter().map(|p| p.file.clone()));
        reads.extend(terrain_file::tiles(cells, window));
        reads.extend(given::reads(unit.job.params, &["weights", "labels", "footprints"]));
        let detail = PatchDetail { corner: [patch.x0, patch.y0], survey, pieces };
        let input = UnitInput {
            reads,
            reuse: true,
            basis: basis(unit.job.params, &["sampling", "segmentation"]),
            detail: serde_json::to_value(detail).map_err(|e| unit.failed(e))?,
            ..UnitInput::default()
        };
        Ok(UnitTask { stage: Stage::Segment, unit: patches::unit_name(patch), input, required: false })
    });
    let tasks = tasks.collect::<Result<_, PipelineError>>()?;
    unit.write(SAMPLED, &sampled)?;
    made.push(SAMPLED.to_owned());
    Ok(UnitResult { made, tasks, ..UnitResult::default() })
}
