//! What modelling one building needs to know.

use gable_geometry::{DVec3, Plane};
use gable_ortho::WallEvidence;
use gable_raster::{GridWindow, Raster};

/// One building and its surroundings, all on the same window of the pixel lattice. The window should reach a few
/// metres (see [`MARGIN`]) beyond the mask.
#[derive(Clone, Debug)]
pub struct BuildingInput {
    /// Pixels of this building.
    pub mask: Raster<bool>,
    /// Pixels of trees: under them the building may go on.
    pub crowns: Raster<bool>,
    /// Topmost surface, local metres; NaN where there is none.
    pub height: Raster<f32>,
    /// Ground surface, local metres.
    pub terrain: Raster<f32>,
    /// Unit normal of the topmost surface, pointing up.
    pub normal: Raster<[f32; 3]>,
    /// Colour, sRGB; `None` for a mesh without texture.
    pub colour: Option<Raster<[u8; 3]>>,
    /// Steep surface over each pixel.
    pub walls: Raster<WallEvidence>,
    /// The planes of the roof, where they are known beforehand (used by the default method only).
    pub roof: Option<KnownRoof>,
    /// Steep facets in and around the mask, local metres (used by the published method only).
    pub facets: Vec<[DVec3; 3]>,
}

/// Roof planes that need not be found.
#[derive(Clone, Debug)]
pub struct KnownRoof {
    /// The planes, local metres.
    pub planes: Vec<Plane>,
    /// Which of them is uppermost over each pixel of the building's window, `u16::MAX` where none is.
    pub labels: Raster<u16>,
}

/// How far the window of a building should reach beyond its mask, metres.
pub const MARGIN: f64 = 4.0;

impl BuildingInput {
    /// The window that all rasters share.
    #[must_use]
    pub fn window(&self) -> GridWindow {
        self.mask.window()
    }
}
