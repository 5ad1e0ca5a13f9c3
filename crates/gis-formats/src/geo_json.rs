//! GeoJSON (RFC 7946): longitude and latitude in WGS 84, without heights, which would have to be ellipsoidal.

use crate::{Error, Feature, LayerInfo};
use gable_city_model::Value;
use gable_reference_systems::Projection;
use geojson::{FeatureWriter, GeometryValue, JsonObject, JsonValue};
use std::io::Write;

/// Digits of a degree: about a centimetre.
const DIGITS: f64 = 1e7;

/// A GeoJSON that is being written, feature by feature.
pub struct GeoJson<W: Write> {
    writer: FeatureWriter<W>,
    projection: Projection,
    info: LayerInfo,
}

impl<W: Write> GeoJson<W> {
    /// Begins a file of one layer. Give a buffered stream.
    pub fn new(out: W, projection: Projection, info: &LayerInfo) -> Self {
        Self { writer: FeatureWriter::from_writer(out), projection, info: info.clone() }
    }

    /// Adds a feature.
    ///
    /// # Errors
    /// If the stream fails, or a point has no longitude and latitude.
    pub fn add(&mut self, feature: &Feature) -> Result<(), Error> {
        let mut polygons = Vec::new();
        for rings in &feature.polygons {
            let mut polygon = Vec::new();
            for ring in rings {
                let points: Result<Vec<_>, Error> = ring.iter().map(|point| self.place(point)).collect();
                polygon.push(points?);
            }
            polygons.push(polygon);
        }
        let geometry = match polygons.pop() {
            Some(only) if polygons.is_empty() && !self.info.is_multi => GeometryValue::new_polygon(only),
            last => GeometryValue::new_multi_polygon(polygons.into_iter().chain(last)),
        };
        let mut properties = JsonObject::new();
        for (column, value) in self.info.columns.iter().zip(&feature.values) {
            let value = match value {
                None => JsonValue::Null,
                Some(Value::Bool(b)) => (*b).into(),
                Some(Value::Integer(n)) => (*n).into(),
                Some(Value::Number(n)) => (*n).into(),
                Some(Value::Text(text)) => text.as_str().into(),
            };
            properties.insert(column.name.clone(), value);
        }
        let feature = geojson::Feature {
            geometry: Some(geojson::Geometry::new(geometry)),
            properties: Some(properties),
            ..geojson::Feature::default()
        };
        Ok(self.writer.write_feature(&feature)?)
    }

    /// Writes the end.
    ///
    /// # Errors
    /// If the stream fails.
    pub fn finish(mut self) -> Result<(), Error> {
        Ok(self.writer.finish()?)
    }

    fn place(&self, &[x, y, _]: &[f64; 3]) -> Result<[f64; 2], Error> {
        let (longitude, latitude) = self.projection.degrees(x, y).ok_or(Error::Place(x, y))?;
        Ok([longitude, latitude].map(|degrees| (degrees * DIGITS).round() / DIGITS + 0.0))
    }
}
