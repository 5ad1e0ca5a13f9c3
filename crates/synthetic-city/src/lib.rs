#![doc = include_str!("../README.md")]

mod bins;
pub mod calibration;
mod error;
mod look;
mod noise;
mod output;
mod params;
mod scene;
mod sensing;
mod synthesise;
mod texture;

pub use error::SynthError;
pub use look::{Look, Season};
pub use params::{Source, SynthParams, SynthProgress, SynthReport};
pub use scene::Scene;
pub use scene::building::{Covering, Rim, RoofFace, SceneBuilding, Style};
pub use scene::case::RoofCase;
pub use scene::objects::{Clutter, Cover, Patch, Species, Thing, Tree};
pub use scene::place::{Feature, Place, Quarter};
pub use scene::primitive::{Oblong, Primitive, Rise};
pub use scene::relief::Relief;
pub use sensing::TriMesh;
pub use sensing::columns::Class;
pub use sensing::decimate::decimate;
pub use synthesise::{mesh_of, scene, synthesise};
