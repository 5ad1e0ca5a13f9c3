//! What a city, a building and the files that parameters name may have at most. Generous; each is checked before what it limits is
//! made, so that few bytes of input cannot fill the memory.

use crate::PipelineError;
use crate::params::Params;
use gable_blocks::SplitReport;

/// Pixels of the window around a building: 1.6 km × 1.6 km at 0.2 m.
pub(crate) const BUILDING_PIXELS: usize = 1 << 26;
/// Pixels of a footprint's window times its corners: what drawing it takes.
pub(crate) const FOOTPRINT_WORK: f64 = 1e11;
/// Cells of the ground surface, which is one raster for the city: 32 km × 32 km at 2 m.
const GROUND_CELLS: f64 = 268_435_456.0;

/// Bytes of a city model.
pub(crate) const CITY_MODEL: u64 = 2 << 30;
/// Bytes of a file of weights; those that are built in have less than a hundred thousand.
pub(crate) const WEIGHTS: u64 = 256 << 20;
/// Bytes of the description of a label picture, and of a truth.
pub(crate) const LABEL_TEXT: u64 = 64 << 20;
/// Files in a folder of label pictures.
pub(crate) const LABEL_FILES: usize = 1_000_000;
/// Bytes of a label picture's file.
pub(crate) const LABEL_FILE: u64 = 1 << 30;

/// Refuses a city whose ground would not fit the memory: few triangles that lie far apart.
pub(crate) fn check_city(report: &SplitReport, params: &Params) -> Result<(), PipelineError> {
    let (width, height) = (report.max[0] - report.min[0], report.max[1] - report.min[1]);
    let cell = params.segmentation.terrain_cell;
    let cells = (width / cell).ceil() * (height / cell).ceil();
    if cells <= GROUND_CELLS {
        return Ok(());
    }
    Err(PipelineError::Input(format!(
        "the mesh measures {:.1} × {:.1} km, whose ground would have {:.0} million cells of {cell} m, more than {:.0} million: \
         leave out what lies far off, cut the city in parts, or set a larger segmentation.terrain_cell",
        width / 1e3,
        height / 1e3,
        cells / 1e6,
        GROUND_CELLS / 1e6
    )))
}
