//! The parts of CityJSON documents that gable reads, of all versions, as serde types.

use gable_geometry::Crs;
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::{Map, Value};
use std::fmt;

/// A file, the first line of a sequence, or a feature.
#[derive(Deserialize)]
pub(super) struct InDocument {
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) transform: Option<InTransform>,
    #[serde(default)]
    pub(super) metadata: InMetadata,
    #[serde(default, rename = "CityObjects")]
    pub(super) objects: InOrder,
    #[serde(default)]
    pub(super) vertices: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct InTransform {
    pub(super) scale: [f64; 3],
    pub(super) translate: [f64; 3],
}

#[derive(Default, Deserialize)]
pub(super) struct InMetadata(Map<String, Value>);

impl InMetadata {
    /// The title under its names.
    pub(super) fn title(&self) -> String {
        let title = ["title", "datasetTitle"].iter().find_map(|name| self.0.get(*name)?.as_str());
        title.unwrap_or_default().to_owned()
    }

    /// The reference system: an OGC URL, a URN, an `epsg` number (versions before 1.0), or gable's own local plane or pair.
    /// The text if it is not understood.
    pub(super) fn crs(&self) -> Result<Crs, String> {
        if let Some(plane) = self.0.get("localTangentPlane") {
            let angle = |name: &str| plane.get(name).and_then(Value::as_f64);
            if let (Some(latitude), Some(longitude)) = (angle("latitude"), angle("longitude")) {
                return Ok(Crs::Enu { latitude, longitude, height: angle("height").unwrap_or(0.0) });
            }
        }
        if let Some(code) = self.0.get("crs").and_then(|crs| crs.get("epsg")).and_then(Value::as_u64) {
            return format!("EPSG:{code}").parse().map_err(|_| code.to_string());
        }
        let Some(text) = self.0.get("referenceSystem").and_then(Value::as_str) else { return Ok(Crs::Unknown) };
        let crs = crate::semantics::crs_of(text).ok_or_else(|| text.to_owned())?;
        let heights = self.0.get("verticalReferenceSystem").and_then(Value::as_str);
        match (&crs, heights.and_then(crate::semantics::crs_of)) {
            (&Crs::Epsg(horizontal), Some(Crs::Epsg(vertical))) => Ok(Crs::Compound { horizontal, vertical }),
            _ => Ok(crs),
        }
    }
}

#[derive(Deserialize)]
pub(super) struct InObject {
    #[serde(rename = "type")]
    pub(super) kind: String,
    #[serde(default)]
    pub(super) attributes: Map<String, Value>,
    #[serde(default)]
    pub(super) geometry: Vec<InGeometry>,
    #[serde(default, alias = "Parts")]
    pub(super) children: Vec<String>,
    #[serde(default)]
    pub(super) parents: Vec<String>,
}

#[derive(Deserialize)]
pub(super) struct InGeometry {
    #[serde(rename = "type")]
    pub(super) kind: String,
    #[serde(default, deserialize_with = "lod")]
    pub(super) lod: String,
    #[serde(default)]
    pub(super) boundaries: Value,
    #[serde(default)]
    pub(super) semantics: Semantics,
}

/// LODs are texts since 1.1, numbers before.
fn lod<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Ok(match Value::deserialize(deserializer)? {
        Value::String(text) => text,
        Value::Number(number) => number.to_string(),
        _ => String::new(),
    })
}

/// Semantics of a geometry's surfaces.
#[derive(Default, Deserialize, PartialEq)]
#[serde(untagged)]
pub(super) enum Semantics {
    /// Since 0.8: surface objects, and their numbers nested as the boundaries are.
    Listed {
        /// The surface objects.
        surfaces: Vec<Map<String, Value>>,
        /// Numbers.
        values: Value,
    },
    /// None, or null.
    #[default]
    None,
    /// Before: surface objects nested as the boundaries are.
    Nested(Value),
}

impl Semantics {
    /// The surface object of the face at `path` and `face`.
    pub(super) fn surface(&self, path: &[usize], face: usize) -> Option<&Map<String, Value>> {
        let descend = |from| path.iter().chain([&face]).try_fold(from, |at: &Value, &k| at.get(k));
        match self {
            Self::Listed { surfaces, values } => surfaces.get(usize::try_from(descend(values)?.as_u64()?).ok()?),
            Self::Nested(values) => descend(values)?.as_object(),
            Self::None => None,
        }
    }
}

/// The members of a JSON object in the order of the file.
#[derive(Default)]
pub(super) struct InOrder(pub(super) Vec<(String, InObject)>);

impl<'de> Deserialize<'de> for InOrder {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Members;
        impl<'de> Visitor<'de> for Members {
            type Value = InOrder;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of city objects")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<InOrder, A::Error> {
                let mut members = Vec::with_capacity(map.size_hint().unwrap_or(0));
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(InOrder(members))
            }
        }
        deserializer.deserialize_map(Members)
    }
}
