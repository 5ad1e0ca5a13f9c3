#![doc = include_str!("../README.md")]

mod orthograph;
mod raster;
mod sample;
mod scan;
mod steep;
mod texture;
mod texture_cache;
mod walls;

pub use orthograph::{Orthograph, WallEvidence, quantised_normal};
pub use raster::{GridWindow, Raster};
pub use sample::{SampleParams, sample};
pub use steep::{Facet, steep_facets};
pub use texture::{PlainColours, Texture, TextureSource};
pub use texture_cache::{DecodedImage, LoadError, TextureCache};
