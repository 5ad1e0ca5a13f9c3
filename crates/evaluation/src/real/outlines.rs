//! Outlines drawn by hand, read from GeoJSON.

use crate::Error;
use crate::region::Ring;
use serde::{Deserialize, Serialize};

/// What a person says of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OutlineClass {
    /// A roof.
    Building,
    /// Crowns.
    Tree,
    /// Lawn, meadow, low plants.
    Grass,
    /// Street, yard, court, bare soil.
    Ground,
    /// Ground or grass, and a person cannot tell which.
    Open,
    /// Water.
    Water,
    /// Surely no building, and no further class.
    Other,
    /// A person cannot tell whether that is a building.
    Unsure,
    /// Limits what is judged.
    Area,
}

impl OutlineClass {
    /// Whether the terrain is the surface here.
    #[must_use]
    pub fn is_open_ground(self) -> bool {
        matches!(self, Self::Ground | Self::Grass | Self::Open)
    }
}

/// A polygon of a truth.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outline {
    pub(crate) class: OutlineClass,
    /// Index into [`Outlines::buildings`]; set for buildings alone.
    pub(crate) building: Option<usize>,
    /// Rings, not closed, the outer one first.
    pub(crate) rings: Vec<Ring>,
}

/// All polygons of a truth, metres in the frame of the mesh. Where polygons overlap, the later one holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outlines {
    pub(crate) outlines: Vec<Outline>,
    /// Names of the buildings, in the order in which they are first met.
    pub(crate) buildings: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Collection {
    #[serde(rename = "type")]
    kind: String,
    features: Vec<Feature>,
}

#[derive(Deserialize)]
struct Feature {
    properties: Properties,
    geometry: Geometry,
}

#[derive(Deserialize)]
struct Properties {
    class: OutlineClass,
    id: Option<String>,
}

#[derive(Deserialize)]
struct Geometry {
    #[serde(rename = "type")]
    kind: String,
    coordinates: Vec<Vec<Vec<f64>>>,
}

impl Outlines {
    /// Reads a GeoJSON `FeatureCollection` of polygons with the property `class`, and `id` for buildings. `file` is named in
    /// errors.
    ///
    /// # Errors
    /// If the text is no such collection, a ring is open or has fewer than three corners, a coordinate is no number, or a building
    /// has no `id`.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let wrong = |what: String| Error::Outlines { file: file.to_owned(), what };
        let collection: Collection = serde_json::from_str(text).map_err(|e| wrong(e.to_string()))?;
        if collection.kind != "FeatureCollection" {
            return Err(wrong(format!("a FeatureCollection is wanted, this is a {}", collection.kind)));
        }
        let mut all = Self::default();
        for (number, feature) in collection.features.into_iter().enumerate() {
            let wrong = |what: &str| wrong(format!("feature {}: {what}", number + 1));
            if feature.geometry.kind != "Polygon" {
                return Err(wrong("its geometry is not a Polygon"));
            }
            let rings = feature.geometry.coordinates.iter().map(|ring| open_ring(ring).map_err(wrong));
            let rings = rings.collect::<Result<Vec<Ring>, Error>>()?;
            if rings.is_empty() {
                return Err(wrong("it has no ring"));
            }
            let building = match (feature.properties.class, feature.properties.id) {
                (OutlineClass::Building, None) => return Err(wrong("a building needs an id")),
                (OutlineClass::Building, Some(id)) => Some(all.building(id)),
                _ => None,
            };
            all.outlines.push(Outline { class: feature.properties.class, building, rings });
        }
        Ok(all)
    }

    /// Adds a polygon of a building.
    pub(crate) fn add_building(&mut self, id: String, rings: Vec<Ring>) {
        let building = Some(self.building(id));
        self.outlines.push(Outline { class: OutlineClass::Building, building, rings });
    }

    /// The number of a building, which is new if its name is.
    fn building(&mut self, id: String) -> usize {
        if let Some(known) = self.buildings.iter().position(|b| *b == id) {
            return known;
        }
        self.buildings.push(id);
        self.buildings.len() - 1
    }

    /// Polygons of a class.
    pub(crate) fn of_class(&self, class: OutlineClass) -> impl Iterator<Item = &Outline> {
        self.outlines.iter().filter(move |o| o.class == class)
    }
}

/// The corners of a closed ring, the first not repeated.
fn open_ring(ring: &[Vec<f64>]) -> Result<Ring, &'static str> {
    let mut corners = Ring::with_capacity(ring.len());
    for position in ring {
        match position[..] {
            [x, y, ..] if x.is_finite() && y.is_finite() => corners.push([x, y]),
            _ => return Err("a position is not two numbers"),
        }
    }
    if corners.len() < 4 || corners.first() != corners.last() {
        return Err("a ring needs at least three corners, and its first one again at its end");
    }
    corners.pop();
    Ok(corners)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A feature that is a rectangle; `id` only if not empty.
    pub(crate) fn rectangle(class: &str, id: &str, [x0, y0, x1, y1]: [f64; 4]) -> serde_json::Value {
        let mut properties = serde_json::json!({ "class": class });
        if !id.is_empty() {
            properties["id"] = id.into();
        }
        serde_json::json!({
            "type": "Feature", "properties": properties,
            "geometry": { "type": "Polygon", "coordinates": [[[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]] },
        })
    }

    pub(crate) fn collection(features: &[serde_json::Value]) -> Outlines {
        let text = serde_json::json!({ "type": "FeatureCollection", "features": features }).to_string();
        Outlines::parse(&text, "test.geojson").unwrap()
    }

    #[test]
    fn polygons_are_read_with_their_classes_and_buildings() {
        let outlines = collection(&[
            rectangle("area", "", [0.0, 0.0, 9.0, 9.0]),
            rectangle("building", "hall", [0.0, 0.0, 1.0, 1.0]),
            rectangle("building", "shed", [2.0, 0.0, 3.0, 1.0]),
            rectangle("building", "hall", [1.0, 0.0, 2.0, 1.0]),
        ]);
        assert_eq!(outlines.buildings, ["hall", "shed"]);
        let buildings: Vec<_> = outlines.outlines.iter().map(|o| o.building).collect();
        assert_eq!(buildings, [None, Some(0), Some(1), Some(0)]);
        assert_eq!(outlines.outlines[1].rings, [vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]]);
        assert_eq!(outlines.of_class(OutlineClass::Area).count(), 1);
    }

    #[test]
    fn what_is_wrong_is_said_with_file_and_feature() {
        let good = rectangle("tree", "", [0.0, 0.0, 1.0, 1.0]);
        let message = |features: serde_json::Value| {
            let text = serde_json::json!({ "type": "FeatureCollection", "features": features }).to_string();
            Outlines::parse(&text, "wood.geojson").unwrap_err().to_string()
        };
        let mut line = good.clone();
        line["geometry"]["type"] = "MultiPolygon".into();
        let mut open = good.clone();
        open["geometry"]["coordinates"] = serde_json::json!([[[0, 0], [1, 0], [1, 1], [0, 1]]]);
        let mut flat = good.clone();
        flat["geometry"]["coordinates"] = serde_json::json!([[[0], [1], [1], [0]]]);
        for (feature, what) in [
            (line, "not a Polygon"),
            (open, "first one again"),
            (flat, "not two numbers"),
            (rectangle("building", "", [0.0, 0.0, 1.0, 1.0]), "needs an id"),
        ] {
            let message = message(serde_json::json!([good, feature]));
            assert!(message.contains("wood.geojson") && message.contains("feature 2"), "{message}");
            assert!(message.contains(what), "{message}");
        }
        let message = message(serde_json::json!([rectangle("house", "", [0.0, 0.0, 1.0, 1.0])]));
        assert!(message.contains("wood.geojson") && message.contains("house"), "{message}");
        assert!(Outlines::parse("{}", "x").is_err());
        assert!(Outlines::parse(r#"{"type": "Feature", "features": []}"#, "x").is_err());
    }
}
