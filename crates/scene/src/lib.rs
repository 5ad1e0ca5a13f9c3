#![doc = include_str!("../README.md")]

mod budget;
mod counts;
mod error;
mod glb;
mod gltf;
mod gltf_accessor;
mod gltf_visits;
mod library;
mod line_blocks;
mod material;
mod metadata;
mod mtl;
mod number;
mod obj;
mod obj_chunk;
mod off;
mod paged;
mod ply;
mod ply_header;
mod scene;
mod sink;
mod survey;
mod texture;
mod tokens;
mod transform;
mod triangle;
mod uri;

pub use counts::{Counts, Warning, WarningKind, Warnings};
pub use error::{Place, SceneError};
pub use material::{GREY, Material, TextureSource};
pub use scene::{Content, OpenOptions, Scene, Up};
pub use texture::{decode_image, load_texture, texture_bytes};
pub use triangle::Triangle;
