//! The mesh that a city is modelled from, thinned out for viewers: what the model is compared with.
//!
//! A block's tile is made where its triangles and textures are in memory, with the sampling; the writing puts it into the result.

use super::Context;
use super::tiles3d::FOLDER;
use crate::{PipelineError, artefact};
use gable_blocks::BlockMesh;
use gable_city_model::tiles3d::{ColouredSurface, Layer, LayerLevel};
use gable_ortho::{CornerColours, TextureCache};
use gable_raster::GridWindow;
use std::path::Path;

/// Edge of the cubes that become one vertex, at the finest level, metres: about what photographs from the air resolve of a surface.
const FINEST: f64 = 0.5;
/// How much coarser each next level is.
const FACTOR: u32 = 4;
/// Number of levels: with the coarsest, a city of 12 km² has some hundred thousand triangles.
const LEVELS: usize = 3;

/// Folder of the tiles among the artefacts.
const MADE: &str = "mesh";

/// The artefact that a level is kept in.
pub(crate) fn file(level: &LayerLevel) -> String {
    format!("{MADE}/{}", level.uri)
}

/// Makes the tile of a block; none if it has no triangle.
pub(crate) fn make(
    context: &Context<'_>,
    mesh: &BlockMesh,
    core: GridWindow,
    textures: &TextureCache,
    tile: [u32; 2],
) -> Result<Option<Layer>, PipelineError> {
    let mut surface = ColouredSurface::new(core.bounds(), FINEST);
    let mut colours = CornerColours::new(textures, FINEST);
    for triangle in &mesh.triangles {
        surface.add(triangle.positions(), colours.of(triangle));
    }
    let mut levels = Vec::new();
    for number in 0..LEVELS {
        let Some(content) = surface.content() else { break };
        // What moves by less than a cube; nothing is finer than the finest.
        let error = if number == 0 { 0.0 } else { FINEST * f64::from(FACTOR).powi(number as i32) };
        let uri = format!("{}_{}.mesh-{number}.glb", tile[0], tile[1]);
        let level = LayerLevel { uri, error, low: content.low, high: content.high };
        artefact::write(&context.workspace.path(&file(&level)), &content.glb)?;
        levels.push(level);
        surface = surface.coarser(FACTOR);
    }
    levels.reverse();
    Ok((!levels.is_empty()).then_some(Layer { tile, levels }))
}

/// Puts the tile of a block into the result; gives the names of its files, relative to `out`.
pub(crate) fn put(context: &Context<'_>, layer: &Layer, out: &Path) -> Result<Vec<String>, PipelineError> {
    artefact::create_dir(&out.join(FOLDER))?;
    let copy = |level: &LayerLevel| {
        let (from, name) = (context.workspace.path(&file(level)), format!("{FOLDER}/{}", level.uri));
        let bytes = std::fs::read(&from).map_err(|source| PipelineError::Io { path: from, source })?;
        artefact::write(&out.join(&name), &bytes)?;
        Ok(name)
    };
    layer.levels.iter().map(copy).collect()
}
