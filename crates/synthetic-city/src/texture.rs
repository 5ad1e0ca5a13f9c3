//! The texture of a tile: an atlas whose texels are painted where they lie on the mesh.

pub(crate) mod atlas;
pub(crate) mod paint;
pub(crate) mod patterns;
pub(crate) mod render;
