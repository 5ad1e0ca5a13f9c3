//! Detected roof planes.

use gable_geometry::{DVec3, Plane};
use gable_raster::Raster;

/// Label of a pixel that belongs to no plane.
pub const UNASSIGNED: u16 = u16::MAX;

/// A plane with the pixels that support it.
#[derive(Clone, Debug, PartialEq)]
pub struct RoofPlane {
    /// The plane, in the coordinates of the raster.
    pub plane: Plane,
    /// Pixels that belong to it.
    pub inliers: usize,
    /// Their area on the ground, m².
    pub area: f64,
    /// Root mean square of their orthogonal distances to the plane, metres.
    pub rms: f64,
    /// Their centroid.
    pub centroid: DVec3,
}

/// The planes of a building and the pixels of each.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    /// Planes, the largest first.
    pub planes: Vec<RoofPlane>,
    /// Index of the plane of each pixel, or [`UNASSIGNED`].
    pub labels: Raster<u16>,
    /// Whether the search ended before its time, having held as many regions against each other as it may: then one plane may
    /// have been found as several.
    pub cut_short: bool,
}
