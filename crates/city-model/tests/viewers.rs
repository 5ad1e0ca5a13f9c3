//! OBJ and GLB as other readers have them, and CityGML 3.0.

mod common;

use common::city;
use gable_city_model::{Metadata, write_citygml, write_citygml3, write_cityjson, write_glb, write_mtl, write_obj};
use gable_geometry::Crs;

#[test]
fn an_obj_has_the_surfaces_of_the_model() {
    let model = city(Crs::Epsg(7415));
    let mut bytes = Vec::new();
    write_obj(&model, "a.mtl", &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains("origin 85000 446000 0, reference system EPSG:7415") && text.contains("\nmtllib a.mtl\n"));
    let options = tobj::LoadOptions { triangulate: false, single_index: false, ..tobj::LoadOptions::default() };
    let mut materials = Vec::new();
    write_mtl(&mut materials).unwrap();
    let load = |_: &std::path::Path| tobj::load_mtl_buf(&mut materials.as_slice());
    let (models, materials) = tobj::load_obj_buf(&mut text.as_bytes(), &options, load).unwrap();
    let materials = materials.unwrap();
    let mut areas = std::collections::BTreeMap::new();
    for found in &models {
        let mesh = &found.mesh;
        let point = |i: u32| gable_geometry::DVec3::from_slice(&mesh.positions[3 * i as usize..][..3]);
        for corners in mesh.indices.chunks(3) {
            let [a, b, c] = [corners[0], corners[1], corners[2]].map(point);
            let name = materials[mesh.material_id.unwrap()].name.clone();
            *areas.entry((found.name.clone(), name)).or_insert(0.0) += (b - a).cross(c - a).length() / 2.0;
        }
    }
    for building in &model.buildings {
        for (semantic, name) in [
            (gable_city_model::Semantic::RoofSurface, "RoofSurface"),
            (gable_city_model::Semantic::WallSurface, "WallSurface"),
            (gable_city_model::Semantic::GroundSurface, "GroundSurface"),
        ] {
            let expected: f64 = building.best().1.iter().map(|shell| shell.area_of(semantic)).sum();
            let found = areas.get(&(building.id.clone(), name.to_owned())).copied().unwrap_or(0.0);
            assert!((found - expected).abs() < 1e-2 + 1e-4 * expected, "{} {name}: {found}, {expected}", building.id);
        }
    }
    assert!(areas.keys().any(|(_, material)| material == "Terrain"));
}

#[test]
fn a_glb_has_a_node_for_each_building() {
    let model = city(Crs::Epsg(7415));
    let bytes = write_glb(&model).unwrap().unwrap();
    assert_eq!(bytes, write_glb(&model).unwrap().unwrap());
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    let buffer = gltf.blob.as_deref().unwrap();
    let scene = gltf.default_scene().unwrap();
    assert_eq!(scene.nodes().count(), model.buildings.len() + 1, "and one for the terrain");
    for building in &model.buildings {
        let node = scene.nodes().find(|node| node.name() == Some(building.id.as_str())).expect("its node");
        let shift = gable_geometry::DVec3::from_array(node.transform().decomposed().0.map(f64::from));
        let mut area = 0.0;
        for primitive in node.mesh().unwrap().primitives() {
            let bytes = |accessor: &gltf::Accessor<'_>| {
                let begin = accessor.view().unwrap().offset() + accessor.offset();
                buffer[begin..begin + accessor.count() * accessor.size()].to_vec()
            };
            let numbers = |semantic| -> Vec<f64> {
                let bytes = bytes(&primitive.get(&semantic).unwrap());
                bytes.chunks(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect()
            };
            let places: Vec<_> =
                numbers(gltf::Semantic::Positions).chunks(3).map(gable_geometry::DVec3::from_slice).collect();
            let indices = primitive.indices().unwrap();
            let number = |b: &[u8]| b.iter().rev().fold(0, |n, &byte| n << 8 | usize::from(byte));
            let corners: Vec<usize> = bytes(&indices).chunks(indices.size()).map(number).collect();
            for t in corners.chunks(3) {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| places[i] + shift);
                area += (b - a).cross(c - a).length() / 2.0;
            }
            assert_eq!(numbers(gltf::Semantic::Normals).len(), 3 * places.len());
        }
        let expected: f64 = building.best().1.iter().map(|shell| shell.area()).sum();
        assert!((area - expected).abs() < 1e-3 * expected, "{}: {area}, {expected}", building.id);
    }
    assert!(write_glb(&gable_city_model::CityModel { buildings: vec![], terrain: None, ..model }).unwrap().is_none());
}

/// Whether elements stand in this order within the first of `within`.
fn in_order(text: &str, within: &str, elements: &[&str]) {
    let begin = text.find(&format!("<{within} ")).expect("the element");
    let end = begin + text[begin..].find(&format!("</{within}>")).expect("its end");
    let mut at = begin;
    for element in elements {
        let found = text[at..end]
            .find(&format!("<{element}"))
            .unwrap_or_else(|| panic!("{element} is not behind the last one"));
        at += found;
    }
}

#[test]
fn citygml_3_has_the_order_of_its_schema_and_an_identifier_for_each_geometry() {
    let mut bytes = Vec::new();
    write_citygml3(&city(Crs::Epsg(7415)), &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    // core:AbstractCityObject, core:AbstractSpace, con:AbstractConstruction, bldg:AbstractBuilding, bldg:Building.
    in_order(
        &text,
        "bldg:Building",
        &["genericAttribute>", "boundary>", "lod1Solid>", "lod2Solid>", "con:height>", "bldg:roofType"],
    );
    in_order(
        &text,
        "con:WallSurface",
        &["lod2MultiSurface>", "gml:MultiSurface ", "gml:surfaceMember>", "gml:Polygon "],
    );
    in_order(
        &text,
        "dem:TINRelief",
        &["dem:lod>", "dem:tin>", "gml:TriangulatedSurface ", "gml:patches>", "gml:Triangle>"],
    );
    let mut ids = std::collections::BTreeSet::new();
    for line in text.lines().map(str::trim) {
        let is_geometry = ["gml:Polygon", "gml:MultiSurface", "gml:Solid", "gml:TriangulatedSurface"]
            .iter()
            .any(|name| line.starts_with(&format!("<{name}>")) || line.starts_with(&format!("<{name} ")));
        let id = line.split_once("gml:id=\"").map(|(_, rest)| rest.split('"').next().unwrap_or_default());
        assert!(!is_geometry || id.is_some(), "{line}");
        if let Some(id) = id {
            assert!(ids.insert(id.to_owned()), "{id} occurs twice");
        }
    }
    for line in text.lines().filter_map(|line| line.split_once("xlink:href=\"#")) {
        let target = line.1.split('"').next().unwrap_or_default();
        assert!(ids.contains(target), "{target} is not there");
    }
}

#[test]
fn metadata_stands_in_every_city_model() {
    let given = |text: &str| Some(text.to_owned());
    let mut model = city(Crs::Epsg(7415));
    model.metadata = Metadata {
        identifier: given("nl.delft.2025"),
        reference_date: given("2025-04-30"),
        contact_name: given("City of <Delft>"),
        contact_email: given("geo@delft.example"),
        lineage: given("Oblique flight & gable"),
    };
    let mut bytes = Vec::new();
    write_cityjson(&model, &mut bytes).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    let found = &json["metadata"];
    assert_eq!((&found["identifier"], &found["referenceDate"]), (&"nl.delft.2025".into(), &"2025-04-30".into()));
    assert_eq!(found["pointOfContact"]["contactName"], "City of <Delft>");
    assert_eq!(found["pointOfContact"]["emailAddress"], "geo@delft.example");
    assert_eq!(found["lineage"], "Oblique flight & gable");
    let validator = cjval::CJValidator::from_str(std::str::from_utf8(&bytes).unwrap());
    for (criterion, outcome) in validator.validate() {
        assert!(!outcome.has_errors(), "{criterion}: {:?}", outcome.get_errors());
    }

    let (mut second, mut third) = (Vec::new(), Vec::new());
    write_citygml(&model, &mut second).unwrap();
    write_citygml3(&model, &mut third).unwrap();
    for bytes in [second, third] {
        let text = String::from_utf8(bytes).unwrap();
        for expected in [
            ">nl.delft.2025<",
            ">2025-04-30<",
            ">City of &lt;Delft&gt;<",
            ">geo@delft.example<",
            ">Oblique flight &amp; gable<",
        ] {
            assert!(text.contains(expected), "{expected}");
        }
        assert!(text.find("gml:metaDataProperty").unwrap() < text.find("<gml:name>").unwrap());
    }
    let mut plain = Vec::new();
    model.metadata = Metadata::default();
    write_citygml(&model, &mut plain).unwrap();
    assert!(!String::from_utf8(plain).unwrap().contains("metaDataProperty"));
}
