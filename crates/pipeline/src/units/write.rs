//! The writing of a tile.

use super::city::{self, CityBuilding};
use super::names::{GRID, lines_file, written_file};
use super::stitch::WriteDetail;
use super::{RESULT, Unit, UnitResult, terrain_file};
use crate::failure::Failures;
use crate::params::Format;
use crate::stages::split::Blocks;
use crate::stages::{ground_overview, model, sample, tiles3d, write as stage};
use crate::{PipelineError, artefact};
use gable_raster::{GridWindow, Raster};
use gable_segmentation::Terrain;
use serde::{Deserialize, Serialize};

/// What was written of a tile.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct WrittenTile {
    pub(super) entry: stage::IndexEntry,
    pub(super) buildings: Vec<CityBuilding>,
    /// What the tilesets have to know.
    #[serde(default)]
    pub(super) layers: tiles3d::Layers,
}

/// Reads: `grid.json`, the tile's models (none if it owns no building, or if they failed), the tiles of the terrain under it; for 3D
/// Tiles also its rasters, and the mesh that was thinned out. Makes: `result/tiles/`, `result/3dtiles/`, `overview/`, its lines in the file of the city, and `written/{ix}_{iy}.json`.
pub(super) fn write(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, folder, name) = (unit.context, unit.folder, unit.task.unit.as_str());
    let [ix, iy] = unit.block()?;
    let WriteDetail { title, pieces, mesh } = unit.detail()?;
    let ortho = sample::mosaic(context, &pieces);
    let blocks = Blocks { report: unit.read(GRID)?, folder: folder.join("blocks") };
    let modelled: Vec<model::Modelled> =
        artefact::read_json(&folder.join(model::model_file(ix, iy)))?.unwrap_or_default();
    let terrain = match context.params.output.terrain {
        true => terrain_file::read(folder)?,
        false => {
            let nowhere = GridWindow { step: 1.0, x0: 0, y0: 0, width: 1, height: 1 };
            Terrain::from_heights(Raster::filled(nowhere, f32::NAN))
        }
    };
    let records: Vec<_> = modelled.iter().map(|m| m.record.clone()).collect();
    for made in ["result/tiles", "written", "lines"] {
        artefact::create_dir(&folder.join(made))?;
    }
    let out = folder.join(RESULT);
    let written = stage::tile(context, &blocks, [ix, iy], modelled, &terrain, &ortho, mesh.as_ref(), &title, &out)?;
    let part = ground_overview::file([ix, iy]);
    let mut made: Vec<String> = written.files.iter().map(|file| format!("{RESULT}{file}")).collect();
    if folder.join(&part).is_file() {
        made.push(part);
    }
    if context.params.output.formats.contains(&Format::CityJsonSeq) {
        let parts = stage::lines(context, &stage::header(context.params, &blocks, &title), &written)?;
        for (part, bytes) in ["buildings", "terrain"].into_iter().zip(parts) {
            let file = lines_file(name, part);
            artefact::write(&folder.join(&file), &bytes)?;
            made.push(file);
        }
    }
    let buildings = city::buildings(&written.buildings, &records, blocks.frame());
    let entry = stage::entry(&blocks, [ix, iy], &written, &Failures::default());
    unit.write(&written_file(name), &WrittenTile { entry, buildings, layers: written.layers })?;
    made.push(written_file(name));
    Ok(UnitResult { made, ..UnitResult::default() })
}
