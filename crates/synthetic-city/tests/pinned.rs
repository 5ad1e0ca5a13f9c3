//! The cities that the benchmark's tables are about stay byte for byte what they are, whatever else the synthesiser learns.

use gable_city_model::CityModel;
use gable_geometry::Crs;
use gable_synthetic_city::{RoofCase, Source, SynthParams, scene, synthesise};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn files(folder: &Path, into: &mut BTreeMap<String, Vec<u8>>, prefix: &str) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let entry = entry.expect("an entry");
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            files(&entry.path(), into, &format!("{name}/"));
        } else {
            into.insert(name, fs::read(entry.path()).expect("a file"));
        }
    }
}

/// FNV-1a over the names and bytes of all files.
fn fingerprint(params: &SynthParams) -> u64 {
    let folder = tempfile::tempdir().expect("a temporary folder");
    synthesise(params, folder.path(), &|_| {}).expect("a city");
    let mut all = BTreeMap::new();
    files(folder.path(), &mut all, "");
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for (name, bytes) in &all {
        for byte in name.bytes().chain(bytes.iter().copied()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

/// Scene `house` of the benchmark, and its variants without texture and on a slope.
#[test]
fn procedural_towns_stay_what_they_are() {
    let house = SynthParams { seed: 11, source: Source::Procedural { area_km2: 0.01 }, ..SynthParams::default() };
    let other = SynthParams { density: 3.0, slope: 0.15, noise: 2.0, texture: false, ..house.clone() };
    assert_eq!([&house, &other].map(fingerprint), [11_389_366_278_023_794_173, 17_808_012_138_506_064_255]);
}

/// As scene `district` is made: buildings of a model, with what is inferred around them.
#[test]
fn cities_from_a_model_stay_what_they_are() {
    let source = Source::Procedural { area_km2: 0.006 };
    let town = scene(&SynthParams { seed: 5, source, ..SynthParams::default() }).expect("a town");
    let model = CityModel {
        title: "Town".to_owned(),
        metadata: Default::default(),
        origin: [0.0; 3],
        crs: Crs::Unknown,
        buildings: town.buildings.iter().map(|b| b.truth.clone()).collect(),
        terrain: None,
    };
    let copies =
        SynthParams { seed: 13, source: Source::Truth { model: Box::new(model), repeat: 1 }, ..SynthParams::default() };
    assert_eq!(fingerprint(&copies), 6_281_517_431_136_057_366);
}

#[test]
fn small_scenes_stay_what_they_are() {
    let small = [RoofCase::PartyWalls, RoofCase::UnderTree].map(|case| {
        fingerprint(&SynthParams { source: Source::Case(case), tile_size: 20.0, ..SynthParams::default() })
    });
    assert_eq!(small, [11_681_176_017_252_904_756, 78_326_710_124_675_491]);
}
