//! CityGML 2.0 files, written as a stream.

use super::metadata;
use super::names::{ROOF_TYPE_LIST, gml_id, roof_type_code, unit};
use super::xml::{Xml, decimal};
use crate::cityjson::{Header, clean, part_id, semantic_name};
use crate::quantise::{STEPS_PER_METRE, lattice};
use crate::{Attributes, Building, CityModel, Error, Face, Semantic, Shell, Terrain, Value, quantised};
use gable_geometry::{Crs, DVec3};
use gable_reference_systems::northing_first;
use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

const NAMESPACES: [(&str, &str); 8] = [
    ("xmlns", "http://www.opengis.net/citygml/2.0"),
    ("xmlns:bldg", "http://www.opengis.net/citygml/building/2.0"),
    ("xmlns:dem", "http://www.opengis.net/citygml/relief/2.0"),
    ("xmlns:gen", "http://www.opengis.net/citygml/generics/2.0"),
    ("xmlns:gml", "http://www.opengis.net/gml"),
    ("xmlns:xlink", "http://www.w3.org/1999/xlink"),
    ("xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance"),
    (
        "xsi:schemaLocation",
        "http://www.opengis.net/citygml/building/2.0 http://schemas.opengis.net/citygml/building/2.0/building.xsd \
         http://www.opengis.net/citygml/relief/2.0 http://schemas.opengis.net/citygml/relief/2.0/relief.xsd \
         http://www.opengis.net/citygml/generics/2.0 http://schemas.opengis.net/citygml/generics/2.0/generics.xsd",
    ),
];

/// The name of a reference system for coordinates with the easting first; empty if it has none.
///
/// A URN stands for the order of the axes in EPSG's definition, and programs that keep to that (GDAL, FME) would swap the coordinates
/// of a system that names its northing first. The short form stands for easting, northing with all of them. 3DCityDB reads either
/// form, and never swaps.
pub(super) fn srs_name(crs: &Crs) -> String {
    let short = northing_first(crs);
    match crs {
        Crs::Epsg(_) | Crs::Compound { .. } if short => crs.to_string(),
        Crs::Epsg(code) => format!("urn:ogc:def:crs:EPSG::{code}"),
        Crs::Compound { horizontal, vertical } => {
            format!("urn:ogc:def:crs,crs:EPSG::{horizontal},crs:EPSG::{vertical}")
        }
        Crs::Enu { .. } | Crs::Unknown => String::new(),
    }
}

/// Writes CityGML 2.0 building by building; memory is bounded by the largest building and the identifiers.
///
/// Coordinates are written easting, northing, height, as practically all CityGML files and programs have it (also
/// where the EPSG definition names the northing first), with four decimals: the same quantised geometries as in
/// CityJSON. An EPSG code or pair of codes stands in the envelope's `srsName`, as a URN, or in the short form `EPSG:2180` where a URN
/// would stand for northing, easting; a local tangent plane in the model's `gml:description`.
///
/// A building has `lod0FootPrint`, `lod0RoofEdge`, `lod1Solid` with its polygons, and `lod2Solid` that refers to the
/// polygons of the `boundedBy` surfaces. Several solids of a LOD make `BuildingPart`s. `measuredHeight`, `roofType`
/// (with SIG3D's codes), `function`, `class`, `usage`, `yearOfConstruction` and `storeysAboveGround` are written as
/// the properties of that name; everything else as generic attributes, as measures with a unit where the name ends in
/// `_m`, `_m2`, `_m3` or `_deg`. Identifiers that are no XML names are rewritten and kept in `gml:name`.
pub struct GmlWriter<W: Write> {
    xml: Xml<W>,
    origin: [i64; 3],
    world: [f64; 3],
    ids: BTreeSet<String>,
}

impl<W: Write> GmlWriter<W> {
    /// Writes the beginning of the file, with name and envelope. Give a buffered stream.
    ///
    /// # Errors
    /// If the stream fails.
    pub fn new(out: W, header: &Header) -> Result<Self, Error> {
        let mut xml = Xml::new(out)?;
        let origin = header.origin.map(|v| (v * STEPS_PER_METRE).round() as i64);
        xml.open("CityModel", &NAMESPACES)?;
        metadata::write(&mut xml, header)?;
        if let Crs::Enu { .. } = header.crs {
            xml.leaf("gml:description", &[], &header.crs.to_string())?;
        }
        xml.leaf("gml:name", &[], &header.title)?;
        if let Some((low, high)) = header.extent {
            let mut attributes = vec![("srsDimension", "3")];
            let name = srs_name(&header.crs);
            if !name.is_empty() {
                attributes.insert(0, ("srsName", name.as_str()));
            }
            xml.open("gml:boundedBy", &[])?;
            xml.open("gml:Envelope", &attributes)?;
            for (corner, p) in [("gml:lowerCorner", low), ("gml:upperCorner", high)] {
                let q = lattice(p);
                let mut text = String::new();
                for i in 0..3 {
                    if i > 0 {
                        text.push(' ');
                    }
                    decimal(&mut text, origin[i].saturating_add(q[i]));
                }
                xml.leaf(corner, &[], &text)?;
            }
            xml.close("gml:Envelope")?;
            xml.close("gml:boundedBy")?;
        }
        Ok(Self { xml, origin, world: header.origin, ids: BTreeSet::new() })
    }

    /// Writes a building.
    ///
    /// # Errors
    /// If the stream fails, the identifier occurred before, an attribute is not finite, or a geometry is malformed.
    pub fn write_building(&mut self, building: &Building) -> Result<(), Error> {
        let id = building.id.as_str();
        let name = self.claim(id)?;
        for shell in building.lods.shells() {
            self.check(id, &shell.vertices, shell.is_well_formed())?;
        }
        finite(id, &building.attributes)?;
        for face in building.lods.shells().flat_map(|shell| &shell.faces) {
            finite(id, &face.attributes)?;
        }
        let lods = &building.lods;
        self.xml.open("cityObjectMember", &[])?;
        self.xml.open("bldg:Building", &[("gml:id", &name)])?;
        if name != id {
            self.xml.leaf("gml:name", &[], id)?;
        }
        self.generics(&building.attributes)?;
        self.properties(&building.attributes)?;
        for (property, surfaces) in [("bldg:lod0FootPrint", &lods.footprint), ("bldg:lod0RoofEdge", &lods.roof_edge)] {
            if let Some(surfaces) = surfaces.as_ref().map(quantised).filter(|s| !s.faces.is_empty()) {
                self.xml.open(property, &[])?;
                self.multi_surface(&surfaces)?;
                self.xml.close(property)?;
            }
        }
        let single = |solids: &[Shell]| (solids.len() == 1).then(|| quantised(&solids[0]));
        self.solids(&name, single(&lods.lod1).as_ref(), single(&lods.lod2).as_ref())?;
        let several = |solids: &[Shell]| if solids.len() > 1 { solids.len() } else { 0 };
        for k in 0..several(&lods.lod1).max(several(&lods.lod2)) {
            let part = self.claim(&part_id(id, k))?;
            let of = |solids: &[Shell]| solids.get(k).filter(|_| solids.len() > 1).map(quantised);
            self.xml.open("bldg:consistsOfBuildingPart", &[])?;
            self.xml.open("bldg:BuildingPart", &[("gml:id", &part)])?;
            self.solids(&part, of(&lods.lod1).as_ref(), of(&lods.lod2).as_ref())?;
            self.xml.close("bldg:BuildingPart")?;
            self.xml.close("bldg:consistsOfBuildingPart")?;
        }
        self.xml.close("bldg:Building")?;
        Ok(self.xml.close("cityObjectMember")?)
    }

    /// Writes terrain as a `dem:ReliefFeature` with one TIN of LOD1; triangles that rounding collapses are left out.
    ///
    /// # Errors
    /// As [`GmlWriter::write_building`].
    pub fn write_terrain(&mut self, terrain: &Terrain) -> Result<(), Error> {
        let feature = self.claim(&format!("{}-relief", terrain.id))?;
        let name = self.claim(&terrain.id)?;
        let count = terrain.vertices.len();
        let fits = terrain.triangles.iter().flatten().all(|&i| (i as usize) < count);
        self.check(&terrain.id, &terrain.vertices, fits && terrain.vertices.iter().all(|p| p.is_finite()))?;
        self.xml.open("cityObjectMember", &[])?;
        self.xml.open("dem:ReliefFeature", &[("gml:id", &feature)])?;
        self.xml.leaf("dem:lod", &[], "1")?;
        self.xml.open("dem:reliefComponent", &[])?;
        self.xml.open("dem:TINRelief", &[("gml:id", &name)])?;
        if name != terrain.id {
            self.xml.leaf("gml:name", &[], &terrain.id)?;
        }
        self.xml.leaf("dem:lod", &[], "1")?;
        self.xml.open("dem:tin", &[])?;
        self.xml.open("gml:TriangulatedSurface", &[])?;
        self.xml.open("gml:trianglePatches", &[])?;
        for triangle in &terrain.triangles {
            let corners = triangle.map(|i| self.place(terrain.vertices[i as usize]));
            if corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0] {
                continue;
            }
            self.xml.open("gml:Triangle", &[])?;
            self.xml.open("gml:exterior", &[])?;
            self.xml.ring(corners.into_iter())?;
            self.xml.close("gml:exterior")?;
            self.xml.close("gml:Triangle")?;
        }
        for name in
            ["gml:trianglePatches", "gml:TriangulatedSurface", "dem:tin", "dem:TINRelief", "dem:reliefComponent"]
        {
            self.xml.close(name)?;
        }
        self.xml.close("dem:ReliefFeature")?;
        Ok(self.xml.close("cityObjectMember")?)
    }

    /// Writes the end of the file, flushes and gives the stream back.
    ///
    /// # Errors
    /// If the stream fails.
    pub fn finish(mut self) -> Result<W, Error> {
        self.xml.close("CityModel")?;
        Ok(self.xml.finish()?)
    }

    /// The `gml:id` of an identifier, which must be new.
    fn claim(&mut self, id: &str) -> Result<String, Error> {
        let name = gml_id(id);
        if self.ids.insert(name.clone()) {
            Ok(name)
        } else {
            Err(Error::object(id, "the identifier occurs twice: make identifiers unique"))
        }
    }

    fn check(&self, id: &str, points: &[DVec3], well_formed: bool) -> Result<(), Error> {
        if !well_formed {
            return Err(Error::object(id, "a vertex index is out of range or a coordinate is not finite"));
        }
        // Far beyond any reference system, far within the integers.
        let far = points.iter().any(|p| p.abs().max_element() > 1e9) || self.origin.iter().any(|v| v.abs() > 1 << 55);
        if far { Err(Error::Range { id: id.to_owned(), origin: self.world }) } else { Ok(()) }
    }

    fn place(&self, p: DVec3) -> [i64; 3] {
        let q = lattice(p);
        std::array::from_fn(|i| self.origin[i] + q[i])
    }

    /// LOD1 and LOD2 of a building or part, in the schema's order.
    fn solids(&mut self, name: &str, lod1: Option<&Shell>, lod2: Option<&Shell>) -> Result<(), Error> {
        if let Some(shell) = lod1.filter(|shell| !shell.faces.is_empty()) {
            self.solid("bldg:lod1Solid", |own| {
                shell.faces.iter().try_for_each(|face| own.surface_member(shell, face, None))
            })?;
        }
        let Some(shell) = lod2.filter(|shell| !shell.faces.is_empty()) else { return Ok(()) };
        self.solid("bldg:lod2Solid", |own| {
            (0..shell.faces.len()).try_for_each(|f| {
                Ok(own.xml.empty("gml:surfaceMember", &[("xlink:href", &format!("#{name}_lod2_{f}_poly"))])?)
            })
        })?;
        for (f, face) in shell.faces.iter().enumerate() {
            let kind = match face.semantic {
                Semantic::GroundSurface => "bldg:GroundSurface",
                Semantic::WallSurface => "bldg:WallSurface",
                Semantic::RoofSurface => "bldg:RoofSurface",
            };
            debug_assert!(kind.ends_with(semantic_name(face.semantic)));
            let id = format!("{name}_lod2_{f}");
            self.xml.open("bldg:boundedBy", &[])?;
            self.xml.open(kind, &[("gml:id", &id)])?;
            self.generics(&face.attributes)?;
            self.xml.open("bldg:lod2MultiSurface", &[])?;
            self.xml.open("gml:MultiSurface", &[])?;
            self.surface_member(shell, face, Some(&format!("{id}_poly")))?;
            self.xml.close("gml:MultiSurface")?;
            self.xml.close("bldg:lod2MultiSurface")?;
            self.xml.close(kind)?;
            self.xml.close("bldg:boundedBy")?;
        }
        Ok(())
    }

    fn solid(&mut self, property: &str, members: impl FnOnce(&mut Self) -> Result<(), Error>) -> Result<(), Error> {
        let nest = [property, "gml:Solid", "gml:exterior", "gml:CompositeSurface"];
        for name in nest {
            self.xml.open(name, &[])?;
        }
        members(self)?;
        Ok(nest.iter().rev().try_for_each(|name| self.xml.close(name))?)
    }

    fn multi_surface(&mut self, shell: &Shell) -> Result<(), Error> {
        self.xml.open("gml:MultiSurface", &[])?;
        shell.faces.iter().try_for_each(|face| self.surface_member(shell, face, None))?;
        Ok(self.xml.close("gml:MultiSurface")?)
    }

    fn surface_member(&mut self, shell: &Shell, face: &Face, id: Option<&str>) -> Result<(), Error> {
        self.xml.open("gml:surfaceMember", &[])?;
        match id {
            Some(id) => self.xml.open("gml:Polygon", &[("gml:id", id)])?,
            None => self.xml.open("gml:Polygon", &[])?,
        }
        for (r, ring) in face.rings.iter().enumerate() {
            let name = if r == 0 { "gml:exterior" } else { "gml:interior" };
            self.xml.open(name, &[])?;
            let origin = self.origin;
            let place = |&i: &u32| {
                let q = lattice(shell.vertices[i as usize]);
                std::array::from_fn(|i| origin[i] + q[i])
            };
            self.xml.ring(ring.iter().map(place))?;
            self.xml.close(name)?;
        }
        self.xml.close("gml:Polygon")?;
        Ok(self.xml.close("gml:surfaceMember")?)
    }

    /// Attributes without a property of their own.
    fn generics(&mut self, attributes: &Attributes) -> Result<(), Error> {
        for (name, value) in attributes {
            if property(name, value).is_some() {
                continue;
            }
            let (kind, text) = match value {
                Value::Bool(b) => ("gen:stringAttribute", b.to_string()),
                Value::Integer(i) => ("gen:intAttribute", i.to_string()),
                Value::Number(n) if unit(name).is_some() => ("gen:measureAttribute", number(*n)),
                Value::Number(n) => ("gen:doubleAttribute", number(*n)),
                Value::Text(t) => ("gen:stringAttribute", t.clone()),
            };
            self.xml.open(kind, &[("name", name)])?;
            match unit(name).filter(|_| kind == "gen:measureAttribute") {
                Some(unit) => self.xml.leaf("gen:value", &[("uom", unit)], &text)?,
                None => self.xml.leaf("gen:value", &[], &text)?,
            }
            self.xml.close(kind)?;
        }
        Ok(())
    }

    /// Attributes that are properties of a building, in the schema's order.
    fn properties(&mut self, attributes: &Attributes) -> Result<(), Error> {
        for name in PROPERTIES {
            let Some(text) = attributes.get(name).and_then(|value| property(name, value)) else { continue };
            let element = format!("bldg:{name}");
            match (name, roof_type_code(&text)) {
                ("roofType", Some(code)) => self.xml.leaf(&element, &[("codeSpace", ROOF_TYPE_LIST)], code)?,
                ("measuredHeight", _) => self.xml.leaf(&element, &[("uom", "m")], &text)?,
                _ => self.xml.leaf(&element, &[], &text)?,
            }
        }
        Ok(())
    }
}

/// Properties of a building that attributes of the same name become, in the schema's order.
pub(super) const PROPERTIES: [&str; 7] =
    ["class", "function", "usage", "yearOfConstruction", "roofType", "measuredHeight", "storeysAboveGround"];

/// The text of an attribute that is a property, if its value fits the property's type.
pub(super) fn property(name: &str, value: &Value) -> Option<String> {
    match (name, value) {
        ("class" | "function" | "usage" | "roofType", Value::Text(t)) => Some(t.clone()),
        ("yearOfConstruction", Value::Integer(y)) if (1..=9999).contains(y) => Some(format!("{y:04}")),
        ("measuredHeight", Value::Number(h)) => Some(number(*h)),
        ("measuredHeight", Value::Integer(h)) => Some(h.to_string()),
        ("storeysAboveGround", Value::Integer(n)) if *n >= 0 => Some(n.to_string()),
        _ => None,
    }
}

/// A finite number with at most six decimals.
pub(super) fn number(n: f64) -> String {
    clean(n).unwrap_or_default().to_string()
}

pub(super) fn finite(id: &str, attributes: &Attributes) -> Result<(), Error> {
    for (name, value) in attributes {
        if let Value::Number(n) = value
            && !n.is_finite()
        {
            return Err(Error::object(id, format!("the attribute {name} is {n}: leave it out if it is not known")));
        }
    }
    Ok(())
}

/// Writes a city or tile as one CityGML 2.0 file; see [`GmlWriter`].
///
/// # Errors
/// As [`GmlWriter::write_building`].
pub fn write_citygml(model: &CityModel, out: impl Write) -> Result<(), Error> {
    let mut writer = GmlWriter::new(out, &Header::of(model))?;
    if let Some(terrain) = &model.terrain {
        writer.write_terrain(terrain)?;
    }
    model.buildings.iter().try_for_each(|building| writer.write_building(building))?;
    writer.finish().map(drop)
}

/// Writes a city or tile to a CityGML 2.0 file; see [`GmlWriter`].
///
/// # Errors
/// As [`GmlWriter::write_building`], and if the file cannot be made.
pub fn write_citygml_file(model: &CityModel, path: &Path) -> Result<(), Error> {
    let file = std::fs::File::create(path).map_err(|source| Error::File { path: path.to_owned(), source })?;
    write_citygml(model, std::io::BufWriter::new(file)).map_err(|error| match error {
        Error::Write(source) => Error::File { path: path.to_owned(), source },
        other => other,
    })
}
