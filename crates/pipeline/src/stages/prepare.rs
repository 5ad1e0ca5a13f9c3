//! Rasters as the stages after sampling want them: without spikes and small holes.

use crate::PipelineError;
use crate::mosaic::Mosaic;
use gable_ortho::{DespikeParams, GridWindow, Orthograph, despike, fill_holes};

/// Largest hole of the surface that is filled, m².
const HOLE: f64 = 1.0;

/// The orthograph on a window, cleaned by filters of a fixed reach, so that a pixel does not depend on the window.
pub(crate) fn read(ortho: &Mosaic<Orthograph>, window: GridWindow) -> Result<Orthograph, PipelineError> {
    let spikes = DespikeParams::default();
    let reach = spikes.reach(window.step) + (HOLE / (window.step * window.step)).ceil() as usize + 1;
    let mut maps = ortho.read(window.grown(reach))?;
    let (height, filled) = fill_holes(&despike(&maps.height, &spikes), HOLE);
    maps.height = height;
    for (normal, _) in maps.normal.values_mut().iter_mut().zip(filled.values()).filter(|(_, filled)| **filled) {
        *normal = [0.0, 0.0, 1.0];
    }
    Ok(maps.crop(window))
}
