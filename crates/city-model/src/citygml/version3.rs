//! CityGML 3.0 files, written as a stream.

use super::metadata;
use super::names::{ROOF_TYPE_LIST, gml_id, roof_type_code, unit};
use super::write::{finite, number, property, srs_name};
use super::xml::{Xml, decimal};
use crate::cityjson::{Header, part_id};
use crate::quantise::{STEPS_PER_METRE, lattice};
use crate::{Attributes, Building, CityModel, Error, Face, Semantic, Shell, Terrain, Value, quantised};
use gable_geometry::{Crs, DVec3};
use std::collections::BTreeSet;
use std::io::Write;

const NAMESPACES: [(&str, &str); 9] = [
    ("xmlns", "http://www.opengis.net/citygml/3.0"),
    ("xmlns:bldg", "http://www.opengis.net/citygml/building/3.0"),
    ("xmlns:con", "http://www.opengis.net/citygml/construction/3.0"),
    ("xmlns:dem", "http://www.opengis.net/citygml/relief/3.0"),
    ("xmlns:gen", "http://www.opengis.net/citygml/generics/3.0"),
    ("xmlns:gml", "http://www.opengis.net/gml/3.2"),
    ("xmlns:xlink", "http://www.w3.org/1999/xlink"),
    ("xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance"),
    (
        "xsi:schemaLocation",
        "http://www.opengis.net/citygml/building/3.0 http://schemas.opengis.net/citygml/building/3.0/building.xsd \
         http://www.opengis.net/citygml/relief/3.0 http://schemas.opengis.net/citygml/relief/3.0/relief.xsd \
         http://www.opengis.net/citygml/generics/3.0 http://schemas.opengis.net/citygml/generics/3.0/generics.xsd",
    ),
];

/// Identifier of the model: the standard asks for one.
const MODEL: &str = "city-model";

/// INSPIRE's list of where heights are measured.
const HEIGHT_REFERENCES: &str = "http://inspire.ec.europa.eu/codelist/ElevationReferenceValue";

/// Writes CityGML 3.0 building by building; memory is bounded by the largest building and the identifiers.
///
/// What is written is that of [`GmlWriter`](super::GmlWriter), where version 3 has it: footprint and roof edge as ground and roof
/// surfaces with a `lod0MultiSurface`, the roof shape as boundaries with a `lod2MultiSurface` to whose polygons the `lod2Solid`
/// refers, `measuredHeight` as `con:height`, `yearOfConstruction` as the first of January in `con:dateOfConstruction`.
struct Gml3Writer<W: Write> {
    xml: Xml<W>,
    origin: [i64; 3],
    world: [f64; 3],
    ids: BTreeSet<String>,
}

impl<W: Write> Gml3Writer<W> {
    fn new(out: W, header: &Header) -> Result<Self, Error> {
        let mut xml = Xml::new(out)?;
        let origin = header.origin.map(|v| (v * STEPS_PER_METRE).round() as i64);
        let attributes: Vec<(&str, &str)> = NAMESPACES.into_iter().chain([("gml:id", MODEL)]).collect();
        xml.open("CityModel", &attributes)?;
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
        Ok(Self { xml, origin, world: header.origin, ids: BTreeSet::from([MODEL.to_owned()]) })
    }

    fn building(&mut self, building: &Building) -> Result<(), Error> {
        let id = building.id.as_str();
        let name = self.claim(id)?;
        finite(id, &building.attributes)?;
        for shell in building.lods.shells() {
            self.check(id, &shell.vertices, shell.is_well_formed())?;
            shell.faces.iter().try_for_each(|face| finite(id, &face.attributes))?;
        }
        let lods = &building.lods;
        self.xml.open("cityObjectMember", &[])?;
        self.xml.open("bldg:Building", &[("gml:id", &name)])?;
        if name != id {
            self.xml.leaf("gml:name", &[], id)?;
        }
        self.generics(&building.attributes)?;
        let flat = [("con:GroundSurface", "ground", &lods.footprint), ("con:RoofSurface", "roof", &lods.roof_edge)];
        for (kind, part, surfaces) in flat {
            if let Some(shell) = surfaces.as_ref().map(quantised).filter(|s| !s.faces.is_empty()) {
                self.surface(kind, &format!("{name}_lod0_{part}"), "lod0MultiSurface", &shell, &shell.faces)?;
            }
        }
        let single = |solids: &[Shell]| (solids.len() == 1).then(|| quantised(&solids[0]));
        self.solids(&name, single(&lods.lod1).as_ref(), single(&lods.lod2).as_ref())?;
        self.construction(&building.attributes)?;
        let several = |solids: &[Shell]| if solids.len() > 1 { solids.len() } else { 0 };
        for k in 0..several(&lods.lod1).max(several(&lods.lod2)) {
            let part = self.claim(&part_id(id, k))?;
            let of = |solids: &[Shell]| solids.get(k).filter(|_| solids.len() > 1).map(quantised);
            self.xml.open("bldg:buildingPart", &[])?;
            self.xml.open("bldg:BuildingPart", &[("gml:id", &part)])?;
            self.solids(&part, of(&lods.lod1).as_ref(), of(&lods.lod2).as_ref())?;
            self.xml.close("bldg:BuildingPart")?;
            self.xml.close("bldg:buildingPart")?;
        }
        self.xml.close("bldg:Building")?;
        Ok(self.xml.close("cityObjectMember")?)
    }

    fn terrain(&mut self, terrain: &Terrain) -> Result<(), Error> {
        let relief = self.claim(&format!("{}-relief", terrain.id))?;
        let name = self.claim(&terrain.id)?;
        let count = terrain.vertices.len();
        let is_well_formed = terrain.triangles.iter().flatten().all(|&i| (i as usize) < count)
            && terrain.vertices.iter().all(|p| p.is_finite());
        self.check(&terrain.id, &terrain.vertices, is_well_formed)?;
        self.xml.open("cityObjectMember", &[])?;
        self.xml.open("dem:ReliefFeature", &[("gml:id", &relief)])?;
        self.xml.leaf("dem:lod", &[], "1")?;
        self.xml.open("dem:reliefComponent", &[])?;
        self.xml.open("dem:TINRelief", &[("gml:id", &name)])?;
        if name != terrain.id {
            self.xml.leaf("gml:name", &[], &terrain.id)?;
        }
        self.xml.leaf("dem:lod", &[], "1")?;
        self.xml.open("dem:tin", &[])?;
        self.xml.open("gml:TriangulatedSurface", &[("gml:id", &format!("{name}_tin"))])?;
        self.xml.open("gml:patches", &[])?;
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
        let open = ["gml:patches", "gml:TriangulatedSurface", "dem:tin", "dem:TINRelief", "dem:reliefComponent"];
        for name in open.into_iter().chain(["dem:ReliefFeature", "cityObjectMember"]) {
            self.xml.close(name)?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<W, Error> {
        self.xml.close("CityModel")?;
        Ok(self.xml.finish()?)
    }

    /// The `gml:id` of an identifier, which must be new.
    fn claim(&mut self, id: &str) -> Result<String, Error> {
        let name = gml_id(id);
        let is_new = self.ids.insert(name.clone());
        if is_new { Ok(name) } else { Err(Error::object(id, "the identifier occurs twice: make identifiers unique")) }
    }

    fn check(&self, id: &str, points: &[DVec3], well_formed: bool) -> Result<(), Error> {
        if !well_formed {
            return Err(Error::object(id, "a vertex index is out of range or a coordinate is not finite"));
        }
        let far = points.iter().any(|p| p.abs().max_element() > 1e9) || self.origin.iter().any(|v| v.abs() > 1 << 55);
        if far { Err(Error::Range { id: id.to_owned(), origin: self.world }) } else { Ok(()) }
    }

    fn place(&self, p: DVec3) -> [i64; 3] {
        let q = lattice(p);
        std::array::from_fn(|i| self.origin[i] + q[i])
    }

    /// Boundaries and solids of a building or part, in the schema's order: all boundaries first.
    fn solids(&mut self, name: &str, lod1: Option<&Shell>, lod2: Option<&Shell>) -> Result<(), Error> {
        let lod1 = lod1.filter(|shell| !shell.faces.is_empty());
        let lod2 = lod2.filter(|shell| !shell.faces.is_empty());
        for (f, face) in lod2.iter().flat_map(|shell| shell.faces.iter().enumerate()) {
            let kind = match face.semantic {
                Semantic::GroundSurface => "con:GroundSurface",
                Semantic::WallSurface => "con:WallSurface",
                Semantic::RoofSurface => "con:RoofSurface",
            };
            let Some(shell) = lod2 else { continue };
            self.surface(kind, &format!("{name}_lod2_{f}"), "lod2MultiSurface", shell, std::slice::from_ref(face))?;
        }
        if let Some(shell) = lod1 {
            self.solid("lod1Solid", &format!("{name}_lod1"), |own| {
                let faces = shell.faces.iter().enumerate();
                let mut faces = faces.map(|(f, face)| (format!("{name}_lod1_{f}_poly"), face));
                faces.try_for_each(|(id, face)| own.surface_member(shell, face, &id))
            })?;
        }
        if let Some(shell) = lod2 {
            self.solid("lod2Solid", &format!("{name}_lod2"), |own| {
                (0..shell.faces.len()).try_for_each(|f| {
                    let polygon = format!("#{name}_lod2_{f}_poly_0");
                    Ok(own.xml.empty("gml:surfaceMember", &[("xlink:href", &polygon)])?)
                })
            })?;
        }
        Ok(())
    }

    /// A thematic surface that bounds a building.
    fn surface(&mut self, kind: &str, id: &str, property: &str, shell: &Shell, faces: &[Face]) -> Result<(), Error> {
        self.xml.open("boundary", &[])?;
        self.xml.open(kind, &[("gml:id", id)])?;
        if let [face] = faces {
            self.generics(&face.attributes)?;
        }
        self.xml.open(property, &[])?;
        self.xml.open("gml:MultiSurface", &[("gml:id", &format!("{id}_surface"))])?;
        for (f, face) in faces.iter().enumerate() {
            self.surface_member(shell, face, &format!("{id}_poly_{f}"))?;
        }
        self.xml.close("gml:MultiSurface")?;
        self.xml.close(property)?;
        self.xml.close(kind)?;
        Ok(self.xml.close("boundary")?)
    }

    fn solid(
        &mut self,
        property: &str,
        id: &str,
        members: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.xml.open(property, &[])?;
        self.xml.open("gml:Solid", &[("gml:id", &format!("{id}_solid"))])?;
        self.xml.open("gml:exterior", &[])?;
        self.xml.open("gml:Shell", &[])?;
        members(self)?;
        for name in ["gml:Shell", "gml:exterior", "gml:Solid", property] {
            self.xml.close(name)?;
        }
        Ok(())
    }

    fn surface_member(&mut self, shell: &Shell, face: &Face, id: &str) -> Result<(), Error> {
        self.xml.open("gml:surfaceMember", &[])?;
        self.xml.open("gml:Polygon", &[("gml:id", id)])?;
        let origin = self.origin;
        for (r, ring) in face.rings.iter().enumerate() {
            let name = if r == 0 { "gml:exterior" } else { "gml:interior" };
            self.xml.open(name, &[])?;
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
            let unit = unit(name);
            let (kind, text) = match value {
                Value::Bool(b) => ("gen:StringAttribute", b.to_string()),
                Value::Integer(i) => ("gen:IntAttribute", i.to_string()),
                Value::Number(n) if unit.is_some() => ("gen:MeasureAttribute", number(*n)),
                Value::Number(n) => ("gen:DoubleAttribute", number(*n)),
                Value::Text(t) => ("gen:StringAttribute", t.clone()),
            };
            self.xml.open("genericAttribute", &[])?;
            self.xml.open(kind, &[])?;
            self.xml.leaf("gen:name", &[], name)?;
            match unit.filter(|_| kind == "gen:MeasureAttribute") {
                Some(unit) => self.xml.leaf("gen:value", &[("uom", unit)], &text)?,
                None => self.xml.leaf("gen:value", &[], &text)?,
            }
            self.xml.close(kind)?;
            self.xml.close("genericAttribute")?;
        }
        Ok(())
    }

    /// Attributes that are properties of a construction or of a building, in the schema's order.
    fn construction(&mut self, attributes: &Attributes) -> Result<(), Error> {
        let text = |name: &str| attributes.get(name).and_then(|value| property(name, value));
        if let Some(year) = text("yearOfConstruction") {
            self.xml.leaf("con:dateOfConstruction", &[], &format!("{year}-01-01"))?;
        }
        if let Some(height) = text("measuredHeight") {
            self.xml.open("con:height", &[])?;
            self.xml.open("con:Height", &[])?;
            let list = [("codeSpace", HEIGHT_REFERENCES)];
            self.xml.leaf("con:highReference", &list, "highestPoint")?;
            self.xml.leaf("con:lowReference", &list, "generalGround")?;
            self.xml.leaf("con:status", &[], "measured")?;
            self.xml.leaf("con:value", &[("uom", "m")], &height)?;
            self.xml.close("con:Height")?;
            self.xml.close("con:height")?;
        }
        for name in ["class", "function", "usage", "roofType", "storeysAboveGround"] {
            let Some(text) = text(name) else { continue };
            let element = format!("bldg:{name}");
            match roof_type_code(&text).filter(|_| name == "roofType") {
                Some(code) => self.xml.leaf(&element, &[("codeSpace", ROOF_TYPE_LIST)], code)?,
                None => self.xml.leaf(&element, &[], &text)?,
            }
        }
        Ok(())
    }
}

/// Writes a city or tile as one CityGML 3.0 file.
///
/// Coordinates, identifiers and the name of the reference system are those of [`write_citygml`](super::write_citygml); the geometries
/// are the same, footprint and roof edge as ground and roof surfaces of LOD 0, the roof shape as boundaries to whose polygons the solid
/// refers. `measuredHeight` becomes `con:height`, and `yearOfConstruction` the first of January of that year in `con:dateOfConstruction`.
///
/// # Errors
/// If the stream fails, an identifier occurs twice, an attribute is not finite, or a geometry is malformed.
pub fn write_citygml3(model: &CityModel, out: impl Write) -> Result<(), Error> {
    let mut writer = Gml3Writer::new(out, &Header::of(model))?;
    if let Some(terrain) = &model.terrain {
        writer.terrain(terrain)?;
    }
    model.buildings.iter().try_for_each(|building| writer.building(building))?;
    writer.finish().map(drop)
}
