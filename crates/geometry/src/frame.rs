//! The local frame in which all work is done.

use crate::{Crs, DVec3};
use serde::{Deserialize, Serialize};

/// A shift from world to local coordinates, with the reference system of the world ones.
///
/// The origin is a whole number of metres, so that the shift is exact for projected coordinates and
/// the pixel lattice (multiples of the step from the local origin) is the same however the city is
/// cut into blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// World coordinates of the local origin, whole metres.
    pub origin: [f64; 3],
    /// Reference system of the world coordinates.
    pub crs: Crs,
}

impl Frame {
    /// A frame whose origin is `near` rounded down to whole metres (z stays 0, heights are kept as they are).
    #[must_use]
    pub fn near(near: DVec3, crs: Crs) -> Self {
        Self { origin: [near.x.floor(), near.y.floor(), 0.0], crs }
    }

    /// World to local.
    #[must_use]
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        world - DVec3::from_array(self.origin)
    }

    /// Local to world.
    #[must_use]
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        local + DVec3::from_array(self.origin)
    }
}
