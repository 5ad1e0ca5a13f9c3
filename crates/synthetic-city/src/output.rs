//! Files: OBJ tiles as photogrammetry programs write them, and the truth beside them.

pub(crate) mod obj;
pub(crate) mod truth;
