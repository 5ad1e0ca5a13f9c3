#![doc = include_str!("../README.md")]

mod bilinear;
mod box_filter;
mod components;
mod distance;
mod fill;
mod flood;
mod morphology;
mod neighbours;
mod raster;
mod square_cores;
mod window;
mod window_plane;

pub use bilinear::bilinear;
pub use box_filter::{box_max, box_mean, box_min};
pub use components::{BorderTraces, Component, Components, components, components_where};
pub use distance::squared_distance;
pub use fill::fill_missing;
pub use flood::flood;
pub use morphology::{close, dilate, erode, open};
pub use neighbours::{Connectivity, around, around_inner, around_place, sides, square};
pub use raster::Raster;
pub use square_cores::square_cores;
pub use window::GridWindow;
pub use window_plane::{WindowPlane, WindowSums, plane_residual, window_planes};
