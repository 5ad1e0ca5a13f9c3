//! 3D Tiles 1.1: buildings and terrain as GLB with feature tables, the mesh that they were made from, and the tilesets that hold them.
//!
//! A tile of the city becomes a [`Content`] for each level of detail ([`buildings_content`], from afar of [`boxes`], [`terrain_content`],
//! [`ColouredSurface::content`]); what is known of it
//! ([`Layer`]) goes into tilesets ([`write_tileset`]), so that neither needs more than one tile in memory.
//!
//! - **Frame.** Tiles are in local metres, z up. The root's `transform` takes them to Earth-centred coordinates (EPSG:4978) where the
//!   reference system is known ([`earth_transform`]); without one the tileset has a local frame, its origin at the world coordinates
//!   that `asset.extras` tells. glTF has y up, so contents are turned as the standard asks.
//! - **Precision.** Positions are f32 about a whole metre near the middle of the tile, which the node's translation gives back: below
//!   0.02 mm in a tile of 300 m.
//! - **Features.** `EXT_mesh_features` numbers buildings (set 0) and their surfaces (set 1), `EXT_structural_metadata` has a table of
//!   each with every attribute of the model.
//! - **Order.** The same model gives the same bytes.

pub(crate) mod content;
mod earth;
mod far;
pub(crate) mod glb;
mod metadata;
mod surface;
mod tileset;

pub use content::{Content, GroundTexture, TileLod, block_error, buildings_content, terrain_content};
pub use earth::earth_transform;
pub use far::boxes;
pub use surface::ColouredSurface;
pub use tileset::{Layer, LayerLevel, Overview, TileLayer, TilesetHeader, quadtree, write_tileset};

#[cfg(test)]
mod tests;
