//! Single buildings out of a tile's CityJSON file.
//!
//! A tile is read once, and of its objects only those are kept that are asked for: its terrain, most of its bytes, is skipped.

use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// From the integers of a file to world coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Transform {
    scale: [f64; 3],
    translate: [f64; 3],
}

/// Buildings of a tile, with the vertices of the tile.
#[derive(Debug)]
pub(crate) struct Tile {
    transform: Transform,
    /// As CityJSON's `metadata.referenceSystem` has it.
    reference_system: Option<String>,
    vertices: Vec<[i64; 3]>,
    objects: BTreeMap<String, Map<String, Value>>,
}

impl Tile {
    /// Reads the buildings with these ids, and their parts, from a CityJSON file in which parents stand before their children.
    pub(crate) fn read(content: &[u8], ids: &BTreeSet<String>) -> Result<Self, serde_json::Error> {
        let mut reader = serde_json::Deserializer::from_slice(content);
        Wanted(ids).deserialize(&mut reader)
    }

    /// The building as the CityObjects of a `CityJSONFeature`, in the integers of `base`; none if the tile has it not.
    pub(crate) fn feature(&self, id: &str, base: &Transform) -> Option<Value> {
        let mut places: BTreeMap<u64, usize> = BTreeMap::new();
        let mut vertices: Vec<[i64; 3]> = Vec::new();
        let mut objects = Map::new();
        for (name, object) in self.family(id)? {
            let mut object = object.clone();
            for geometry in object.get_mut("geometry").and_then(Value::as_array_mut).into_iter().flatten() {
                renumber(&mut geometry["boundaries"], &mut |old| {
                    *places.entry(old).or_insert_with(|| {
                        vertices.push(self.moved(old, base));
                        vertices.len() - 1
                    })
                });
            }
            objects.insert(name.to_owned(), object.into());
        }
        Some(json!({ "type": "CityJSONFeature", "id": id, "CityObjects": objects, "vertices": vertices }))
    }

    /// The footprint as the coordinates of a GeoJSON MultiPolygon, in the tile's reference system; none if there is none.
    pub(crate) fn footprint(&self, id: &str) -> Option<Vec<Vec<Vec<[f64; 2]>>>> {
        let geometries = self.objects.get(id)?.get("geometry")?.as_array()?;
        let ground = |g: &&Value| {
            g["lod"] == "0" && g["type"] == "MultiSurface" && g["semantics"]["surfaces"][0]["type"] == "GroundSurface"
        };
        let surfaces: Vec<Vec<Vec<u64>>> =
            serde_json::from_value(geometries.iter().find(ground)?["boundaries"].clone()).ok()?;
        let polygon = |rings: Vec<Vec<u64>>| {
            rings.iter().enumerate().map(|(n, ring)| self.ring(ring, n == 0)).collect::<Vec<_>>()
        };
        Some(surfaces.into_iter().map(polygon).collect())
    }

    /// What stands before the features of these tiles: the lowest corner of all, so that every integer is whole.
    pub(crate) fn header<'a>(tiles: impl IntoIterator<Item = &'a Self>) -> Option<(Value, Transform)> {
        let mut tiles = tiles.into_iter();
        let first = tiles.next()?;
        let mut base = first.transform;
        for tile in tiles {
            for (low, own) in base.translate.iter_mut().zip(tile.transform.translate) {
                *low = low.min(own);
            }
        }
        let metadata = first.reference_system.as_ref().map_or_else(|| json!({}), |s| json!({ "referenceSystem": s }));
        let header = json!({ "type": "CityJSON", "version": "2.0", "transform": base, "metadata": metadata,
            "CityObjects": {}, "vertices": [] });
        Some((header, base))
    }

    /// A building and its parts.
    fn family<'a>(&'a self, id: &'a str) -> Option<impl Iterator<Item = (&'a str, &'a Map<String, Value>)>> {
        let parent = self.objects.get(id)?;
        let children = parent.get("children").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
        Some(std::iter::once(id).chain(children).filter_map(|name| Some((name, self.objects.get(name)?))))
    }

    /// A vertex in the integers of another transform of the same scale.
    fn moved(&self, vertex: u64, base: &Transform) -> [i64; 3] {
        let own = self.vertices.get(vertex as usize).copied().unwrap_or_default();
        let Transform { scale, translate } = self.transform;
        std::array::from_fn(|i| own[i] + ((translate[i] - base.translate[i]) / scale[i]).round() as i64)
    }

    /// A closed ring, counter-clockwise if it is an outer one, as GeoJSON wants it.
    fn ring(&self, ring: &[u64], outer: bool) -> Vec<[f64; 2]> {
        let Transform { scale, translate } = self.transform;
        let place = |&vertex: &u64| {
            let own = self.vertices.get(vertex as usize).copied().unwrap_or_default();
            // Back to decimals: the file's steps are powers of ten.
            [0, 1].map(|i| ((translate[i] + own[i] as f64 * scale[i]) / scale[i]).round() / (1.0 / scale[i]).round())
        };
        let mut points: Vec<[f64; 2]> = ring.iter().map(place).collect();
        let edges = points.iter().zip(points.iter().cycle().skip(1));
        let area: f64 = edges
            .map(|(a, b)| (a[0] - points[0][0]) * (b[1] - points[0][1]) - (b[0] - points[0][0]) * (a[1] - points[0][1]))
            .sum();
        if (area > 0.0) != outer {
            points.reverse();
        }
        points.extend(points.first().copied());
        points
    }
}

/// Replaces all numbers in nested lists.
fn renumber(boundaries: &mut Value, number: &mut impl FnMut(u64) -> usize) {
    match boundaries {
        Value::Array(list) => list.iter_mut().for_each(|inner| renumber(inner, number)),
        value => {
            if let Some(old) = value.as_u64() {
                *value = number(old).into();
            }
        }
    }
}

/// Reads a file, keeping what is wanted of it.
struct Wanted<'a>(&'a BTreeSet<String>);

impl<'de> DeserializeSeed<'de> for Wanted<'_> {
    type Value = Tile;

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<Tile, D::Error> {
        reader.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Wanted<'_> {
    type Value = Tile;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a CityJSON file")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Tile, A::Error> {
        #[derive(Default, Deserialize)]
        #[serde(rename_all = "camelCase", default)]
        struct Metadata {
            reference_system: Option<String>,
        }
        let (mut transform, mut metadata, mut vertices) = (None, Metadata::default(), Vec::new());
        let mut objects = BTreeMap::new();
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "transform" => transform = Some(map.next_value()?),
                "metadata" => metadata = map.next_value()?,
                "vertices" => vertices = map.next_value()?,
                "CityObjects" => objects = map.next_value_seed(WantedObjects(self.0))?,
                _ => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        let transform = transform.ok_or_else(|| A::Error::missing_field("transform"))?;
        Ok(Tile { transform, reference_system: metadata.reference_system, vertices, objects })
    }
}

struct WantedObjects<'a>(&'a BTreeSet<String>);

impl<'de> DeserializeSeed<'de> for WantedObjects<'_> {
    type Value = BTreeMap<String, Map<String, Value>>;

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<Self::Value, D::Error> {
        reader.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for WantedObjects<'_> {
    type Value = BTreeMap<String, Map<String, Value>>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CityObjects")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut objects = BTreeMap::new();
        let mut children: BTreeSet<String> = BTreeSet::new();
        while let Some(id) = map.next_key::<String>()? {
            if !self.0.contains(&id) && !children.contains(&id) {
                map.next_value::<IgnoredAny>()?;
                continue;
            }
            let object: Map<String, Value> = map.next_value()?;
            let own = object.get("children").and_then(Value::as_array).into_iter().flatten();
            children.extend(own.filter_map(Value::as_str).map(str::to_owned));
            objects.insert(id, object);
        }
        Ok(objects)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"{"type":"CityJSON","version":"2.0",
        "transform":{"scale":[0.0001,0.0001,0.0001],"translate":[85000.0,446000.0,-3.0]},
        "metadata":{"referenceSystem":"https://www.opengis.net/def/crs/EPSG/0/7415"},
        "CityObjects":{
          "t":{"type":"TINRelief","geometry":[{"type":"CompositeSurface","lod":"1","boundaries":[[[0,1,2]]]}]},
          "a":{"type":"Building","children":["a-0"],"geometry":[{"type":"MultiSurface","lod":"0","boundaries":[[[1,2,3,4]]],
               "semantics":{"surfaces":[{"type":"GroundSurface"}],"values":[0]}}]},
          "a-0":{"type":"BuildingPart","parents":["a"],"geometry":[{"type":"Solid","lod":"2","boundaries":[[[[4,5,1]]]]}]},
          "b":{"type":"Building","geometry":[]}},
        "vertices":[[0,0,0],[10000,0,30000],[10000,15000,30000],[0,15000,30000],[0,0,30000],[5,5,50000]]}"#;

    fn tile(ids: &[&str]) -> Tile {
        Tile::read(FILE.as_bytes(), &ids.iter().map(|i| (*i).to_owned()).collect()).unwrap()
    }

    #[test]
    fn only_what_is_asked_for_is_kept() {
        assert_eq!(tile(&["a"]).objects.keys().collect::<Vec<_>>(), ["a", "a-0"]);
        assert!(tile(&["c"]).feature("c", &tile(&[]).transform).is_none());
        assert!(Tile::read(b"{\"CityObjects\":{}}", &BTreeSet::new()).is_err(), "no transform");
        assert!(Tile::read(&FILE.as_bytes()[..300], &BTreeSet::new()).is_err(), "cut off");
    }

    #[test]
    fn a_feature_stands_alone() {
        let mut other = tile(&[]);
        other.transform.translate = [84999.0, 446000.0, -4.0];
        let tiles = [tile(&["a"]), other];
        let (header, base) = Tile::header(&tiles).unwrap();
        assert_eq!(header["transform"]["translate"], json!([84999.0, 446000.0, -4.0]));
        let feature = tiles[0].feature("a", &base).unwrap();
        assert_eq!(feature["vertices"].as_array().unwrap().len(), 5, "only its own");
        assert_eq!(feature["vertices"][0], json!([20000, 0, 40000]));
        assert_eq!(feature["CityObjects"]["a"]["geometry"][0]["boundaries"], json!([[[0, 1, 2, 3]]]));
        assert_eq!(feature["CityObjects"]["a-0"]["geometry"][0]["boundaries"], json!([[[[3, 4, 0]]]]));
    }

    #[test]
    fn a_footprint_turns_left_and_is_closed() {
        let corner = [85_001.0, 446_000.0];
        let ring = vec![corner, [85_001.0, 446_001.5], [85_000.0, 446_001.5], [85_000.0, 446_000.0], corner];
        assert_eq!(tile(&["a"]).footprint("a"), Some(vec![vec![ring.clone()]]));
        let turned = FILE.replace("[[[1,2,3,4]]]", "[[[4,3,2,1]]]");
        let turned = Tile::read(turned.as_bytes(), &BTreeSet::from(["a".to_owned()])).unwrap();
        let found = turned.footprint("a").unwrap();
        assert_eq!(found[0][0], ring);
        assert_eq!(tile(&["b"]).footprint("b"), None);
    }
}
