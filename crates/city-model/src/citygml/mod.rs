//! CityGML 2.0 and 3.0: streaming writers; a reader for the buildings and terrain of 1.0 and 2.0.

mod element;
mod metadata;
mod names;
mod read;
mod surfaces;
mod version3;
mod write;
mod xml;

pub use read::read_citygml;
pub use version3::write_citygml3;
pub use write::{GmlWriter, write_citygml, write_citygml_file};
