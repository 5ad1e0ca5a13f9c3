#![doc = include_str!("../README.md")]

mod raster;
mod window;

pub use raster::Raster;
pub use window::GridWindow;
