//! No text makes a reader panic, hang or fill the memory, and what is read can be worked with.

mod common;
#[path = "common/mutants.rs"]
mod mutants;

use common::city;
use gable_city_model::{
    CityModel, Header, ReadOptions, SeqWriter, Tolerances, quantised, read_city_model, read_cityjson_str, triangulate,
    validate, write_citygml, write_cityjson,
};
use gable_geometry::Crs;
use mutants::mutant;
use std::path::Path;

/// Mutants of each file.
const MUTANTS: u64 = 3000;

fn cityjson() -> String {
    let mut out = Vec::new();
    write_cityjson(&city(Crs::Epsg(7415)), &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn sequence() -> String {
    let (mut out, city) = (Vec::new(), city(Crs::Epsg(7415)));
    let mut writer = SeqWriter::new(&mut out, &Header::of(&city)).unwrap();
    city.buildings.iter().for_each(|building| writer.write_building(building).unwrap());
    writer.write_terrain(city.terrain.as_ref().unwrap()).unwrap();
    drop(writer);
    String::from_utf8(out).unwrap()
}

fn citygml() -> String {
    let mut out = Vec::new();
    write_citygml(&city(Crs::Epsg(7415)), &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

/// Does with a model what is done with one.
fn use_up(model: &CityModel) {
    for building in &model.buildings {
        let lods = &building.lods;
        for shell in [&lods.footprint, &lods.roof_edge].into_iter().flatten().chain(&lods.lod1).chain(&lods.lod2) {
            assert!(shell.is_well_formed());
            let _ = triangulate(shell);
            let _ = triangulate(&quantised(shell));
        }
        let _ = validate::validate_building(building, &Tolerances::default());
    }
    // What cannot be written is an error.
    let _ = write_cityjson(model, std::io::sink());
    let _ = write_citygml(model, std::io::sink());
}

#[test]
fn mutants_of_cityjson() {
    for text in [cityjson(), sequence()] {
        let mut read = 0;
        for number in 0..MUTANTS {
            let mutant = mutant(&text, number);
            if let Ok(reading) = read_cityjson_str(&mutant, Path::new("mutant"), &ReadOptions::default()) {
                read += 1;
                use_up(&reading.model);
            }
        }
        assert!(read > MUTANTS / 20, "{read} of {MUTANTS} are read, so that what follows is tried too");
    }
}

#[test]
fn mutants_of_citygml() {
    let (folder, text) = (tempfile::tempdir().unwrap(), citygml());
    let path = folder.path().join("mutant.gml");
    let mut read = 0;
    for number in 0..MUTANTS {
        std::fs::write(&path, mutant(&text, number)).unwrap();
        if let Ok(reading) = read_city_model(&path, &ReadOptions::default()) {
            read += 1;
            use_up(&reading.model);
        }
    }
    assert!(read > MUTANTS / 20, "{read} of {MUTANTS} are read");
}

/// What reading says.
fn said(text: &str) -> String {
    read_cityjson_str(text, Path::new("a.city.json"), &ReadOptions::default())
        .map_or_else(|e| e.to_string(), |reading| format!("{} buildings", reading.model.buildings.len()))
}

#[test]
fn what_a_few_bytes_of_cityjson_may_not_come_to() {
    let vertices: String = (0..2000).map(|i| format!("[{i},{},0],", i * i % 997)).collect();
    let ring: String = (0..2000).map(|i| format!("{i},")).collect();
    let part = format!(
        r#"{{"type":"BuildingPart","parents":["b0"],"geometry":[{{"type":"MultiSurface","lod":"2","boundaries":[[[{}]]]}}]}}"#,
        ring.trim_end_matches(',')
    );
    let file = |buildings: usize, children: usize| {
        let children = vec!["\"p\""; children].join(",");
        let all: String =
            (0..buildings).map(|i| format!(r#""b{i}":{{"type":"Building","children":[{children}]}},"#)).collect();
        format!(
            r#"{{"type":"CityJSON","version":"2.0","CityObjects":{{{all}"p":{part}}},"vertices":[{}]}}"#,
            vertices.trim_end_matches(',')
        )
    };
    // One building names a part many times, and many buildings name it.
    assert_eq!(said(&file(1, 100_000)), "1 buildings");
    assert!(said(&file(20_000, 1)).ends_with("comes to more than is read"), "{}", said(&file(20_000, 1)));

    let text = "x".repeat(1 << 20);
    let (faces, values) = (vec!["[[0,1,2]]"; 5000].join(","), vec!["0"; 5000].join(","));
    let attributes = format!(
        r#"{{"type":"CityJSON","version":"2.0","vertices":[[0,0,0],[1,0,0],[0,1,0]],"CityObjects":{{"b":{{"type":"Building",
        "geometry":[{{"type":"MultiSurface","lod":"2","boundaries":[{faces}],
        "semantics":{{"surfaces":[{{"type":"RoofSurface","note":"{text}"}}],"values":[{values}]}}}}]}}}}}}"#
    );
    assert!(said(&attributes).ends_with("comes to more than is read"), "{}", said(&attributes));

    let deep = format!(r#"{{"type":"CityJSON","CityObjects":{}"#, "[".repeat(1_000_000));
    assert!(!said(&deep).ends_with("buildings"));
    let far = |scale: &str, translate: &str| {
        said(&format!(
            r#"{{"type":"CityJSON","version":"2.0","CityObjects":{{}},"vertices":[[0,0,0],[3000,0,0]],
            "transform":{{"scale":[{scale},1,1],"translate":[{translate},0,0]}}}}"#
        ))
    };
    assert_eq!(far("0.001", "3500000"), "0 buildings");
    for (scale, translate) in [("1e6", "0"), ("1", "1e300"), ("1e304", "0"), ("1", "-2e9")] {
        assert!(far(scale, translate).contains("far from everything"), "{scale} {translate}");
    }
}

#[test]
fn what_a_few_bytes_of_citygml_may_not_come_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gml");
    let said = |surfaces: &str| {
        let text = format!(
            "<CityModel xmlns:xlink=\"x\"><cityObjectMember><Building id=\"b\"><lod2MultiSurface><MultiSurface>\
             <surfaceMember xlink:href=\"#s0\"/></MultiSurface></lod2MultiSurface>{surfaces}</Building></cityObjectMember></CityModel>"
        );
        std::fs::write(&path, text).unwrap();
        read_city_model(&path, &ReadOptions::default()).map_or_else(|e| e.to_string(), |_| "read".to_owned())
    };
    let polygon = "<Polygon id=\"p\"><exterior><LinearRing><posList>0 0 0 1 0 0 0 1 0</posList></LinearRing></exterior></Polygon>";
    // Each surface is twice the next.
    let twice = |depth: usize| {
        let refer = |to: &str| format!("<surfaceMember xlink:href=\"#{to}\"/>").repeat(2);
        let surface = |i: usize| {
            let next = if i + 1 == depth { "p".to_owned() } else { format!("s{}", i + 1) };
            format!("<CompositeSurface id=\"s{i}\">{}</CompositeSurface>", refer(&next))
        };
        (0..depth).map(surface).collect::<String>() + polygon
    };
    assert_eq!(said(&twice(5)), "read");
    assert!(said(&twice(60)).ends_with("comes to more than is read"), "{}", said(&twice(60)));
    let chain: String = (0..100_000)
        .map(|i| {
            format!("<CompositeSurface id=\"s{i}\"><surfaceMember xlink:href=\"#s{}\"/></CompositeSurface>", i + 1)
        })
        .collect();
    assert!(said(&(chain + polygon)).contains("nested deeper than 64"));
}

#[test]
fn what_is_no_regular_file_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [pipe.as_path(), Path::new("/dev/zero"), folder.path()] {
        let error = read_city_model(path, &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.ends_with("is no regular file"), "{error}");
    }
}
