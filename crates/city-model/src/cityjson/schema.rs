//! The parts of CityJSON documents that gable writes, as serde types.

use crate::Attributes;
use crate::quantise::lattice;
use crate::{Error, Shell, Value};
use gable_geometry::DVec3;
use serde::{Serialize, Serializer};
use std::collections::HashMap;

/// Integers in files stay within 32 bits, which every reader can hold.
const LIMIT: i64 = i32::MAX as i64;

#[derive(Serialize)]
pub(super) struct CityObject<'a> {
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none", rename = "geographicalExtent")]
    pub(super) extent: Option<[f64; 6]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) attributes: Option<Entries>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) children: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) parents: Vec<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) geometry: Vec<Geometry>,
}

/// Faces of rings of vertex indices.
pub(super) type Surfaces = Vec<Vec<Vec<u32>>>;

#[derive(Serialize)]
pub(super) struct Geometry {
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) lod: &'static str,
    pub(super) boundaries: Boundaries,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) semantics: Option<Semantics>,
}

#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Boundaries {
    Surfaces(Surfaces),
    Shells([Surfaces; 1]),
}

#[derive(Serialize)]
pub(super) struct Semantics {
    pub(super) surfaces: Vec<Entries>,
    pub(super) values: Values,
}

#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Values {
    Surfaces(Vec<u32>),
    Shells([Vec<u32>; 1]),
}

/// The vertices of a file: each lattice point once, in the order of first use, relative to the file's corner.
#[derive(Default)]
pub(super) struct VertexPool {
    corner: [i64; 3],
    index: HashMap<[i64; 3], u32>,
    pub(super) vertices: Vec<[i64; 3]>,
}

impl VertexPool {
    /// A pool for a file whose `translate` is at this lattice point of the local frame.
    pub(super) fn new(corner: [i64; 3]) -> Self {
        Self { corner, ..Self::default() }
    }

    /// Index of a local point; `None` beyond 32-bit integers.
    pub(super) fn place(&mut self, p: DVec3) -> Option<u32> {
        let q = lattice(p);
        let mut relative = [0; 3];
        for i in 0..3 {
            relative[i] = q[i].checked_sub(self.corner[i]).filter(|v| v.abs() <= LIMIT)?;
        }
        let next = u32::try_from(self.vertices.len()).ok()?;
        Some(*self.index.entry(relative).or_insert_with(|| {
            self.vertices.push(relative);
            next
        }))
    }

    /// The faces of a quantised shell.
    pub(super) fn surfaces(&mut self, shell: &Shell) -> Option<Surfaces> {
        let map: Vec<u32> = shell.vertices.iter().map(|&p| self.place(p)).collect::<Option<_>>()?;
        let ring = |ring: &Vec<u32>| ring.iter().map(|&i| map[i as usize]).collect();
        Some(shell.faces.iter().map(|face| face.rings.iter().map(ring).collect()).collect())
    }

    /// Forgets the vertices, keeps the memory: for the next feature of a sequence.
    pub(super) fn clear(&mut self) {
        self.index.clear();
        self.vertices.clear();
    }
}

/// Members of a JSON object in their order.
pub(super) struct Entries(pub(super) Vec<(String, Value)>);

impl Serialize for Entries {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

/// Attributes as JSON. Numbers are written with at most six decimals, so that they read as what they are worth.
pub(super) fn attributes(id: &str, from: &Attributes) -> Result<Entries, Error> {
    let entry = |(name, value): (&String, &Value)| {
        let value = match value {
            Value::Number(n) => Value::Number(clean(*n).ok_or_else(|| {
                Error::object(id, format!("the attribute {name} is {n}: leave it out if it is not known"))
            })?),
            other => other.clone(),
        };
        Ok((name.clone(), value))
    };
    Ok(Entries(from.iter().map(entry).collect::<Result<_, Error>>()?))
}

/// A number with at most six decimals and no negative zero; `None` if it is not finite.
pub(crate) fn clean(n: f64) -> Option<f64> {
    let scaled = n * 1e6;
    // Beyond 2^53 / 1e6 rounding to decimals would lose digits that are there.
    let rounded = if scaled.abs() < 9e15 { scaled.round() / 1e6 } else { n };
    n.is_finite().then_some(rounded + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_clean() {
        assert_eq!(clean(3.180_000_066_757_202), Some(3.18));
        assert_eq!(clean(-1e-9).map(f64::to_bits), Some(0.0f64.to_bits()));
        assert_eq!(clean(1e300), Some(1e300));
        assert_eq!(clean(f64::NAN), None);
    }
}
