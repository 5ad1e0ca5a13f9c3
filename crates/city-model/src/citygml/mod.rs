//! CityGML 2.0: a streaming writer; a reader for the buildings and terrain of 1.0 and 2.0.

mod element;
mod names;
mod read;
mod surfaces;
mod write;
mod xml;

pub use read::read_citygml;
pub use write::{GmlWriter, write_citygml, write_citygml_file};
