//! Shapes of the ground beyond its smooth relief, each in a file of its own. Truth follows them exactly.

pub(crate) mod court;
pub(crate) mod cutting;
pub(crate) mod embankment;
pub(crate) mod pad;
pub(crate) mod pond;
pub(crate) mod quay;
pub(crate) mod stairs;
pub(crate) mod terraces;

use gable_geometry::DVec2;
use std::fmt::Debug;

/// What changes the height of the ground.
pub(crate) trait Landform: Debug + Send + Sync {
    /// Height at a place where the ground without this form has the height `below`, metres.
    fn height(&self, p: DVec2, below: f64) -> f64;
}

/// From 0 at `from` to 1 at `to`, straight; a wall where both are the same.
pub(crate) fn ramp(from: f64, to: f64, x: f64) -> f64 {
    if from < to { ((x - from) / (to - from)).clamp(0.0, 1.0) } else { f64::from(u8::from(x >= to)) }
}
