//! What is written: complete, consistent, the same whatever the threads.

use gable_synthetic_city::{RoofCase, Source, SynthParams, SynthReport, synthesise};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

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

fn make(threads: usize) -> (SynthReport, BTreeMap<String, Vec<u8>>) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let params = SynthParams { source: Source::Case(RoofCase::PartyWalls), tile_size: 20.0, ..SynthParams::default() };
    let seen = Mutex::new(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let report = pool
        .install(|| {
            synthesise(&params, folder.path(), &|p| {
                assert!(p.done <= p.total);
                *seen.lock().expect("no panic") += 1;
            })
        })
        .expect("a city");
    assert_eq!(*seen.lock().expect("no panic"), report.tiles);
    let mut all = BTreeMap::new();
    files(folder.path(), &mut all, "");
    (report, all)
}

#[test]
fn output_is_complete_and_does_not_depend_on_threads() {
    let (report, first) = make(1);
    let (_, second) = make(3);
    assert_eq!(first.keys().collect::<Vec<_>>(), second.keys().collect::<Vec<_>>());
    for (name, bytes) in &first {
        assert!(bytes == &second[name], "{name} differs");
    }
    assert_eq!((report.tiles, report.buildings), (4, 5));
    let (mut faces, mut labelled) = (0, 0);
    for tile in ["Tile_+000_+000", "Tile_+000_+001", "Tile_+001_+000", "Tile_+001_+001"] {
        let obj = String::from_utf8(first[&format!("mesh/Data/{tile}/{tile}.obj")].clone()).expect("text");
        assert!(obj.starts_with(&format!("mtllib {tile}.mtl\n")) && obj.contains(&format!("usemtl {tile}_0\n")));
        let count = |key: &str| obj.lines().filter(|l| l.starts_with(key)).count();
        let (v, vt, f) = (count("v "), count("vt "), count("f "));
        for line in obj.lines().filter(|l| l.starts_with("f ")) {
            for corner in line[2..].split(' ') {
                let (a, b) = corner.split_once('/').expect("v/vt");
                assert!((1..=v).contains(&a.parse().expect("a number")));
                assert!((1..=vt).contains(&b.parse().expect("a number")));
            }
        }
        for line in obj.lines().filter(|l| l.starts_with("vt ")) {
            assert!(line[3..].split(' ').all(|t| (0.0..=1.0).contains(&t.parse::<f64>().expect("a number"))));
        }
        faces += f;
        assert_eq!(first[&format!("truth/faces/{tile}.u8")].len(), f);
        let labels = image::load_from_memory(&first[&format!("truth/labels/{tile}.png")]).expect("a PNG").to_luma8();
        assert_eq!(labels.dimensions(), (100, 100));
        labelled += labels.iter().filter(|l| **l == 3).count();
        image::load_from_memory(&first[&format!("mesh/Data/{tile}/{tile}_0.jpg")]).expect("a JPG");
    }
    assert_eq!(report.faces, faces as u64);
    // 7.5 faces for each of 1,600 m², less what is torn.
    assert!((10_500..=12_000).contains(&faces), "{faces} faces");
    // A row of 30 × 10 m with its eaves.
    let built = labelled as f64 * 0.04;
    assert!((295.0..340.0).contains(&built), "{built} m² built");
    let metadata = String::from_utf8(first["mesh/metadata.xml"].clone()).expect("text");
    assert!(metadata.contains("<SRS>EPSG:7415</SRS>") && metadata.contains("<SRSOrigin>85000,446000,0</SRSOrigin>"));
}

#[test]
fn parameters_out_of_range_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("city");
    let params = SynthParams { density: 0.0, ..SynthParams::default() };
    let message = synthesise(&params, &out, &|_| {}).expect_err("density 0").to_string();
    assert_eq!(message, "density is 0: it must be 0.05 to 30 faces per m²");
    assert!(!out.exists());
}

/// Without noise the mesh lies on the truth, neither above nor below it.
#[test]
fn a_mesh_without_noise_lies_on_the_roofs() {
    for case in [RoofCase::Gable, RoofCase::Hip, RoofCase::Pyramid, RoofCase::Shed] {
        let params = SynthParams { source: Source::Case(case), noise: 0.0, slope: 0.0, ..SynthParams::default() };
        let scene = gable_synthetic_city::scene(&params).expect("a scene");
        let mesh = gable_synthetic_city::mesh_of(&params).expect("a mesh");
        let building = &scene.buildings[0];
        let mut errors = Vec::new();
        for p in &mesh.vertices {
            let at = p.truncate();
            let clear = |c: &gable_synthetic_city::Clutter| c.plan.centre.distance(at) > 2.0;
            if let Some((z, face)) = building.roof_at(at)
                && (z - p.z).abs() < 0.5
                && building.roof[face].polygon.boundary_distance(at) > 0.8
                && scene.clutter.iter().all(clear)
            {
                errors.push(building.roof[face].plane.distance(*p));
            }
        }
        assert!(errors.len() > 10, "{case:?}: {} vertices on the roof", errors.len());
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let worst = errors.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        assert!(mean.abs() < 0.02 && worst < 0.1, "{case:?}: mean {mean:.3}, worst {worst:.3}");
    }
}
