#![doc = include_str!("../README.md")]

mod clean;
mod corner_colours;
mod despike;
mod file;
mod fill_holes;
mod orthograph;
mod sample;
mod scan;
mod steep;
mod texture;
mod texture_cache;
mod walls;

pub use clean::{CleanParams, clean};
pub use corner_colours::CornerColours;
pub use despike::{DespikeParams, despike};
pub use file::OrthoError;
pub use fill_holes::fill_holes;
pub use orthograph::{Orthograph, WallEvidence, quantised_normal};
pub use sample::{SampleParams, sample};
pub use steep::{Facet, steep_facets};
pub use texture::{PlainColours, Texture, TextureSource};
pub use texture_cache::{DecodedImage, LoadError, TextureCache};
