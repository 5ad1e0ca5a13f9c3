#![doc = include_str!("../README.md")]

mod collapse;
mod creases;
mod eaves;
mod extrude;
mod facades;
mod faces;
mod fill;
mod input;
mod joining;
mod junctions;
mod leaks;
mod lods;
mod mend;
mod methods;
mod model;
mod nesting;
mod params;
mod partition;
mod party_walls;
mod reason;
mod roof;
mod roof_partition;
mod steps;
mod subdivide;
mod superstructures;
mod surface;
mod under_trees;
mod webs;
mod work;

pub use input::{BuildingInput, KnownRoof, MARGIN};
pub use methods::{METHODS, Needs, PlanesFirst, Reconstruction, Zhu2018};
pub use model::{BuildingModel, model};
pub use params::ModelParams;
pub use reason::Reason;
pub use roof::RoofType;
pub use roof_partition::RoofPartition;

#[cfg(test)]
mod tests;
