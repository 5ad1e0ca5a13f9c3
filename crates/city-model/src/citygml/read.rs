//! Reading of CityGML 1.0 and 2.0.

use super::element::{Element, XmlError, for_each};
use super::names::{ROOF_TYPE_LIST, gml_id, roof_type_name};
use super::surfaces::{Defect, Gather, Library, positions};
use super::write::PROPERTIES;
use crate::budget::{self, Shared};
use crate::error::{Note, ReadOptions, Reading};
use crate::{Attributes, Building, CityModel, Error, Metadata, Semantic, Shell, Terrain, Value};
use gable_files::Reach;
use gable_geometry::{Crs, DVec3, Frame};
use std::cell::RefCell;
use std::path::Path;

/// Reads the buildings and TINs of a CityGML file (1.0 or 2.0, UTF-8).
///
/// Buildings come with LOD 0, 1 and 2: solids, whose polygons may be references to those of the boundary surfaces
/// (with or without `#`), or else MultiSurfaces, or else the boundary surfaces themselves. Solids of BuildingParts
/// join their building. The attributes are the generic ones and the simple properties that the writer writes.
/// Everything else is left out, in part with a note. Coordinates are taken as easting, northing, height.
///
/// The text stands in memory, the elements only for one city object at a time. O(bytes).
///
/// # Errors
/// If the file cannot be read, is not CityGML, or a geometry is broken; with the byte offset.
pub fn read_citygml(path: &Path, options: &ReadOptions) -> Result<Reading, Error> {
    let text = Reach::everything().read_text(path, budget::FILE)?;
    let failed = |(offset, reason): Defect| Error::content(path, format!("byte {offset}"), reason);
    let shared = RefCell::new(Shared::of_file(text.len()));
    let mut city = City { options: options.clone(), shared, ..City::default() };
    let wanted = ["cityObjectMember", "featureMember", "boundedBy", "name", "description"];
    let root = for_each(&text, &wanted, |element| city.element(&element)).map_err(|e: Failure| failed(e.0))?;
    if root != "CityModel" {
        return Err(failed((0, format!("the root is {root:?}, not a CityModel"))));
    }
    let City { title, crs, origin, buildings, terrain, notes, .. } = city;
    let model =
        CityModel { title, metadata: Metadata::default(), origin: origin.unwrap_or([0.0; 3]), crs, buildings, terrain };
    Ok(Reading { model, notes })
}

struct Failure(Defect);

impl From<XmlError> for Failure {
    fn from(error: XmlError) -> Self {
        Self((error.offset, error.reason))
    }
}

impl From<Defect> for Failure {
    fn from(defect: Defect) -> Self {
        Self(defect)
    }
}

struct City {
    options: ReadOptions,
    title: String,
    crs: Crs,
    origin: Option<[f64; 3]>,
    buildings: Vec<Building>,
    terrain: Option<Terrain>,
    notes: Vec<Note>,
    shared: RefCell<Shared>,
}

impl Default for City {
    fn default() -> Self {
        Self {
            options: ReadOptions::default(),
            title: String::new(),
            crs: Crs::Unknown,
            origin: None,
            buildings: Vec::new(),
            terrain: None,
            notes: Vec::new(),
            shared: RefCell::new(Shared::of_file(0)),
        }
    }
}

impl City {
    fn note(&mut self, id: &str, message: impl Into<String>) {
        self.notes.push(Note { id: id.to_owned(), message: message.into() });
    }

    /// A child of the root.
    fn element(&mut self, element: &Element) -> Result<(), Failure> {
        match element.name.as_str() {
            "name" => self.title = element.text.trim().to_owned(),
            "description" => {
                if let Ok(crs @ Crs::Enu { .. }) = element.text.parse() {
                    self.crs = crs;
                }
            }
            "boundedBy" => self.envelope(element)?,
            _ => {
                for object in &element.children {
                    match object.name.as_str() {
                        "Building" => {
                            let building = self.building(object)?;
                            self.buildings.push(building);
                        }
                        "ReliefFeature" | "TINRelief" => self.relief(object)?,
                        other => {
                            let id = object.attribute("id").unwrap_or_default().to_owned();
                            self.note(&id, format!("left out: a {other}"));
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn envelope(&mut self, bounded: &Element) -> Result<(), Failure> {
        let Some(envelope) = bounded.child("Envelope") else { return Ok(()) };
        if let Some(name) = envelope.attribute("srsName") {
            match crate::semantics::crs_of(name) {
                Some(crs) => self.crs = crs,
                None => self.note("", format!("the reference system {name:?} is not understood")),
            }
        }
        let corner = envelope.child("lowerCorner");
        let numbers =
            corner.map(|c| c.text.split_ascii_whitespace().filter_map(|w| w.parse().ok()).collect::<Vec<f64>>());
        if let Some([x, y, z]) = numbers.as_deref() {
            self.settle(DVec3::new(*x, *y, *z));
        }
        Ok(())
    }

    /// The local origin, settled by the options, the envelope or the first coordinate.
    fn settle(&mut self, near: DVec3) -> [f64; 3] {
        let chosen = self.options.origin;
        *self.origin.get_or_insert_with(|| chosen.unwrap_or_else(|| Frame::near(near, Crs::Unknown).origin))
    }

    /// The first coordinate of an object.
    fn first_position(object: &Element) -> Result<DVec3, Failure> {
        let ring = object.descendants().into_iter().find(|e| e.name == "LinearRing");
        Ok(ring.map(positions).transpose()?.and_then(|p| p.first().copied()).unwrap_or_default())
    }

    fn building(&mut self, object: &Element) -> Result<Building, Failure> {
        let gml = object.attribute("id").unwrap_or_default();
        let name = object.child("name").map(|name| name.text.trim());
        // The writer keeps an identifier that is no XML name as the building's name.
        let id = name.filter(|name| *name != gml && gml_id(name) == gml).unwrap_or(gml).to_owned();
        let origin = match self.origin {
            Some(origin) => origin,
            None => self.settle(Self::first_position(object)?),
        };
        let mut building = Building { id: id.clone(), attributes: attributes(object), lods: crate::Lods::default() };
        let mut library = Library::of(object);
        let shared = &self.shared;
        let parts: Vec<&Element> = object
            .descendants()
            .into_iter()
            .filter(|e| ["Building", "BuildingPart"].contains(&e.name.as_str()))
            .collect();
        for surface in parts.iter().flat_map(|part| boundary(part)) {
            library.learn(surface, &attributes(surface), shared)?;
        }
        let mut cavities = 0;
        for part in parts {
            let mut shell_of = |elements: &[&Element]| -> Result<Option<Shell>, Failure> {
                let mut gather = Gather::new(origin, shared);
                elements.iter().try_for_each(|element| library.shell(element, &mut gather))?;
                cavities += gather.cavities;
                Ok((!gather.shell.faces.is_empty()).then_some(gather.shell))
            };
            let lods = &mut building.lods;
            for (property, semantic, slot) in [
                ("lod0FootPrint", Semantic::GroundSurface, &mut lods.footprint),
                ("lod0RoofEdge", Semantic::RoofSurface, &mut lods.roof_edge),
            ] {
                if let Some(element) = part.child(property)
                    && let Some(mut shell) = shell_of(&[element])?
                {
                    shell.faces.iter_mut().for_each(|face| face.semantic = semantic);
                    crate::cityjson::merge(slot.get_or_insert_default(), shell);
                }
            }
            for (lod, slot) in [("lod1", &mut lods.lod1), ("lod2", &mut lods.lod2)] {
                let solids = part.children.iter().filter(|c| c.name.strip_prefix(lod) == Some("Solid"));
                let before = slot.len();
                for property in solids {
                    let mut bodies = property.descendants();
                    bodies.retain(|e| e.name == "Solid");
                    for body in bodies {
                        slot.extend(shell_of(&[body])?);
                    }
                }
                if slot.len() == before
                    && let Some(surfaces) =
                        part.children.iter().find(|c| c.name.strip_prefix(lod) == Some("MultiSurface"))
                {
                    slot.extend(shell_of(&[surfaces])?);
                }
                if slot.len() == before && lod == "lod2" {
                    let surfaces: Vec<_> = boundary(part).flat_map(|s| s.child("lod2MultiSurface")).collect();
                    slot.extend(shell_of(&surfaces)?);
                }
            }
        }
        if cavities > 0 {
            self.note(&id, format!("left out: {cavities} cavities of solids"));
        }
        Ok(building)
    }

    fn relief(&mut self, object: &Element) -> Result<(), Failure> {
        let origin = match self.origin {
            Some(origin) => origin,
            None => self.settle(Self::first_position(object)?),
        };
        for tin in object.descendants().into_iter().filter(|e| e.name == "TINRelief") {
            let mut gather = Gather::new(origin, &self.shared);
            Library::of(tin).shell(tin, &mut gather)?;
            let id = tin.attribute("id").unwrap_or_default();
            let name = tin.child("name").map(|name| name.text.trim());
            let id = name.filter(|name| gml_id(name) == id).unwrap_or(id).to_owned();
            let terrain = self.terrain.get_or_insert_with(|| Terrain { id, ..Terrain::default() });
            let shift = terrain.vertices.len() as u32;
            let triangles = crate::triangulate(&gather.shell);
            terrain.triangles.extend(triangles.iter().map(|t| t.corners.map(|i| i + shift)));
            terrain.vertices.extend(gather.shell.vertices);
        }
        Ok(())
    }
}

/// The boundary surfaces of a building or part, not those of its parts.
fn boundary(part: &Element) -> impl Iterator<Item = &Element> {
    part.children.iter().filter(|c| c.name == "boundedBy").flat_map(|c| &c.children).filter(|s| s.name != "Envelope")
}

/// Generic attributes and simple properties of an object.
fn attributes(object: &Element) -> Attributes {
    let mut found = Attributes::new();
    for child in &object.children {
        let text = || child.child("value").map(|value| value.text.trim().to_owned());
        let name = child.attribute("name").unwrap_or_default().to_owned();
        let generic = match child.name.as_str() {
            "intAttribute" => text().and_then(|t| t.parse().ok()).map(Value::Integer),
            "doubleAttribute" | "measureAttribute" => {
                text().and_then(|t| t.parse().ok()).filter(|n: &f64| n.is_finite()).map(Value::Number)
            }
            "stringAttribute" | "dateAttribute" | "uriAttribute" => text().map(Value::Text),
            _ => None,
        };
        if let Some(value) = generic {
            found.insert(name, value);
        } else if PROPERTIES.contains(&child.name.as_str()) {
            let text = child.text.trim();
            let value = match child.name.as_str() {
                "measuredHeight" => text.parse().ok().filter(|n: &f64| n.is_finite()).map(Value::Number),
                "storeysAboveGround" | "yearOfConstruction" => text.parse().ok().map(Value::Integer),
                "roofType" if child.attribute("codeSpace") == Some(ROOF_TYPE_LIST) => {
                    Some(Value::Text(roof_type_name(text).unwrap_or(text).to_owned()))
                }
                _ => Some(Value::Text(text.to_owned())),
            };
            if let Some(value) = value {
                found.insert(child.name.clone(), value);
            }
        }
    }
    found
}
