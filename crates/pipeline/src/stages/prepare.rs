//! Rasters as the stages after sampling want them: without spikes and small holes.

use crate::PipelineError;
use crate::mosaic::Mosaic;
use gable_ortho::{GridWindow, Orthograph};

/// Pixels by which the filters below look beyond a pixel.
const REACH: usize = 16;

/// The orthograph on a window, cleaned by filters of a fixed reach, so that a pixel does not depend on the window.
pub(crate) fn read(ortho: &Mosaic<Orthograph>, window: GridWindow) -> Result<Orthograph, PipelineError> {
    let wide = ortho.read(window.grown(REACH))?;
    Ok(wide.crop(window))
}
