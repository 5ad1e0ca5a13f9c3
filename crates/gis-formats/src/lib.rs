#![doc = include_str!("../README.md")]

mod error;
mod features;
mod flat_geobuf;
mod geo_json;
mod geo_package;
mod georeference;
pub mod geotiff;

pub use error::Error;
pub use features::{Column, ColumnKind, Feature, LayerInfo, Schema};
pub use flat_geobuf::FlatGeobuf;
pub use geo_json::GeoJson;
pub use geo_package::GeoPackage;
pub use georeference::GeoReference;

/// A height in the steps in which rasters have it (2⁻¹⁰ m).
#[must_use]
pub fn raster_height(height: f64) -> f32 {
    geotiff::rounded(height)
}
