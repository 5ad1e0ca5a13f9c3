//! Polygons of a city object, inline or by reference.

use super::element::Element;
use crate::budget::{self, Shared, TOO_MUCH};
use crate::{Attributes, Face, Semantic, Shell, semantics};
use gable_geometry::{DVec3, dvec3};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};

/// A reason why a geometry could not be read, with the byte offset.
pub(super) type Defect = (u64, String);

/// All polygons of a building by their `gml:id`, and what the boundary surfaces say about them.
#[derive(Default)]
pub(super) struct Library<'a> {
    polygons: HashMap<&'a str, &'a Element>,
    meanings: BTreeMap<&'a str, (Option<Semantic>, Attributes)>,
}

impl<'a> Library<'a> {
    /// Registers the polygons below a building.
    pub(super) fn of(building: &'a Element) -> Self {
        let mut library = Self::default();
        for element in building.descendants() {
            if matches!(element.name.as_str(), "Polygon" | "Triangle" | "Rectangle" | "CompositeSurface")
                && let Some(id) = element.attribute("id")
            {
                library.polygons.entry(id).or_insert(element);
            }
        }
        library
    }

    /// Notes what a boundary surface says about the polygons in it and those that it refers to.
    pub(super) fn learn(
        &mut self,
        surface: &'a Element,
        attributes: &Attributes,
        shared: &RefCell<Shared>,
    ) -> Result<(), Defect> {
        let semantic = semantics::kind_of(&surface.name);
        let bytes = bytes_of(attributes);
        for element in surface.descendants() {
            let named = if element.name == "Polygon" { element.attribute("id") } else { href(element) };
            if let Some(id) = named {
                if !shared.borrow_mut().take_attributes(bytes) {
                    return Err((element.offset, TOO_MUCH.to_owned()));
                }
                self.meanings.insert(id, (semantic, attributes.clone()));
            }
        }
        Ok(())
    }

    /// The faces below a geometry element. Interiors of solids are counted, not read.
    pub(super) fn shell(&self, geometry: &'a Element, gather: &mut Gather<'_>) -> Result<(), Defect> {
        self.collect(geometry, false, &mut Vec::new(), gather)
    }

    fn collect(
        &self,
        element: &'a Element,
        reversed: bool,
        visited: &mut Vec<&'a str>,
        gather: &mut Gather<'_>,
    ) -> Result<(), Defect> {
        if !gather.shared.borrow_mut().take_corners(1) {
            return Err((element.offset, TOO_MUCH.to_owned()));
        }
        if let Some(id) = href(element) {
            let Some(target) = self.polygons.get(id) else {
                return Err((element.offset, format!("the reference to {id} leads nowhere in this building")));
            };
            if visited.contains(&id) {
                return Err((element.offset, format!("{id} refers to itself")));
            }
            if visited.len() == budget::REFERENCES {
                let reason = format!("references are nested deeper than {}", budget::REFERENCES);
                return Err((element.offset, reason));
            }
            visited.push(id);
            self.collect(target, reversed, visited, gather)?;
            visited.pop();
            return Ok(());
        }
        match element.name.as_str() {
            "Polygon" | "Triangle" | "Rectangle" => {
                let meaning = element.attribute("id").and_then(|id| self.meanings.get(id));
                gather.polygon(element, reversed, meaning)
            }
            "interior" => {
                gather.cavities += 1;
                Ok(())
            }
            _ => {
                let turned = element.name == "OrientableSurface" && element.attribute("orientation") == Some("-");
                element.children.iter().try_for_each(|c| self.collect(c, reversed ^ turned, visited, gather))
            }
        }
    }
}

fn href(element: &Element) -> Option<&str> {
    element.attribute("href").map(|id| id.strip_prefix('#').unwrap_or(id))
}

/// A shell that is gathered polygon by polygon; equal coordinates are one vertex.
pub(super) struct Gather<'a> {
    origin: DVec3,
    shared: &'a RefCell<Shared>,
    exact: HashMap<[u64; 3], u32>,
    pub(super) shell: Shell,
    /// Inner shells of solids that were passed over.
    pub(super) cavities: usize,
}

impl<'a> Gather<'a> {
    pub(super) fn new(origin: [f64; 3], shared: &'a RefCell<Shared>) -> Self {
        let origin = DVec3::from_array(origin);
        Self { origin, shared, exact: HashMap::new(), shell: Shell::default(), cavities: 0 }
    }

    fn polygon(
        &mut self,
        polygon: &Element,
        reversed: bool,
        meaning: Option<&(Option<Semantic>, Attributes)>,
    ) -> Result<(), Defect> {
        let mut rings: Vec<Vec<u32>> = Vec::new();
        for part in polygon.children.iter().filter(|c| c.name == "exterior" || c.name == "interior") {
            let Some(linear) = part.child("LinearRing") else {
                return Err((part.offset, "a ring that is not a LinearRing".to_owned()));
            };
            let corners = positions(linear)?;
            if !self.shared.borrow_mut().take_corners(corners.len()) {
                return Err((part.offset, TOO_MUCH.to_owned()));
            }
            if let Some(far) = corners.iter().find(|p| is_far(**p, self.origin)) {
                let reason = format!("the corner {far} lies far from everything: are the coordinates in metres?");
                return Err((part.offset, reason));
            }
            let mut ring: Vec<u32> = corners.into_iter().map(|p| self.vertex(p - self.origin)).collect();
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            if reversed {
                ring.reverse();
            }
            if part.name == "exterior" {
                rings.insert(0, ring);
            } else {
                rings.push(ring);
            }
        }
        let mut face = Face { rings, semantic: Semantic::WallSurface, attributes: Attributes::new() };
        let known = meaning.and_then(|(semantic, _)| *semantic);
        face.semantic = known.unwrap_or_else(|| semantics::of_normal(self.shell.vector_area(&face)));
        if let Some((_, attributes)) = meaning {
            if !self.shared.borrow_mut().take_attributes(bytes_of(attributes)) {
                return Err((polygon.offset, TOO_MUCH.to_owned()));
            }
            face.attributes.clone_from(attributes);
        }
        self.shell.faces.push(face);
        Ok(())
    }

    fn vertex(&mut self, p: DVec3) -> u32 {
        let vertices = &mut self.shell.vertices;
        let next = vertices.len() as u32;
        *self.exact.entry((p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(|| {
            vertices.push(p);
            next
        })
    }
}

/// Memory that attributes take, bytes.
fn bytes_of(attributes: &Attributes) -> usize {
    attributes.iter().map(|(name, value)| name.len() + value.bytes()).sum()
}

fn is_far(world: DVec3, origin: DVec3) -> bool {
    world.abs().max_element() > budget::WORLD || (world - origin).abs().max_element() > budget::REACH
}

/// World coordinates of a ring: one `posList` or several `pos`.
pub(super) fn positions(ring: &Element) -> Result<Vec<DVec3>, Defect> {
    let mut numbers = Vec::new();
    for child in ring.children.iter().filter(|c| c.name == "posList" || c.name == "pos") {
        for word in child.text.split_ascii_whitespace() {
            let number: f64 = word.parse().map_err(|_| (child.offset, format!("{word:?} is not a number")))?;
            if !number.is_finite() {
                return Err((child.offset, format!("the coordinate {word} is not finite")));
            }
            numbers.push(number);
        }
    }
    if numbers.is_empty() {
        return Err((ring.offset, "a ring without posList or pos".to_owned()));
    }
    if !numbers.len().is_multiple_of(3) {
        let reason = format!("a ring has {} numbers, not a multiple of three", numbers.len());
        return Err((ring.offset, reason));
    }
    Ok(numbers.chunks_exact(3).map(|c| dvec3(c[0], c[1], c[2])).collect())
}
