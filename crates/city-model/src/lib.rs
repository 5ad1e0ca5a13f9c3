#![doc = include_str!("../README.md")]

mod budget;
mod citygml;
mod cityjson;
mod error;
mod model;
mod projection;
mod quantise;
mod read;
mod semantics;
mod shell;
pub mod tiles3d;
mod tin;
mod triangulate;
pub mod validate;

pub use citygml::{GmlWriter, read_citygml, write_citygml, write_citygml_file};
pub use cityjson::{Header, SeqWriter, read_cityjson, read_cityjson_str, write_cityjson, write_cityjson_file};
pub use error::{Error, Note, ReadOptions, Reading};
pub use model::{Attributes, Building, CityModel, Face, Lods, Semantic, Shell, Terrain, Value};
pub use quantise::{STEPS_PER_METRE, from_lattice, lattice, quantised};
pub use read::read_city_model;
pub use tin::{TinError, tin_from_grid};
pub use triangulate::{FaceTriangle, triangulate, triangulate_face};
pub use validate::{Code, Issue, Tolerances, validate_shell, validate_solid};
