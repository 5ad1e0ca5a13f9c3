//! The buildings of a finished city, as those want them who keep a city fresh: with a hash that tells whether one changed.

use crate::summary::BuildingRecord;
use gable_city_model::{Attributes, Building, Lods, Shell};
use gable_geometry::{DVec3, Frame};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A building that was written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CityBuilding {
    /// Identifier, the same from run to run.
    pub id: String,
    /// Hash of its geometries and attributes; the tile that owns it and its notes do not count.
    pub hash: String,
    /// Column and row of the tile that owns it.
    pub tile: [u32; 2],
    /// West, south, east, north; world coordinates, metres.
    pub bbox: [f64; 4],
    /// The best LOD that was written, such as `lod2`.
    pub lod: String,
    /// Roof type.
    pub roof_type: Option<String>,
    /// Highest roof point above the ground, metres.
    pub height_m: f64,
    /// Footprint area, m².
    pub area_m2: f64,
    /// Its attributes.
    pub attributes: Attributes,
}

/// Attributes that say where a building stands among blocks, and not what it is.
const OF_BLOCKS: [&str; 2] = ["block", "note"];

/// The buildings that were written, with their records.
pub(super) fn buildings(written: &[Building], records: &[BuildingRecord], frame: &Frame) -> Vec<CityBuilding> {
    let records: BTreeMap<&str, &BuildingRecord> = records.iter().map(|r| (r.id.as_str(), r)).collect();
    let of = |building: &Building| {
        let record = records.get(building.id.as_str())?;
        Some(CityBuilding {
            id: building.id.clone(),
            hash: hash(building, frame),
            tile: record.tile,
            bbox: record.bbox,
            lod: serde_json::to_value(record.lod).ok()?.as_str()?.to_owned(),
            roof_type: record.roof_type.clone(),
            height_m: record.height_m,
            area_m2: record.area_m2,
            attributes: building.attributes.clone(),
        })
    };
    written.iter().filter_map(of).collect()
}

/// Coordinates count in the steps in which they are written (0.1 mm) and in the world, so that a local frame that moved
/// changes nothing.
fn hash(building: &Building, frame: &Frame) -> String {
    let origin = DVec3::from_array(frame.origin);
    let mut hasher = blake3::Hasher::new();
    let mut number = |n: i64| {
        hasher.update(&n.to_le_bytes());
    };
    let mut shell = |shell: &Shell| {
        number(shell.vertices.len() as i64);
        for vertex in &shell.vertices {
            ((*vertex + origin) * 1e4).to_array().iter().for_each(|c| number(c.round() as i64));
        }
        number(shell.faces.len() as i64);
        for face in &shell.faces {
            number(face.semantic as i64);
            number(face.rings.len() as i64);
            for ring in &face.rings {
                number(ring.len() as i64);
                ring.iter().for_each(|&v| number(i64::from(v)));
            }
        }
    };
    let Lods { footprint, roof_edge, lod1, lod2 } = &building.lods;
    for list in [footprint.as_slice(), roof_edge.as_slice(), lod1, lod2] {
        list.iter().for_each(&mut shell);
        shell(&Shell::default());
    }
    let attributes: Attributes = building
        .attributes
        .iter()
        .filter(|(k, _)| !OF_BLOCKS.contains(&k.as_str()))
        .map(|(k, v)| (k.clone(), v.clone()))
        .collect();
    // Texts, numbers and truth values by name: always JSON.
    hasher.update(&serde_json::to_vec(&attributes).unwrap_or_default());
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_city_model::{Face, Semantic, Value};
    use gable_geometry::{Crs, dvec3};

    fn house(height: f64, shift: f64) -> Building {
        let vertices = vec![dvec3(shift, 0.0, height), dvec3(shift + 4.0, 0.0, height), dvec3(shift, 3.0, height)];
        let face = Face { semantic: Semantic::RoofSurface, rings: vec![vec![0, 1, 2]], attributes: Attributes::new() };
        let attributes =
            [("block", "3_4"), ("roof_type", "flat")].map(|(k, v)| (k.to_owned(), Value::Text(v.to_owned())));
        let lods = Lods { roof_edge: Some(Shell { vertices, faces: vec![face] }), ..Lods::default() };
        Building { id: "b".to_owned(), attributes: attributes.into(), lods }
    }

    #[test]
    fn the_hash_tells_a_change_of_the_building_and_no_other() {
        let frame = |x| Frame { origin: [x, 0.0, 0.0], crs: Crs::Unknown };
        let first = hash(&house(5.0, 0.0), &frame(1000.0));
        assert_eq!(first, hash(&house(5.0, -7.0), &frame(1007.0)), "a frame that moved");
        assert_ne!(first, hash(&house(5.0, 1.0), &frame(1000.0)));
        assert_ne!(first, hash(&house(5.1, 0.0), &frame(1000.0)));
        let mut other = house(5.0, 0.0);
        other.attributes.insert("block".to_owned(), Value::Text("7_7".to_owned()));
        assert_eq!(first, hash(&other, &frame(1000.0)));
        other.attributes.insert("roof_type".to_owned(), Value::Text("hip".to_owned()));
        assert_ne!(first, hash(&other, &frame(1000.0)));
    }
}
