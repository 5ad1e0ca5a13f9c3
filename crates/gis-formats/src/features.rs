//! Buildings as features: a polygon with a row of attributes.
//!
//! Two layers come of a city. A footprint is the outline of a building on the ground, flat, with the building's attributes; a roof
//! surface is one face of the roof of its best level of detail, in space, with its own attributes and the name of its building. Tables
//! have the same columns in each row, so the names of all attributes have to be seen before the first feature is written.

use gable_city_model::{Attributes, Building, Face, Semantic, Shell, Value, quantised};
use gable_geometry::DVec3;
use std::collections::BTreeMap;

/// What the values of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnKind {
    /// Truth values.
    Boolean,
    /// Whole numbers.
    Integer,
    /// Numbers.
    Number,
    /// Texts.
    Text,
}

impl ColumnKind {
    fn of(value: &Value) -> Self {
        match value {
            Value::Bool(_) => Self::Boolean,
            Value::Integer(_) => Self::Integer,
            Value::Number(_) => Self::Number,
            Value::Text(_) => Self::Text,
        }
    }

    /// The kind that holds the values of both.
    fn with(self, other: Self) -> Self {
        match (self, other) {
            _ if self == other => self,
            (Self::Integer, Self::Number) | (Self::Number, Self::Integer) => Self::Number,
            _ => Self::Text,
        }
    }

    /// A value as one of this kind.
    fn fit(self, value: &Value) -> Option<Value> {
        match (self, value) {
            (_, Value::Number(n)) if !n.is_finite() => None,
            (Self::Number, Value::Integer(n)) => Some(Value::Number(*n as f64)),
            (Self::Text, Value::Bool(b)) => Some(Value::Text(b.to_string())),
            (Self::Text, Value::Integer(n)) => Some(Value::Text(n.to_string())),
            (Self::Text, Value::Number(n)) => Some(Value::Text(n.to_string())),
            _ => Some(value.clone()),
        }
    }
}

/// A column of the attributes of a layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name, with the unit at its end.
    pub name: String,
    /// What its values are.
    pub kind: ColumnKind,
}

/// What a layer is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerInfo {
    /// Its name.
    pub name: &'static str,
    /// What it holds.
    pub description: &'static str,
    /// Whether its points have heights.
    pub has_heights: bool,
    /// Whether a feature may be of several polygons.
    pub is_multi: bool,
    /// The columns.
    pub columns: Vec<Column>,
}

/// A feature: polygons with a row of attributes.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Polygons of rings of points: world coordinates, closed, the outer ring first. Seen from above outer rings run
    /// counter-clockwise, inner ones clockwise.
    pub polygons: Vec<Vec<Vec<[f64; 3]>>>,
    /// A value for each column of the layer.
    pub values: Vec<Option<Value>>,
}

/// Columns of the two layers that come before the attributes.
const OF_FOOTPRINTS: [(&str, ColumnKind); 2] = [("id", ColumnKind::Text), ("lod", ColumnKind::Text)];
const OF_ROOFS: [(&str, ColumnKind); 7] = [
    ("id", ColumnKind::Text),
    ("building", ColumnKind::Text),
    ("lod", ColumnKind::Text),
    ("area_m2", ColumnKind::Number),
    ("lowest_m", ColumnKind::Number),
    ("highest_m", ColumnKind::Number),
    ("roofType", ColumnKind::Text),
];

/// The attributes that the buildings of a city have.
#[derive(Clone, Debug, Default)]
pub struct Schema {
    footprints: BTreeMap<String, ColumnKind>,
    roofs: BTreeMap<String, ColumnKind>,
}

impl Schema {
    /// Takes note of the attributes of a building.
    pub fn see(&mut self, building: &Building) {
        note(&mut self.footprints, &building.attributes, &OF_FOOTPRINTS);
        for face in shells(building).1.iter().flat_map(|shell| &shell.faces).filter(|f| is_roof(f)) {
            note(&mut self.roofs, &face.attributes, &OF_ROOFS);
        }
    }

    /// The layer of the footprints.
    #[must_use]
    pub fn footprints(&self) -> LayerInfo {
        LayerInfo {
            name: "footprints",
            description: "Outlines of the buildings on the ground",
            has_heights: false,
            is_multi: true,
            columns: columns(&OF_FOOTPRINTS, &self.footprints),
        }
    }

    /// The layer of the roof surfaces.
    #[must_use]
    pub fn roofs(&self) -> LayerInfo {
        LayerInfo {
            name: "roof_surfaces",
            description: "Faces of the roofs of the buildings",
            has_heights: true,
            is_multi: false,
            columns: columns(&OF_ROOFS, &self.roofs),
        }
    }

    /// The footprint of a building; none if it has no surface on the ground. `origin` is that of the local frame.
    #[must_use]
    pub fn footprint(&self, building: &Building, origin: [f64; 3]) -> Option<Feature> {
        let ground = |shells: &[Shell]| {
            let faces = shells.iter().map(quantised).map(|shell| {
                let faces = shell.faces.iter().filter(|face| face.semantic == Semantic::GroundSurface);
                faces.filter_map(|face| polygon(&shell, face, origin)).collect::<Vec<_>>()
            });
            faces.collect::<Vec<_>>().concat()
        };
        let lods = &building.lods;
        let choices = [lods.footprint.as_slice(), &lods.lod2, &lods.lod1];
        let mut polygons = choices.into_iter().map(ground).find(|polygons| !polygons.is_empty())?;
        // Flat: what its height is stands among the attributes.
        polygons.iter_mut().flatten().flatten().for_each(|point| point[2] = 0.0);
        let first = [text(&building.id), text(shells(building).0)];
        Some(Feature { polygons, values: row(first, &self.footprints, &building.attributes) })
    }

    /// The roof surfaces of a building.
    #[must_use]
    pub fn roof_surfaces(&self, building: &Building, origin: [f64; 3]) -> Vec<Feature> {
        let (lod, shells) = shells(building);
        let roof_type = building.attributes.get("roofType").cloned();
        let mut out = Vec::new();
        for shell in shells.iter().map(quantised) {
            for face in shell.faces.iter().filter(|face| is_roof(face)) {
                let Some(polygon) = polygon(&shell, face, origin) else { continue };
                let heights = polygon.iter().flatten().map(|p| p[2]);
                let first = [
                    text(&format!("{}-roof-{}", building.id, out.len() + 1)),
                    text(&building.id),
                    text(lod),
                    number(shell.vector_area(face).length()),
                    number(heights.clone().fold(f64::INFINITY, f64::min)),
                    number(heights.fold(f64::NEG_INFINITY, f64::max)),
                    roof_type.clone(),
                ];
                out.push(Feature { polygons: vec![polygon], values: row(first, &self.roofs, &face.attributes) });
            }
        }
        out
    }
}

/// The best level of detail of a building that has solids or surfaces, with those.
fn shells(building: &Building) -> (&'static str, &[Shell]) {
    let lods = &building.lods;
    let order = [("2", lods.lod2.as_slice()), ("1", &lods.lod1), ("0", lods.roof_edge.as_slice())];
    order.into_iter().find(|(_, shells)| !shells.is_empty()).unwrap_or(("0", &[]))
}

fn is_roof(face: &Face) -> bool {
    face.semantic == Semantic::RoofSurface
}

fn note(kinds: &mut BTreeMap<String, ColumnKind>, attributes: &Attributes, taken: &[(&str, ColumnKind)]) {
    for (name, value) in attributes.iter().filter(|(name, _)| taken.iter().all(|(other, _)| other != name)) {
        let kind = ColumnKind::of(value);
        kinds.entry(name.clone()).and_modify(|known| *known = known.with(kind)).or_insert(kind);
    }
}

fn columns(first: &[(&str, ColumnKind)], more: &BTreeMap<String, ColumnKind>) -> Vec<Column> {
    let first = first.iter().map(|(name, kind)| Column { name: (*name).to_owned(), kind: *kind });
    first.chain(more.iter().map(|(name, kind)| Column { name: name.clone(), kind: *kind })).collect()
}

fn row<const N: usize>(
    first: [Option<Value>; N],
    kinds: &BTreeMap<String, ColumnKind>,
    attributes: &Attributes,
) -> Vec<Option<Value>> {
    let more = kinds.iter().map(|(name, kind)| attributes.get(name).and_then(|value| kind.fit(value)));
    first.into_iter().chain(more).collect()
}

fn text(text: &str) -> Option<Value> {
    Some(Value::Text(text.to_owned()))
}

/// To the hundredth.
fn number(value: f64) -> Option<Value> {
    value.is_finite().then(|| Value::Number((value * 100.0).round() / 100.0 + 0.0))
}

/// The rings of a face of a quantised shell in world coordinates; none if it stands on its edge.
fn polygon(shell: &Shell, face: &Face, origin: [f64; 3]) -> Option<Vec<Vec<[f64; 3]>>> {
    // To the decimal that a building is written with everywhere.
    let world = |p: DVec3| [0, 1, 2].map(|i| ((origin[i] + p[i]) * 1e4).round() / 1e4 + 0.0);
    let mut rings = Vec::new();
    for (number, ring) in face.rings.iter().enumerate() {
        let mut points: Vec<[f64; 3]> = ring.iter().map(|&i| world(shell.vertices[i as usize])).collect();
        let twice: f64 = (0..points.len())
            .map(|i| {
                // About the first point, so that large coordinates lose no digits.
                let [p, q] = [points[i], points[(i + 1) % points.len()]];
                (p[0] - points[0][0]) * (q[1] - points[0][1]) - (q[0] - points[0][0]) * (p[1] - points[0][1])
            })
            .sum();
        if twice == 0.0 {
            if number == 0 {
                return None;
            }
            continue;
        }
        if (twice > 0.0) != (number == 0) {
            points.reverse();
        }
        points.push(points[0]);
        rings.push(points);
    }
    (!rings.is_empty()).then_some(rings)
}
