//! Rasters of every block, in pieces of a fixed lattice so that no raster in memory is larger than one piece.

use super::split::Blocks;
use super::{Context, mesh_tiles};
use crate::artefact;
use crate::failure::{guarded, is_local};
use crate::mosaic::{Mosaic, MosaicTile};
use crate::{PipelineError, Stage};
use gable_city_model::tiles3d::Layer;
use gable_ortho::{OrthoError, Orthograph, SampleParams, TextureCache, sample};
use gable_raster::GridWindow;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Edge of a piece, pixels.
const PIECE: i64 = 512;

/// What was seen in a block.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Seen {
    pub(crate) block: [u32; 2],
    pub(crate) pieces: Vec<Piece>,
    /// Pixels with a surface.
    pub(crate) covered: u64,
    /// Of these, pixels with a photographed colour.
    pub(crate) photographed: u64,
    pub(crate) seconds: f64,
    /// The mesh for viewers, where it is wanted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) mesh: Option<Layer>,
    #[serde(skip)]
    pub(crate) reused: bool,
    /// Why nothing could be seen.
    #[serde(skip)]
    pub(crate) failed: Option<String>,
}

/// One raster file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Piece {
    pub(crate) file: String,
    x0: i64,
    y0: i64,
    width: usize,
    height: usize,
}

/// Samples all blocks that hold triangles. A block that cannot be sampled has failed; the others go on.
pub(crate) fn run(
    context: &Context<'_>,
    blocks: &Blocks,
    textures: &TextureCache,
) -> Result<(Vec<Seen>, Mosaic<Orthograph>), PipelineError> {
    let wanted = blocks.with_data();
    context.observer.stage(Stage::Sample, wanted.len());
    let seen: Vec<Seen> = wanted
        .par_iter()
        .map(|&(ix, iy)| {
            context.check_cancelled()?;
            let name = format!("{ix}_{iy}");
            let record = context.workspace.path(&format!("ortho/{name}.json"));
            let found = artefact::whole_json::<Seen>(&record)?.filter(|seen| seen.is_whole(context));
            let made = match found {
                Some(seen) => Ok(Seen { reused: true, ..seen }),
                None => guarded(Stage::Sample, &name, || block(context, blocks, textures, ix, iy)),
            };
            let seen = match made {
                Ok(seen) => seen,
                Err(error) if is_local(&error) => {
                    Seen { block: [ix, iy], failed: Some(error.to_string()), ..Seen::default() }
                }
                Err(error) => return Err(error),
            };
            if !seen.reused && seen.failed.is_none() {
                artefact::write_json(&record, &seen)?;
            }
            context.observer.done(Stage::Sample, &name);
            Ok(seen)
        })
        .collect::<Result<_, PipelineError>>()?;
    let mosaic = mosaic(context, seen.iter().flat_map(|s| &s.pieces));
    Ok((seen, mosaic))
}

/// The mosaic of some pieces.
pub(crate) fn mosaic<'a>(context: &Context<'_>, pieces: impl IntoIterator<Item = &'a Piece>) -> Mosaic<Orthograph> {
    let step = context.params.sampling.step;
    let tile = |p: &Piece| MosaicTile { window: p.window(step), path: context.workspace.path(&p.file) };
    Mosaic::new(pieces.into_iter().map(tile).collect(), step, context.cache_bytes())
}

impl Seen {
    /// Whether all rasters are there and undamaged, as far as an earlier run made them.
    fn is_whole(&self, context: &Context<'_>) -> bool {
        let whole = |piece: &Piece| match Orthograph::read(&context.workspace.path(&piece.file)) {
            Ok(raster) => raster.window() == piece.window(context.params.sampling.step),
            Err(error) => {
                tracing::warn!("made again: {error}");
                false
            }
        };
        let mut mesh = self.mesh.iter().flat_map(|layer| &layer.levels);
        self.pieces.iter().all(whole) && mesh.all(|level| context.workspace.path(&mesh_tiles::file(level)).is_file())
    }
}

impl Piece {
    pub(crate) fn window(&self, step: f64) -> GridWindow {
        GridWindow { step, x0: self.x0, y0: self.y0, width: self.width, height: self.height }
    }
}

/// The rasters of one block, written as pieces.
pub(crate) fn block(
    context: &Context<'_>,
    blocks: &Blocks,
    textures: &TextureCache,
    ix: u32,
    iy: u32,
) -> Result<Seen, PipelineError> {
    let begin = std::time::Instant::now();
    let name = format!("{ix}_{iy}");
    let mesh = blocks.read(ix, iy).map_err(|e| context.failed(Stage::Sample, &name, e))?;
    let mut seen = Seen { block: [ix, iy], ..Seen::default() };
    let Some(core) = blocks.core(ix, iy) else { return Ok(seen) };
    for piece in pieces(core) {
        let raster = sample(&mesh, piece, textures, &SampleParams::default());
        let (covered, photographed) = raster.coverage();
        if covered == 0 {
            continue;
        }
        seen.covered += covered as u64;
        seen.photographed += photographed as u64;
        let file = format!("ortho/{}_{}.gbo", piece.x0, piece.y0);
        let path = context.workspace.path(&file);
        raster.write(&path).map_err(|e| match e {
            OrthoError::Io { source, .. } => PipelineError::Io { path, source },
            other => context.failed(Stage::Sample, &name, other),
        })?;
        seen.pieces.push(Piece { file, x0: piece.x0, y0: piece.y0, width: piece.width, height: piece.height });
    }
    if context.params.shows_mesh() {
        seen.mesh = mesh_tiles::make(context, &mesh, core, textures, [ix, iy])?;
    }
    seen.seconds = begin.elapsed().as_secs_f64();
    Ok(seen)
}

/// The parts of a window in the cells of the lattice.
fn pieces(window: GridWindow) -> Vec<GridWindow> {
    let (x1, y1) = (window.x0 + window.width as i64 - 1, window.y0 + window.height as i64 - 1);
    let mut out = Vec::new();
    for y in window.y0.div_euclid(PIECE)..=y1.div_euclid(PIECE) {
        for x in window.x0.div_euclid(PIECE)..=x1.div_euclid(PIECE) {
            let edge = PIECE as usize;
            let cell = GridWindow { step: window.step, x0: x * PIECE, y0: y * PIECE, width: edge, height: edge };
            out.push(cell.intersection(&window));
        }
    }
    out.retain(|p| !p.is_empty());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_the_window_once() {
        let window = GridWindow { step: 0.2, x0: -700, y0: 100, width: 1500, height: 413 };
        let parts = pieces(window);
        assert_eq!(parts.iter().map(GridWindow::len).sum::<usize>(), window.len());
        assert!(parts.iter().all(|p| p.intersection(&window) == *p));
    }
}
