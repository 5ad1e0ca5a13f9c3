//! FlatGeobuf 3: features along a Hilbert curve behind a spatial index, for reading a part of a file over the network.

use crate::{ColumnKind, Error, Feature, GeoReference, LayerInfo};
use flatgeobuf::geozero::error::GeozeroError;
use flatgeobuf::geozero::{ColumnValue, FeatureProcessor as _, GeomProcessor, PropertyProcessor as _};
use flatgeobuf::{ColumnType, FgbCrs, FgbWriter, FgbWriterOptions, GeometryType};
use gable_city_model::Value;
use std::io::Write;

/// A FlatGeobuf that is being written; features wait in a nameless temporary file.
pub struct FlatGeobuf {
    writer: FgbWriter<'static>,
    info: LayerInfo,
}

impl FlatGeobuf {
    /// Begins a file of one layer.
    ///
    /// # Errors
    /// If the temporary file cannot be made.
    pub fn new(place: &GeoReference, info: &LayerInfo) -> Result<Self, Error> {
        let (text, name) = (place.text(), place.name());
        let is_known = text.is_some() || place.plane().is_some();
        let crs = FgbCrs {
            org: place.plane().map(|_| "EPSG"),
            code: place.plane().and_then(|code| i32::try_from(code).ok()).unwrap_or(0),
            name: is_known.then_some(name.as_str()),
            wkt: text.as_deref(),
            ..FgbCrs::default()
        };
        let kind = if info.is_multi { GeometryType::MultiPolygon } else { GeometryType::Polygon };
        let options = FgbWriterOptions {
            detect_type: false,
            promote_to_multi: false,
            has_z: info.has_heights,
            description: Some(info.description),
            crs,
            ..FgbWriterOptions::default()
        };
        let mut writer = FgbWriter::create_with_options(info.name, kind, options).map_err(wrong)?;
        for column in &info.columns {
            let kind = match column.kind {
                ColumnKind::Boolean => ColumnType::Bool,
                ColumnKind::Integer => ColumnType::Long,
                ColumnKind::Number => ColumnType::Double,
                ColumnKind::Text => ColumnType::String,
            };
            writer.add_column(&column.name, kind, |_, _| {});
        }
        Ok(Self { writer, info: info.clone() })
    }

    /// Adds a feature.
    ///
    /// # Errors
    /// If the temporary file cannot be written.
    pub fn add(&mut self, feature: &Feature) -> Result<(), Error> {
        self.put(feature).map_err(wrong)
    }

    /// Writes the file.
    ///
    /// # Errors
    /// If a stream fails.
    pub fn write(self, out: impl Write) -> Result<(), Error> {
        self.writer.write(out).map_err(wrong)
    }

    fn put(&mut self, feature: &Feature) -> Result<(), GeozeroError> {
        let writer = &mut self.writer;
        if self.info.is_multi {
            writer.multipolygon_begin(feature.polygons.len(), 0)?;
        }
        for (number, rings) in feature.polygons.iter().enumerate() {
            writer.polygon_begin(!self.info.is_multi, rings.len(), number)?;
            for (r, ring) in rings.iter().enumerate() {
                writer.linestring_begin(false, ring.len(), r)?;
                for (i, &[x, y, z]) in ring.iter().enumerate() {
                    if self.info.has_heights {
                        writer.coordinate(x, y, Some(z), None, None, None, i)?;
                    } else {
                        writer.xy(x, y, i)?;
                    }
                }
                writer.linestring_end(false, r)?;
            }
            writer.polygon_end(!self.info.is_multi, number)?;
        }
        if self.info.is_multi {
            writer.multipolygon_end(0)?;
        }
        for (i, (column, value)) in self.info.columns.iter().zip(&feature.values).enumerate() {
            let value = match value {
                None => continue,
                Some(Value::Bool(b)) => ColumnValue::Bool(*b),
                Some(Value::Integer(n)) => ColumnValue::Long(*n),
                Some(Value::Number(n)) => ColumnValue::Double(*n),
                Some(Value::Text(text)) => ColumnValue::String(text),
            };
            writer.property(i, &column.name, &value)?;
        }
        writer.feature_end(0)
    }
}

fn wrong(error: impl std::fmt::Display) -> Error {
    Error::FlatGeobuf(error.to_string())
}
