//! planes
mod clean;
mod divide;
pub mod grow;
mod local_fit;
mod partition;
mod roof_plane;
mod seed_regions;

pub use roof_plane::{Planes, RoofPlane, UNASSIGNED};
