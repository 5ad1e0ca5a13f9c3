//! Rasters over the absolute pixel lattice, and the orthograph: colour, height, normal and wall
//! evidence of a mesh seen from above (Zhu 2018, §4).

mod raster;

pub use raster::{GridWindow, Raster};
