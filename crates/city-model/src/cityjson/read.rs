//! Reading of CityJSON 0.3 to 2.0 and CityJSONSeq.

use super::schema_in::{InDocument, InGeometry, InObject, Semantics};
use crate::budget::{self, Shared, TOO_MUCH};
use crate::error::{Note, ReadOptions, Reading};
use crate::semantics::{self, kind_of};
use crate::{Attributes, Building, CityModel, Error, Face, Lods, Metadata, Shell, Terrain, Value};
use gable_files::Reach;
use gable_geometry::{Crs, DVec3, Frame};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Reads a CityJSON file (versions 0.3 to 2.0) or CityJSONSeq, told apart by their content.
///
/// Buildings come with LOD 0 (by its semantics footprint or roof edge), and of LOD 1 and LOD 2 the finest refinement
/// that there is (1.3 before 1.2 before 1.0). Solids and MultiSurfaces of BuildingParts join their building, in the
/// order of its `children`. All TINReliefs become one terrain. Surfaces with other or without semantics take the one
/// that their direction suggests. Everything else is left out, with a note.
///
/// Vertices are kept apart if the file keeps them apart by more than their exact coordinates. O(bytes).
///
/// # Errors
/// If the file cannot be read, is not CityJSON, refers to vertices that are not there, or comes to more than a city; with line or
/// object.
pub fn read_cityjson(path: &Path, options: &ReadOptions) -> Result<Reading, Error> {
    let text = Reach::everything().read_text(path, budget::FILE)?;
    read_cityjson_str(&text, path, options)
}

/// As [`read_cityjson`], from text; `path` is for the messages.
///
/// # Errors
/// As [`read_cityjson`].
pub fn read_cityjson_str(text: &str, path: &Path, options: &ReadOptions) -> Result<Reading, Error> {
    let trimmed = text.trim_start_matches('\u{feff}');
    let mut lines = trimmed.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let first = lines.next().map_or("", |(_, line)| line);
    // The first line of a sequence is a whole document; that of a file with line breaks is not.
    let head = if lines.clone().next().is_some() { serde_json::from_str::<InDocument>(first).ok() } else { None };
    let Some(head) = head.filter(|head| head.kind == "CityJSON") else {
        let document: InDocument = parse(trimmed, path, 0)?;
        if document.kind != "CityJSON" {
            let reason = format!("the type is {:?}, not CityJSON", document.kind);
            return Err(Error::content(path, "line 1", reason));
        }
        let mut city = City::new(path, &document, options, text.len());
        city.add(&document, "the file")?;
        return Ok(city.finish());
    };
    let mut city = City::new(path, &head, options, text.len());
    city.add(&head, "line 1")?;
    for (number, line) in lines {
        let feature: InDocument = parse(line, path, number)?;
        if feature.kind != "CityJSONFeature" {
            let reason = format!("the type is {:?}, not CityJSONFeature", feature.kind);
            return Err(Error::content(path, format!("line {}", number + 1), reason));
        }
        city.add(&feature, &format!("line {}", number + 1))?;
    }
    Ok(city.finish())
}

fn parse(text: &str, path: &Path, line: usize) -> Result<InDocument, Error> {
    serde_json::from_str(text).map_err(|error| {
        let place = format!("line {}, column {}", line + error.line(), error.column());
        Error::content(path, place, error.to_string())
    })
}

/// What is gathered while reading.
struct City<'a> {
    path: &'a Path,
    scale: DVec3,
    translate: DVec3,
    origin: Option<[f64; 3]>,
    title: String,
    crs: Crs,
    buildings: Vec<Building>,
    terrain: Option<Terrain>,
    notes: Vec<Note>,
    shared: Shared,
}

impl<'a> City<'a> {
    fn new(path: &'a Path, head: &InDocument, options: &ReadOptions, bytes: usize) -> Self {
        let transform = head.transform.as_ref();
        let mut city = Self {
            path,
            scale: transform.map_or(DVec3::ONE, |t| DVec3::from_array(t.scale)),
            translate: transform.map_or(DVec3::ZERO, |t| DVec3::from_array(t.translate)),
            origin: options.origin,
            title: head.metadata.title(),
            crs: Crs::Unknown,
            buildings: Vec::new(),
            terrain: None,
            notes: Vec::new(),
            shared: Shared::of_file(bytes),
        };
        match head.metadata.crs() {
            Ok(crs) => city.crs = crs,
            Err(text) => city.note("", format!("the reference system {text:?} is not understood")),
        }
        city
    }

    fn note(&mut self, id: &str, message: impl Into<String>) {
        self.notes.push(Note { id: id.to_owned(), message: message.into() });
    }

    fn finish(self) -> Reading {
        let origin = self.origin.unwrap_or([0.0; 3]);
        let Self { title, crs, buildings, terrain, notes, .. } = self;
        Reading { model: CityModel { title, metadata: Metadata::default(), origin, crs, buildings, terrain }, notes }
    }

    /// Adds the objects of a file or feature.
    fn add(&mut self, document: &InDocument, place: &str) -> Result<(), Error> {
        let world = |v: &[f64; 3]| DVec3::from_array(*v) * self.scale + self.translate;
        let origin = match self.origin {
            Some(origin) => origin,
            None if document.vertices.is_empty() => return Ok(()),
            None => {
                // A sequence hangs on its transform, so that the origin does not depend on which feature comes first.
                let low = if document.kind == "CityJSON" {
                    document.vertices.iter().map(world).fold(DVec3::INFINITY, DVec3::min)
                } else {
                    self.translate
                };
                *self.origin.insert(Frame::near(low, Crs::Unknown).origin)
            }
        };
        let origin = DVec3::from_array(origin);
        let vertices: Vec<DVec3> = document.vertices.iter().map(|v| world(v) - origin).collect();
        if let Some(bad) = vertices.iter().position(|v| !v.is_finite()) {
            return Err(Error::content(self.path, place, format!("vertex {bad} is not finite")));
        }
        let far =
            |v: &DVec3| v.abs().max_element() > budget::REACH || (*v + origin).abs().max_element() > budget::WORLD;
        if let Some(bad) = vertices.iter().position(far) {
            let [x, y, z] = (vertices[bad] + origin).to_array();
            let reason = format!(
                "vertex {bad} lies at {x:e}, {y:e}, {z:e}, far from everything: are scale and translate in metres?"
            );
            return Err(Error::content(self.path, place, reason));
        }
        let objects: HashMap<&str, &InObject> = document.objects.0.iter().map(|(id, o)| (id.as_str(), o)).collect();
        for (id, object) in &document.objects.0 {
            match object.kind.as_str() {
                "Building" => {
                    let building = self.building(id, object, &objects, &vertices, place)?;
                    self.buildings.push(building);
                }
                "BuildingPart" => {
                    if !object.parents.iter().any(|p| objects.contains_key(p.as_str())) {
                        self.note(id, "left out: a BuildingPart without its Building");
                    }
                }
                "TINRelief" => self.relief(id, object, &vertices, place)?,
                other => self.note(id, format!("left out: a {other}")),
            }
        }
        Ok(())
    }

    fn building(
        &mut self,
        id: &str,
        object: &InObject,
        objects: &HashMap<&str, &InObject>,
        vertices: &[DVec3],
        place: &str,
    ) -> Result<Building, Error> {
        let mut attributes = Attributes::new();
        for (name, value) in &object.attributes {
            if let Some(value) = attribute(value) {
                attributes.insert(name.clone(), value);
            }
        }
        let parts = object.children.iter().filter_map(|child| Some((child.as_str(), *objects.get(child.as_str())?)));
        let mut seen = HashSet::new();
        let parts = parts.filter(|(name, part)| part.kind == "BuildingPart" && seen.insert(*name));
        let parts: Vec<_> = parts.collect();
        let children = object.children.len() - parts.len();
        if children > 0 {
            self.note(id, format!("left out: {children} children that are not BuildingParts of this file"));
        }
        let mut lods = Lods::default();
        let sources: Vec<_> = std::iter::once((id, object)).chain(parts).collect();
        let finest = |class: char| {
            let all = sources.iter().flat_map(|(_, o)| &o.geometry).map(|g| g.lod.as_str());
            all.filter(|lod| lod.starts_with(class)).max().unwrap_or_default().to_owned()
        };
        let (finest_1, finest_2) = (finest('1'), finest('2'));
        for (source, object) in &sources {
            for (g, geometry) in object.geometry.iter().enumerate() {
                let at = format!("{place}, {source}, geometry {g}");
                let lod = geometry.lod.as_str();
                if lod.starts_with('0') {
                    let shell = self.surfaces(geometry, vertices, &at)?;
                    let is_roof = shell.faces.iter().any(|f| f.semantic == crate::Semantic::RoofSurface)
                        && geometry.semantics != Semantics::None;
                    let slot = if is_roof { &mut lods.roof_edge } else { &mut lods.footprint };
                    merge(slot.get_or_insert_default(), shell);
                } else if lod == finest_1 {
                    self.solids(source, geometry, vertices, &at, &mut lods.lod1)?;
                } else if lod == finest_2 {
                    self.solids(source, geometry, vertices, &at, &mut lods.lod2)?;
                } else if !(lod.starts_with('1') || lod.starts_with('2')) {
                    self.note(source, format!("left out: a geometry of LOD{lod}"));
                }
            }
            if *source != id && !object.attributes.is_empty() {
                self.note(source, "left out: the attributes of a BuildingPart");
            }
        }
        if let Some(footprint) = &mut lods.footprint {
            footprint.faces.iter_mut().for_each(|face| face.semantic = crate::Semantic::GroundSurface);
        }
        Ok(Building { id: id.to_owned(), attributes, lods })
    }

    /// Appends the solids of a geometry; an open set of surfaces counts as one.
    fn solids(
        &mut self,
        id: &str,
        geometry: &InGeometry,
        vertices: &[DVec3],
        place: &str,
        to: &mut Vec<Shell>,
    ) -> Result<(), Error> {
        let path = self.path;
        let wrong = || Error::content(path, place, "the boundaries are nested wrongly");
        match geometry.kind.as_str() {
            "Solid" => to.extend(self.solid(id, geometry, &geometry.boundaries, &[], vertices, place)?),
            "MultiSolid" | "CompositeSolid" => {
                for (k, solid) in geometry.boundaries.as_array().ok_or_else(wrong)?.iter().enumerate() {
                    to.extend(self.solid(id, geometry, solid, &[k], vertices, place)?);
                }
            }
            "MultiSurface" | "CompositeSurface" => to.push(self.surfaces(geometry, vertices, place)?),
            other => self.note(id, format!("left out: a {other} of LOD{}", geometry.lod)),
        }
        Ok(())
    }

    /// The outer shell of a solid.
    fn solid(
        &mut self,
        id: &str,
        geometry: &InGeometry,
        shells: &serde_json::Value,
        path: &[usize],
        vertices: &[DVec3],
        place: &str,
    ) -> Result<Option<Shell>, Error> {
        let file = self.path;
        let bad = || Error::content(file, place, "the boundaries are nested wrongly");
        let shells = shells.as_array().ok_or_else(bad)?;
        let Some(outer) = shells.first() else { return Ok(None) };
        let shell = self.shell(geometry, outer, &[path, &[0]].concat(), vertices, place)?;
        if shells.len() > 1 {
            self.note(id, format!("left out: {} cavities of a solid", shells.len() - 1));
        }
        Ok(Some(shell))
    }

    fn surfaces(&mut self, geometry: &InGeometry, vertices: &[DVec3], place: &str) -> Result<Shell, Error> {
        match geometry.kind.as_str() {
            "MultiSurface" | "CompositeSurface" => self.shell(geometry, &geometry.boundaries, &[], vertices, place),
            other => Err(Error::content(self.path, place, format!("a {other} where surfaces were expected"))),
        }
    }

    /// A list of faces with their semantics, at `path` in the semantics' nested values.
    fn shell(
        &mut self,
        geometry: &InGeometry,
        faces: &serde_json::Value,
        path: &[usize],
        vertices: &[DVec3],
        place: &str,
    ) -> Result<Shell, Error> {
        let file = self.path;
        let bad = |reason: String| Error::content(file, place, reason);
        let mut shell = Shell::default();
        let mut exact: HashMap<[u64; 3], u32> = HashMap::new();
        let faces = faces.as_array().ok_or_else(|| bad("the boundaries are nested wrongly".to_owned()))?;
        for (f, rings) in faces.iter().enumerate() {
            let rings = rings.as_array().ok_or_else(|| bad(format!("face {f} is not a list of rings")))?;
            let mut face =
                Face { rings: Vec::new(), semantic: crate::Semantic::WallSurface, attributes: BTreeMap::new() };
            for ring in rings {
                let ring =
                    ring.as_array().ok_or_else(|| bad(format!("a ring of face {f} is not a list of vertices")))?;
                if !self.shared.take_corners(ring.len() + 1) {
                    return Err(bad(TOO_MUCH.to_owned()));
                }
                let mut corners = Vec::with_capacity(ring.len());
                for index in ring {
                    let point = index.as_u64().and_then(|i| vertices.get(usize::try_from(i).ok()?));
                    let point =
                        point.ok_or_else(|| bad(format!("face {f} refers to vertex {index}, which is not there")))?;
                    let next = shell.vertices.len() as u32;
                    corners.push(*exact.entry((*point + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(
                        || {
                            shell.vertices.push(*point);
                            next
                        },
                    ));
                }
                face.rings.push(corners);
            }
            let surface = geometry.semantics.surface(path, f);
            for (name, value) in surface.into_iter().flatten() {
                if let (Some(value), false) =
                    (attribute(value), ["type", "parent", "children"].contains(&name.as_str()))
                {
                    if !self.shared.take_attributes(name.len() + value.bytes()) {
                        return Err(bad(TOO_MUCH.to_owned()));
                    }
                    face.attributes.insert(name.clone(), value);
                }
            }
            let name = surface.and_then(|s| s.get("type")).and_then(|t| t.as_str());
            let normal = shell.vector_area(&face);
            face.semantic = name.and_then(kind_of).unwrap_or_else(|| semantics::of_normal(normal));
            shell.faces.push(face);
        }
        Ok(shell)
    }

    fn relief(&mut self, id: &str, object: &InObject, vertices: &[DVec3], place: &str) -> Result<(), Error> {
        for (g, geometry) in object.geometry.iter().enumerate() {
            let shell = self.surfaces(geometry, vertices, &format!("{place}, {id}, geometry {g}"))?;
            let terrain = self.terrain.get_or_insert_with(|| Terrain { id: id.to_owned(), ..Terrain::default() });
            let shift = terrain.vertices.len() as u32;
            let triangles = crate::triangulate(&shell);
            terrain.triangles.extend(triangles.iter().map(|t| t.corners.map(|i| i + shift)));
            terrain.vertices.extend(shell.vertices);
        }
        Ok(())
    }
}

/// Adds the faces of one shell to another.
pub(crate) fn merge(to: &mut Shell, from: Shell) {
    let shift = to.vertices.len() as u32;
    to.vertices.extend(from.vertices);
    to.faces.extend(from.faces.into_iter().map(|mut face| {
        face.rings.iter_mut().flatten().for_each(|i| *i += shift);
        face
    }));
}

/// A JSON value as an attribute: null is none, lists and objects are kept as their text.
fn attribute(value: &serde_json::Value) -> Option<Value> {
    Some(match value {
        serde_json::Value::Null => return None,
        serde_json::Value::Bool(b) => Value::Bool(*b),
        serde_json::Value::Number(n) => match n.as_i64() {
            Some(i) => Value::Integer(i),
            None => Value::Number(n.as_f64()?),
        },
        serde_json::Value::String(s) => Value::Text(s.clone()),
        other => Value::Text(other.to_string()),
    })
}
