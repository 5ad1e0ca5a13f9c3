//! CityGML: the OGC's schemas, what comes back, and published files.

mod common;

use common::{city, real};
use gable_city_model::{
    Attributes, CityModel, Error, ReadOptions, Semantic, Tolerances, Value, quantised, read_city_model, read_citygml,
    validate_solid, write_citygml, write_citygml_file,
};
use gable_geometry::Crs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn text(model: &CityModel) -> String {
    let mut bytes = Vec::new();
    write_citygml(model, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// The CityGML 2.0 schema, if it and `xmllint` are there.
#[expect(clippy::print_stderr, reason = "says why a test is skipped")]
fn schema() -> Option<PathBuf> {
    let root = std::env::var_os("GABLE_TEST_SCHEMAS")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/schemas")), PathBuf::from);
    let schema = root.join("citygml-2.0/CityGML-2.0.xsd");
    if !schema.exists() {
        eprintln!("skipped: {} is absent", schema.display());
        return None;
    }
    if Command::new("xmllint").arg("--version").output().is_err() {
        eprintln!("skipped: xmllint is not installed");
        return None;
    }
    Some(schema)
}

fn lint(schema: &Path, file: &Path) -> Result<(), String> {
    let output =
        Command::new("xmllint").args(["--noout", "--nonet", "--schema"]).args([schema, file]).output().unwrap();
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

#[test]
fn the_schema_accepts_every_kind_of_object() {
    let Some(schema) = schema() else { return };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.gml");
    for crs in [
        Crs::Epsg(7415),
        Crs::Enu { latitude: 34.2196, longitude: 108.9594, height: 445.5 },
        Crs::Compound { horizontal: 25832, vertical: 7837 },
    ] {
        let mut model = city(crs);
        model.buildings[0].attributes.extend([
            ("class".to_owned(), Value::Text("1000".to_owned())),
            ("function".to_owned(), Value::Text("a\u{1}b".to_owned())),
            ("storeysAboveGround".to_owned(), Value::Integer(2)),
            ("yearOfConstruction".to_owned(), Value::Integer(890)),
            ("usage".to_owned(), Value::Integer(-3)),
        ]);
        model.buildings[1].attributes.insert("roofType".to_owned(), Value::Text("gabled".to_owned()));
        write_citygml_file(&model, &path).unwrap();
        lint(&schema, &path).unwrap();
        model.buildings.clear();
        model.terrain = None;
        write_citygml_file(&model, &path).unwrap();
        // The schema wants at least nothing: an empty model is a model.
        lint(&schema, &path).unwrap();
    }
    // The check itself can fail: a building's properties in the wrong order.
    let broken = text(&city(Crs::Epsg(7415))).replace("bldg:lod1Solid", "bldg:lod9Solid");
    std::fs::write(&path, broken).unwrap();
    assert!(lint(&schema, &path).unwrap_err().contains("lod9Solid"));
}

#[test]
fn what_was_written_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.gml");
    for crs in [
        Crs::Epsg(7415),
        Crs::Enu { latitude: 34.2196, longitude: 108.9594, height: 445.5 },
        Crs::Compound { horizontal: 25832, vertical: 7837 },
        Crs::Unknown,
    ] {
        let mut model = city(crs);
        model.buildings[1].attributes.insert("roofType".to_owned(), Value::Text("gabled".to_owned()));
        write_citygml_file(&model, &path).unwrap();
        let reading = read_citygml(&path, &ReadOptions { origin: Some(model.origin) }).unwrap();
        assert_eq!(reading.notes, []);
        let read = reading.model;
        assert_eq!((&read.title, &read.crs, read.origin), (&model.title, &model.crs, model.origin));
        assert_eq!(read.buildings.len(), model.buildings.len());
        for (a, b) in read.buildings.iter().zip(&model.buildings) {
            assert_eq!(a.id, b.id);
            // CityGML has no truth values.
            let text = |value: &Value| match value {
                Value::Bool(b) => Value::Text(b.to_string()),
                other => other.clone(),
            };
            let expected: Attributes = b.attributes.iter().map(|(name, value)| (name.clone(), text(value))).collect();
            assert_eq!(a.attributes, expected);
            assert_eq!(a.lods.shells().count(), b.lods.shells().count());
            for (lod, (a, b)) in a.lods.shells().zip(b.lods.shells()).enumerate() {
                let (a, mut b) = (quantised(a), quantised(b));
                for value in b.faces.iter_mut().flat_map(|face| face.attributes.values_mut()) {
                    if let Value::Number(n) = value {
                        *n = (*n * 1e6).round() / 1e6;
                    }
                }
                // Only LOD2 has surfaces with attributes.
                if !a.faces.iter().any(|face| !face.attributes.is_empty()) {
                    b.faces.iter_mut().for_each(|face| face.attributes.clear());
                }
                assert_eq!(a, b, "{lod}");
            }
            assert_eq!(a.lods.lod2.len(), b.lods.lod2.len());
        }
        let attributes = &read.buildings[0].lods.lod2[0].faces[5].attributes;
        assert_eq!(attributes.get("slope_deg"), Some(&Value::Number(37.983_176)));
        let (a, b) = (read.terrain.unwrap(), model.terrain.unwrap());
        assert_eq!((a.id, a.triangles), (b.id, b.triangles));
        assert!(a.vertices.iter().zip(&b.vertices).all(|(a, b)| a.distance(*b) < 1e-9));
    }
}

#[test]
fn coordinates_and_names_are_as_documented() {
    let text = text(&city(Crs::Epsg(7415)));
    assert!(text.contains(r#"<gml:Envelope srsName="urn:ogc:def:crs:EPSG::7415" srsDimension="3">"#));
    assert!(text.contains("<gml:lowerCorner>84910 446000 0</gml:lowerCorner>"));
    assert!(text.contains("84963.75 446017.5 7.1235"), "eastings first, in ten-thousandths");
    assert!(text.contains(r#"<bldg:Building gml:id="b_00001-_xe9_">"#));
    assert!(text.contains(r##"<gml:surfaceMember xlink:href="#b_00001-_xe9__lod2_6_poly"/>"##));
    assert!(text.contains(r#"<gen:value uom="m3">365</gen:value>"#));
    assert!(text.contains("gabled &amp; &lt;hipped&gt;"));
}

#[test]
fn what_cannot_be_written_is_refused() {
    let mut twice = city(Crs::Unknown);
    twice.buildings[1].id = twice.buildings[0].id.clone();
    let mut unknown = city(Crs::Unknown);
    unknown.buildings[0].lods.lod2[0].faces[1].attributes.insert("slope_deg".to_owned(), Value::Number(f64::NAN));
    let mut index = city(Crs::Unknown);
    index.buildings[0].lods.lod2[0].faces[0].rings[0][0] = 99;
    for (model, words) in [(twice, "occurs twice"), (unknown, "slope_deg"), (index, "out of range")] {
        let error = write_citygml(&model, Vec::new()).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("b_00001"), "{error}");
    }
}

#[test]
fn broken_files_are_named_with_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.gml");
    let good = text(&city(Crs::Epsg(7415)));
    let cases = [
        ("<a/>".to_owned(), "root"),
        (good[..good.len() / 2].to_owned(), "byte"),
        (good.replacen("#b_00001-_xe9__lod2_6_poly", "#nowhere", 1), "nowhere leads nowhere"),
        (good.replacen("84963.75 446017.5 7.1235", "84963.75 446017.5", 1), "not a multiple of three"),
        (good.replacen("84963.75 446017.5", "84963.75 NaN", 1), "not finite"),
        (good.replacen("84963.75 446017.5", "84963.75 x", 1), "\"x\" is not a number"),
        (good.replacen("<gml:name>", "<gml:name>&what;", 1), "entity"),
        (good.replacen("</bldg:lod1Solid>", "</bldg:lod1Solis>", 1), "byte"),
        ("<CityModel><cityObjectMember>".to_owned() + &"<x>".repeat(100_000), "nested"),
    ];
    for (broken, words) in cases {
        std::fs::write(&path, broken).unwrap();
        let error = read_citygml(&path, &ReadOptions::default()).unwrap_err();
        assert!(matches!(error, Error::Content { .. }));
        let error = error.to_string();
        assert!(error.contains(words) && error.contains("a.gml, byte "), "{error}");
    }
}

#[test]
fn munich() {
    let dir = tempfile::tempdir().unwrap();
    let Some(path) = real(common::MUNICH, &dir) else { return };
    let reading = read_city_model(&path, &ReadOptions::default()).unwrap();
    assert_eq!(reading.notes, []);
    let model = reading.model;
    assert_eq!((model.buildings.len(), model.crs.clone()), (111, Crs::Epsg(31468)));
    assert_eq!(model.origin, [4_424_648.0, 5_482_614.0, 0.0]);
    let faces: Vec<_> = model.buildings.iter().flat_map(|b| &b.lods.lod2).flat_map(|s| &s.faces).collect();
    let count = |semantic| faces.iter().filter(|f| f.semantic == semantic).count();
    assert_eq!(
        (count(Semantic::GroundSurface), count(Semantic::RoofSurface), count(Semantic::WallSurface)),
        (111, 217, 728)
    );
    let mut valid = 0;
    for building in &model.buildings {
        let attributes = &building.attributes;
        let Some(Value::Number(height)) = attributes.get("measuredHeight") else { panic!("{attributes:?}") };
        let (low, high) = building.lods.lod2[0].bounds().unwrap();
        assert!((high.z - low.z - height).abs() < 0.01, "{}", building.id);
        assert!(matches!(attributes.get("roofType"), Some(Value::Text(code)) if code.len() == 4));
        valid += usize::from(validate_solid(&building.lods.lod2[0], &Tolerances::default()).is_empty());
    }
    assert_eq!(valid, 111, "the survey delivers valid solids");
    let written = dir.path().join("again.gml");
    write_citygml_file(&model, &written).unwrap();
    if let Some(schema) = schema() {
        lint(&schema, &written).unwrap();
    }
    let again = read_citygml(&written, &ReadOptions { origin: Some(model.origin) }).unwrap().model;
    for (a, b) in again.buildings.iter().zip(&model.buildings) {
        assert_eq!((&a.id, &a.attributes), (&b.id, &b.attributes));
        assert_eq!(quantised(&a.lods.lod2[0]).faces.len(), quantised(&b.lods.lod2[0]).faces.len());
        assert!((a.lods.lod2[0].volume() - b.lods.lod2[0].volume()).abs() < 1e-3);
    }
}

/// GDAL reads the easting first whatever order EPSG names the axes in.
#[test]
#[expect(clippy::print_stderr, reason = "says why a test is skipped")]
fn gdal_does_not_swap_the_axes() {
    if Command::new("ogrinfo").arg("--version").output().is_err() {
        eprintln!("skipped: ogrinfo (gdal-bin) is not installed");
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    for name in [
        "EPSG:2180",
        "EPSG:3006",
        "EPSG:31467",
        "EPSG:31256",
        "EPSG:6677",
        "EPSG:2193",
        "EPSG:3035",
        "EPSG:25832",
        "EPSG:7415",
        "EPSG:2154",
        "EPSG:25832+7837",
        "EPSG:2180+9651",
    ] {
        let mut model = city(name.parse().unwrap());
        model.origin = [637_000.0, 487_000.0, 0.0];
        let path = dir.path().join(format!("{}.gml", name.replace([':', '+'], "_")));
        write_citygml_file(&model, &path).unwrap();
        let output = Command::new("ogrinfo").args(["-ro", "-al", "-so"]).arg(&path).output().unwrap();
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        let extents: Vec<&str> = told.lines().filter(|line| line.starts_with("Extent: (6")).collect();
        assert!(!extents.is_empty(), "{name}: {told}");
        assert!(!told.contains("Extent: (48"), "{name} is read swapped: {told}");
    }
}
