//! City objects, ISO 19107 validation, CityJSON, CityJSONSeq and CityGML.

mod model;

pub use model::{Attributes, Building, CityModel, Face, Lods, Semantic, Shell, Terrain, Value};
