//! Rasters as the stages after sampling want them: without spikes and small holes.

use crate::PipelineError;
use crate::mosaic::Mosaic;
use gable_ortho::{CleanParams, Orthograph, clean};
use gable_raster::GridWindow;

/// Largest hole of the surface that is filled, m².
const HOLE: f64 = 1.0;

/// The orthograph on a window, cleaned by filters of a fixed reach, so that a pixel does not depend on the window.
pub(crate) fn read(ortho: &Mosaic<Orthograph>, window: GridWindow) -> Result<Orthograph, PipelineError> {
    let mut maps = ortho.read(seen_by(window))?;
    clean(&mut maps, &params());
    Ok(maps.crop(window))
}

/// The raw pixels that the cleaned ones of a window depend on.
pub(crate) fn seen_by(window: GridWindow) -> GridWindow {
    window.grown(params().reach(window.step))
}

fn params() -> CleanParams {
    CleanParams { max_hole: HOLE, ..CleanParams::default() }
}
