//! Planes of roofs and walls of one building.
//!
//! - [`detect()`]: roof planes on the height map, by region growing and model selection; [`ransac`] is
//!   the published detector.
//! - [`regularise()`]: soft regularities between them; [`roof_directions`]: the published directions and better ones.
//! - [`facade_directions`]: frames of orthogonal walls.
//! - [`vsa`]: walls from steep facets, and their [`facade_segments`] on the ground.

mod clean;
mod divide;
mod equalise;
pub mod facade_directions;
mod facade_segments;
pub mod grow;
mod local_fit;
mod merge;
mod partition;
mod plane_fit;
pub mod ransac;
pub mod regularise;
pub mod roof_directions;
mod roof_plane;
mod seed_regions;
mod soup;
pub mod vsa;

pub use facade_directions::Frame;
pub use facade_segments::{Region, facade_segments};
pub use grow::{Params, detect};
pub use regularise::regularise;
pub use roof_directions::RoofDirection;
pub use roof_plane::{Planes, RoofPlane, UNASSIGNED};
pub use soup::Triangle;
