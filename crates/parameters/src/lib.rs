#![doc = include_str!("../README.md")]

mod declaration;
mod kind;
mod settings;

pub use declaration::{Declaration, Parameters, Reading, Wrong};
pub use kind::{ANY, Bounds, Choice, Kind, within};
pub use settings::Settings;
