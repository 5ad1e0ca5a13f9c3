#![doc = include_str!("../README.md")]

mod budget;
mod citygml;
mod cityjson;
mod error;
mod glb;
mod metadata;
mod model;
mod obj;
mod projection;
mod quantise;
mod read;
mod semantics;
mod shell;
mod surface_kinds;
pub mod tiles3d;
mod tin;
mod triangulate;
pub mod validate;

pub use citygml::{GmlWriter, read_citygml, write_citygml, write_citygml_file, write_citygml3};
pub use cityjson::{Header, SeqWriter, read_cityjson, read_cityjson_str, write_cityjson, write_cityjson_file};
pub use error::{Error, Note, ReadOptions, Reading};
pub use glb::write_glb;
pub use metadata::Metadata;
pub use model::{Attributes, Building, CityModel, Face, Lods, Semantic, Shell, Terrain, Value};
pub use obj::{write_mtl, write_obj};
pub use quantise::{STEPS_PER_METRE, from_lattice, lattice, quantised};
pub use read::read_city_model;
pub use tin::{TinError, tin_from_grid};
pub use triangulate::{FaceTriangle, triangulate, triangulate_face};
pub use validate::{Code, Issue, Tolerances, validate_shell, validate_solid};
