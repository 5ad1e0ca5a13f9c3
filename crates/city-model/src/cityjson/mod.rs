//! CityJSON 2.0 and CityJSONSeq: writers of 2.0, readers of 0.3 to 2.0.

mod objects;
mod read;
mod schema;
mod schema_in;
mod sequence;
mod write;

pub use read::{read_cityjson, read_cityjson_str};
pub use sequence::SeqWriter;
pub use write::{Header, write_cityjson, write_cityjson_file};

pub(crate) use objects::{part_id, semantic_name};
pub(crate) use read::merge;
pub(crate) use schema::clean;
