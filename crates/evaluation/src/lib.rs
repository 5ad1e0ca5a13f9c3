//! The metrics that judge a city model.

mod city;
mod complexity;
mod distances;
mod evaluation;
mod footprints;
mod height_raster;
mod objects;
mod planes;
mod region;
mod roofs;
mod statistics;
mod tree;
mod triangles;

pub use complexity::{Complexity, PerBuilding, Size};
pub use distances::{CUT, Distances};
pub use evaluation::{AREA_CLASSES, Evaluation, Options, evaluate};
pub use footprints::{Footprints, Overlap};
pub use objects::{COVERED, Detection, Rates};
pub use planes::PlaneMatches;
pub use roofs::Roofs;
pub use statistics::Spread;
