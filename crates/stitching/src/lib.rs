#![doc = include_str!("../README.md")]

mod components;
mod identity;
mod unite;

pub use components::{Component, TileComponents};
pub use identity::{building_ids, part_id};
pub use unite::{Whole, unite};
