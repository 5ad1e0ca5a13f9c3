//! CityJSON and CityJSONSeq: schema, what comes back, and determinism.

mod common;

use common::{city, real};
use gable_city_model::{
    CityModel, Error, Header, ReadOptions, SeqWriter, Value, quantised, read_city_model, read_cityjson,
    read_cityjson_str, write_cityjson,
};
use gable_geometry::Crs;
use std::path::Path;

fn file(model: &CityModel) -> String {
    let mut bytes = Vec::new();
    write_cityjson(model, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn sequence(model: &CityModel) -> String {
    let mut writer = SeqWriter::new(Vec::new(), &Header::of(model)).unwrap();
    writer.write_model(model).unwrap();
    String::from_utf8(writer.finish().unwrap()).unwrap()
}

fn assert_no_complaints(validator: &cjval::CJValidator, what: &str) {
    for (criterion, summary) in validator.validate() {
        // Warnings (duplicate or unused vertices, extra properties) count as well.
        assert!(!summary.has_errors(), "{what}: {criterion}: {:?}", summary.get_errors());
    }
    assert!(validator.is_valid(), "{what}");
}

fn assert_schema(model: &CityModel) {
    assert_no_complaints(&cjval::CJValidator::from_str(&file(model)), "file");
    let text = sequence(model);
    let mut lines = text.lines();
    let mut validator = cjval::CJValidator::from_str(lines.next().unwrap());
    assert_no_complaints(&validator, "header");
    for line in lines {
        validator.from_str_cjfeature(line).unwrap();
        assert_no_complaints(&validator, &line[..line.len().min(100)]);
    }
}

/// The model as files hold it: quantised, numbers with six decimals.
fn as_written(mut model: CityModel) -> CityModel {
    for building in &mut model.buildings {
        let lods = &mut building.lods;
        let shells = lods.footprint.iter_mut().chain(&mut lods.roof_edge).chain(&mut lods.lod1).chain(&mut lods.lod2);
        for shell in shells {
            *shell = quantised(shell);
            for value in shell.faces.iter_mut().flat_map(|face| face.attributes.values_mut()) {
                if let Value::Number(n) = value {
                    *n = (*n * 1e6).round() / 1e6;
                }
            }
        }
    }
    model
}

#[test]
fn every_kind_of_object_passes_the_schema() {
    for crs in [
        Crs::Epsg(7415),
        Crs::Unknown,
        Crs::Enu { latitude: 34.2196, longitude: 108.9594, height: 445.5 },
        Crs::Compound { horizontal: 25832, vertical: 7837 },
    ] {
        assert_schema(&city(crs));
    }
    let empty = CityModel { buildings: vec![], terrain: None, ..city(Crs::Unknown) };
    assert_schema(&empty);
}

#[test]
fn what_was_written_comes_back() {
    for crs in [
        Crs::Epsg(7415),
        Crs::Unknown,
        Crs::Enu { latitude: 34.2196, longitude: 108.9594, height: 445.5 },
        Crs::Compound { horizontal: 25832, vertical: 7837 },
    ] {
        let model = city(crs);
        let expected = as_written(model.clone());
        let options = ReadOptions { origin: Some(model.origin) };
        for text in [file(&model), sequence(&model)] {
            let reading = read_cityjson_str(&text, Path::new("x"), &options).unwrap();
            assert_eq!(reading.notes, []);
            let mut read = reading.model;
            // World coordinates carry 1e-11 m of rounding.
            for (a, b) in read.buildings.iter_mut().zip(&expected.buildings) {
                for (a, b) in [&mut a.lods.footprint, &mut a.lods.roof_edge]
                    .into_iter()
                    .flatten()
                    .chain(&mut a.lods.lod1)
                    .chain(&mut a.lods.lod2)
                    .zip(b.lods.shells())
                {
                    *a = quantised(a);
                    assert_eq!(a, b);
                }
            }
            if let (Some(a), Some(b)) = (&mut read.terrain, &expected.terrain) {
                assert!(a.vertices.iter().zip(&b.vertices).all(|(a, b)| a.distance(*b) < 1e-9));
                a.vertices.clone_from(&b.vertices);
            }
            assert_eq!(read, expected);
        }
    }
}

#[test]
fn bytes_depend_on_nothing_else() {
    let model = city(Crs::Epsg(7415));
    assert_eq!(file(&model), file(&model.clone()));
    assert_eq!(sequence(&model), sequence(&model.clone()));
    let text = file(&model);
    assert!(text.starts_with(r#"{"type":"CityJSON","version":"2.0","transform":{"scale":[0.0001,0.0001,0.0001],"#));
    assert!(text.contains(r#""translate":[84910.0,446000.0,0.0]"#), "{}", &text[..300]);
    assert!(text.contains(r#""referenceSystem":"https://www.opengis.net/def/crs/EPSG/0/7415""#));
    assert!(text.contains(r#""slope_deg":37.983176"#));
}

#[test]
fn what_cannot_be_written_is_refused() {
    let mut twice = city(Crs::Unknown);
    twice.buildings[1].id = twice.buildings[0].id.clone();
    let mut unknown = city(Crs::Unknown);
    unknown.buildings[0].attributes.insert("rmse_m".to_owned(), Value::Number(f64::NAN));
    let mut index = city(Crs::Unknown);
    index.buildings[0].lods.lod2[0].faces[0].rings[0][0] = 99;
    let mut far = city(Crs::Unknown);
    far.buildings[0].lods.lod2[0].vertices[0].x = 1e9;
    for (model, words) in [(twice, "occurs twice"), (unknown, "rmse_m"), (index, "out of range"), (far, "too far")] {
        let error = write_cityjson(&model, Vec::new()).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("b_00001"), "{error}");
    }
}

#[test]
fn broken_files_are_named_with_their_place() {
    let read = |text: &str| {
        let error = read_cityjson_str(text, Path::new("dir/a.city.json"), &ReadOptions::default()).unwrap_err();
        assert!(matches!(error, Error::Content { .. }));
        error.to_string()
    };
    assert_eq!(read("{}"), "dir/a.city.json, line 1, column 2: missing field `type` at line 1 column 2");
    assert!(read(r#"{"type":"FeatureCollection"}"#).contains("not CityJSON"));
    assert!(read("{\"type\":\"CityJSON\",\n\"vertices\":[[1,2]]}").contains("line 2, column "));
    let mut text = file(&city(Crs::Unknown)).replace("[[0,1,2]]", "[[0,1,99999]]");
    assert!(read(&text).contains("terrain, geometry 0: face 0 refers to vertex 99999"));
    text = sequence(&city(Crs::Unknown));
    let cut = text.len() - 40;
    assert!(read(&text[..cut]).contains("line 5, column"), "{}", read(&text[..cut]));
    let dir = tempfile::tempdir().unwrap();
    let other = dir.path().join("a.txt");
    std::fs::write(&other, "solid").unwrap();
    let error = read_city_model(&other, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("neither CityJSON nor CityGML"), "{error}");
    std::fs::write(&other, file(&city(Crs::Unknown))).unwrap();
    assert_eq!(read_city_model(&other, &ReadOptions::default()).unwrap().model.buildings.len(), 3);
    let missing = read_cityjson(Path::new("nowhere.json"), &ReadOptions::default()).unwrap_err();
    assert!(missing.to_string().contains("nowhere.json"));
}

#[test]
fn real_cities_pass_through() {
    let dir = tempfile::tempdir().unwrap();
    let Some(path) = real(common::DELFT, &dir) else { return };
    let mut reading = read_cityjson(&path, &ReadOptions::default()).unwrap();
    assert_eq!(reading.notes, []);
    let model = &mut reading.model;
    assert_eq!((model.buildings.len(), &model.crs), (1115, &Crs::Epsg(7415)));
    assert_eq!(model.title, "3DBAG");
    assert_eq!(model.buildings.iter().map(|b| b.lods.lod2.len()).sum::<usize>(), 1116);
    assert!(model.buildings.iter().all(|b| b.lods.footprint.is_some() && !b.lods.lod1.is_empty()));
    model.buildings.truncate(20);
    assert_schema(model);
    let again = read_cityjson_str(&file(model), &path, &ReadOptions { origin: Some(model.origin) }).unwrap();
    assert_eq!(again.model.buildings.len(), 20);
    for (a, b) in again.model.buildings.iter().zip(&model.buildings) {
        assert_eq!(a.attributes, rounded(&b.attributes));
        for (a, b) in a.lods.lod2.iter().zip(&b.lods.lod2) {
            assert_eq!(quantised(a), quantised(b));
        }
    }
}

fn rounded(attributes: &gable_city_model::Attributes) -> gable_city_model::Attributes {
    let round = |value: &Value| match value {
        Value::Number(n) => Value::Number((n * 1e6).round() / 1e6),
        other => other.clone(),
    };
    attributes.iter().map(|(name, value)| (name.clone(), round(value))).collect()
}
