//! CityJSONSeq: a header, then one feature a line.

use super::objects;
use super::schema::{CityObject, VertexPool};
use super::write::{Header, to_json};
use crate::{Building, CityModel, Error, Terrain};
use std::io::Write;

/// Writes CityJSONSeq 2.0 building by building: what was written is forgotten, so memory is bounded by the largest
/// building. The geometries are those of [`super::write_cityjson`]. Identifiers must be unique; that is not checked.
pub struct SeqWriter<W: Write> {
    out: W,
    origin: [f64; 3],
    pool: VertexPool,
}

impl<W: Write> SeqWriter<W> {
    /// Writes the first line: transform and metadata. Give a buffered stream.
    ///
    /// # Errors
    /// If the stream fails.
    pub fn new(mut out: W, header: &Header) -> Result<Self, Error> {
        header.open(&mut out)?;
        out.write_all(b",\"CityObjects\":{},\"vertices\":[]}\n")?;
        Ok(Self { out, origin: header.origin, pool: VertexPool::new(header.corner()) })
    }

    /// Writes a building as one feature.
    ///
    /// # Errors
    /// As [`super::write_cityjson`], for this building; nothing of it is written then.
    pub fn write_building(&mut self, building: &Building) -> Result<(), Error> {
        self.pool.clear();
        let objects = objects::building(building, self.origin, &mut self.pool)?;
        self.feature(&building.id, &objects)
    }

    /// Writes terrain as one feature.
    ///
    /// # Errors
    /// As [`super::write_cityjson`], for the terrain; nothing of it is written then.
    pub fn write_terrain(&mut self, terrain: &Terrain) -> Result<(), Error> {
        self.pool.clear();
        let relief = objects::terrain(terrain, self.origin, &mut self.pool)?;
        self.feature(&terrain.id, &[(terrain.id.clone(), relief)])
    }

    /// Writes terrain and buildings of a model that has the header's origin.
    ///
    /// # Errors
    /// As [`super::write_cityjson`], and if the model's origin is another.
    pub fn write_model(&mut self, model: &CityModel) -> Result<(), Error> {
        if model.origin != self.origin {
            let reason = format!("the model's origin {:?} is not the header's {:?}", model.origin, self.origin);
            return Err(Error::object(&model.title, reason));
        }
        if let Some(terrain) = &model.terrain {
            self.write_terrain(terrain)?;
        }
        model.buildings.iter().try_for_each(|building| self.write_building(building))
    }

    /// Flushes and gives the stream back.
    ///
    /// # Errors
    /// If the stream fails.
    pub fn finish(mut self) -> Result<W, Error> {
        self.out.flush()?;
        Ok(self.out)
    }

    fn feature(&mut self, id: &str, objects: &[(String, CityObject<'_>)]) -> Result<(), Error> {
        let out = &mut self.out;
        out.write_all(b"{\"type\":\"CityJSONFeature\",\"id\":")?;
        to_json(&mut *out, id)?;
        out.write_all(b",\"CityObjects\":{")?;
        for (k, (name, object)) in objects.iter().enumerate() {
            if k > 0 {
                out.write_all(b",")?;
            }
            to_json(&mut *out, name)?;
            out.write_all(b":")?;
            to_json(&mut *out, object)?;
        }
        out.write_all(b"},\"vertices\":")?;
        to_json(&mut *out, &self.pool.vertices)?;
        Ok(out.write_all(b"}\n")?)
    }
}
