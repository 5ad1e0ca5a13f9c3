#![doc = include_str!("../README.md")]

mod bytes;
mod codec;
mod defects;
mod error;
mod extent;
mod file;
mod fit;
mod grid;
mod spill;
mod split;
mod triangle;

pub use defects::Defects;
pub use error::BlocksError;
pub use extent::Outliers;
pub use file::{MAGIC, VERSION, read_block, write_block};
pub use grid::{BlockCore, BlockGrid, GridSpec};
pub use split::{BlockEntry, SplitOptions, SplitReport, split};
pub use triangle::{BlockMesh, BlockTriangle, UNITS_PER_METRE};
