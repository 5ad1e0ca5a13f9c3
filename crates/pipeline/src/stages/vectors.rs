//! Footprints and roof surfaces for geographic information systems: GeoPackage, FlatGeobuf, GeoJSON.
//!
//! The models are read tile by tile, once for the columns of the tables and then for each file, so that no more than a tile is in memory.

use super::Context;
use super::model::{self, Tile};
use super::split::Blocks;
use crate::params::{Format, Params};
use crate::summary::Lod;
use crate::{PipelineError, Stage, artefact};
use gable_city_model::Building;
use gable_geometry::Crs;
use gable_gis_formats::{Error, Feature, FlatGeobuf, GeoJson, GeoPackage, GeoReference, LayerInfo, Schema};
use gable_reference_systems::Projection;
use std::path::Path;

/// The files that there may be, relative to the result.
pub(crate) const FILES: [&str; 5] =
    [PACKAGE, "footprints.fgb", "roof_surfaces.fgb", "footprints.geojson", "roof_surfaces.geojson"];

const PACKAGE: &str = "city.gpkg";

/// Whether any of the files is wanted.
pub(crate) fn are_wanted(params: &Params) -> bool {
    let vectors = [Format::GeoPackage, Format::FlatGeobuf, Format::GeoJson];
    vectors.iter().any(|format| params.output.formats.contains(format))
}

/// The way to longitude and latitude, without which there is no GeoJSON.
pub(crate) fn projection(crs: &Crs) -> Option<Projection> {
    Projection::of(crs)
}

/// Writes the files that are wanted; returns their names relative to `out`.
pub(crate) fn write(
    context: &Context<'_>,
    blocks: &Blocks,
    tiles: &[&Tile],
    out: &Path,
) -> Result<Vec<String>, PipelineError> {
    if !are_wanted(context.params) {
        return Ok(Vec::new());
    }
    let mut schema = Schema::default();
    let city = City { context, tiles, origin: blocks.frame().origin };
    city.each(&mut |building| {
        schema.see(building);
        Ok(())
    })?;
    let crs = &blocks.frame().crs;
    let place = GeoReference::of(crs);
    let layers = [schema.footprints(), schema.roofs()];
    let mut files = Vec::new();
    for format in &context.params.output.formats {
        match format {
            Format::GeoPackage => {
                city.package(&schema, &layers, &place, &out.join(PACKAGE))?;
                files.push(PACKAGE.to_owned());
            }
            Format::FlatGeobuf => {
                for (number, layer) in layers.iter().enumerate() {
                    let name = format!("{}.fgb", layer.name);
                    city.flat(&schema, number, layer, &place, &out.join(&name))?;
                    files.push(name);
                }
            }
            Format::GeoJson => {
                for (number, layer) in layers.iter().enumerate() {
                    // That there is none is among the warnings.
                    let Some(projection) = projection(crs) else { continue };
                    let name = format!("{}.geojson", layer.name);
                    city.json(&schema, number, layer, projection, &out.join(&name))?;
                    files.push(name);
                }
            }
            _ => {}
        }
    }
    Ok(files)
}

/// The buildings of a city, tile by tile.
struct City<'a> {
    context: &'a Context<'a>,
    tiles: &'a [&'a Tile],
    origin: [f64; 3],
}

impl City<'_> {
    /// Shows each building that is written.
    fn each(&self, visit: &mut dyn FnMut(&Building) -> Result<(), PipelineError>) -> Result<(), PipelineError> {
        for tile in self.tiles {
            self.context.check_cancelled()?;
            for modelled in model::read(tile)?.iter().filter(|m| m.record.lod != Lod::None) {
                visit(&modelled.building)?;
            }
        }
        Ok(())
    }

    /// Hands each feature of a layer, by its number, to a file of this name.
    fn features(
        &self,
        schema: &Schema,
        layer: usize,
        name: &str,
        add: &mut dyn FnMut(&Feature) -> Result<(), Error>,
    ) -> Result<(), PipelineError> {
        self.each(&mut |building| {
            let features = match layer {
                0 => schema.footprint(building, self.origin).into_iter().collect(),
                _ => schema.roof_surfaces(building, self.origin),
            };
            features.iter().try_for_each(&mut *add).map_err(|e| self.wrong(name, &e))
        })
    }

    fn wrong(&self, name: &str, error: &Error) -> PipelineError {
        self.context.failed(Stage::Write, name, error)
    }

    fn package(
        &self,
        schema: &Schema,
        layers: &[LayerInfo],
        place: &GeoReference,
        path: &Path,
    ) -> Result<(), PipelineError> {
        let io = |source| PipelineError::Io { path: path.to_owned(), source };
        // Written under another name, as all files are; an earlier try may have left one.
        let part = path.with_extension("gpkg.part");
        match std::fs::remove_file(&part) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(io(error)),
            _ => {}
        }
        let wrong = |error: Error| self.wrong(PACKAGE, &error);
        let mut package = GeoPackage::create(&part, place, layers).map_err(wrong)?;
        for layer in 0..layers.len() {
            self.features(schema, layer, PACKAGE, &mut |feature| package.add(layer, feature))?;
        }
        package.finish().map_err(wrong)?;
        std::fs::rename(&part, path).map_err(io)
    }

    fn flat(
        &self,
        schema: &Schema,
        number: usize,
        layer: &LayerInfo,
        place: &GeoReference,
        path: &Path,
    ) -> Result<(), PipelineError> {
        let wrong = |error: Error| self.wrong(layer.name, &error);
        let mut file = FlatGeobuf::new(place, layer).map_err(wrong)?;
        self.features(schema, number, layer.name, &mut |feature| file.add(feature))?;
        let mut failure = None;
        let written = artefact::write_with(path, |out| {
            failure = file.write(out).err();
            if failure.is_some() { Err(std::io::Error::other("not written")) } else { Ok(()) }
        });
        written.map_err(|error| failure.map_or(error, wrong))
    }

    fn json(
        &self,
        schema: &Schema,
        number: usize,
        layer: &LayerInfo,
        projection: Projection,
        path: &Path,
    ) -> Result<(), PipelineError> {
        let mut failure = None;
        let written = artefact::write_with(path, |out| {
            let fill = || {
                let mut file = GeoJson::new(out, projection, layer);
                self.features(schema, number, layer.name, &mut |feature| file.add(feature))?;
                file.finish().map_err(|error| self.wrong(layer.name, &error))
            };
            failure = fill().err();
            if failure.is_some() { Err(std::io::Error::other("not written")) } else { Ok(()) }
        });
        written.map_err(|error| failure.unwrap_or(error))
    }
}
