#![doc = include_str!("../README.md")]

mod collapse;
mod creases;
mod eaves;
mod extrude;
mod facades;
mod faces;
mod fill;
mod gable;
mod input;
mod joining;
mod junctions;
mod leaks;
mod lods;
mod mend;
mod model;
mod nesting;
mod params;
mod partition;
mod party_walls;
mod roof;
mod steps;
mod subdivide;
mod superstructures;
mod surface;
mod under_trees;
mod webs;
mod work;
mod zhu2018;

pub use input::{BuildingInput, KnownRoof, MARGIN};
pub use model::{BuildingModel, model};
pub use params::{Method, Params};
pub use roof::RoofType;

#[cfg(test)]
mod tests;
