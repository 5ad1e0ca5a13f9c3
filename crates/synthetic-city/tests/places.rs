//! Places: every quarter and feature, their truth, and what their meshes have that the truth has not.

use gable_city_model::{Tolerances, validate_solid};
use gable_synthetic_city::{Feature, Place, Quarter, Scene, Source, SynthParams, mesh_of, scene, synthesise};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn params(quarter: Quarter, features: &[Feature], side: f64, seed: u64) -> SynthParams {
    let place = Place { quarter, features: features.to_vec(), side };
    SynthParams { seed, source: Source::Place(place), density: 3.0, tile_size: 40.0, ..SynthParams::default() }
}

fn check(scene: &Scene, what: &str) {
    for building in &scene.buildings {
        let truth = &building.truth;
        for shell in [&truth.lods.lod1[0], &truth.lods.lod2[0]] {
            let issues = validate_solid(shell, &Tolerances::strict());
            assert!(issues.is_empty(), "{what} {}: {issues:?}", truth.id);
        }
        let ids = scene.buildings.iter().filter(|b| b.truth.id == truth.id).count();
        assert_eq!(ids, 1, "{what} {}: the id stands twice", truth.id);
    }
    let inside = scene.extent.grown(0.1);
    assert!(scene.buildings.iter().all(|b| inside.contains(b.bounds.min) && inside.contains(b.bounds.max)), "{what}");
}

#[test]
fn every_quarter_is_valid_and_all_but_the_open_one_have_buildings() {
    for quarter in Quarter::ALL {
        for (seed, slope) in [(1, 0.0), (2, 0.05), (3, 0.3)] {
            let params = SynthParams { slope, ..params(quarter, &[], 160.0, seed) };
            let scene = scene(&params).expect("a place");
            check(&scene, &format!("{quarter:?} with seed {seed}"));
            let least = if quarter == Quarter::Open { 0 } else { 2 };
            let found = scene.buildings.len();
            assert!(found >= least && (found == 0) == (quarter == Quarter::Open), "{quarter:?}: {found} buildings");
        }
    }
}

#[test]
fn every_feature_is_valid_in_a_village() {
    for &feature in Feature::ALL {
        for seed in 1..4 {
            let scene = scene(&params(Quarter::Village, &[feature], 140.0, seed)).expect("a place");
            check(&scene, &format!("{feature:?} with seed {seed}"));
            assert!(scene.buildings.len() > 3, "{feature:?}: {} buildings", scene.buildings.len());
        }
    }
}

#[test]
fn drawn_places_are_valid_and_differ() {
    let places: Vec<Place> = (1..9).map(Place::drawn).collect();
    assert!(places.iter().enumerate().all(|(n, p)| places[..n].iter().all(|q| q != p)));
    for (seed, place) in (1..9).zip(places) {
        let params = SynthParams { seed, source: Source::Place(place.clone()), ..SynthParams::default() };
        check(&scene(&params).expect("a place"), &format!("{place:?}"));
    }
}

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

fn make(params: &SynthParams, threads: usize) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| synthesise(params, folder.path(), &|_| {})).expect("a place");
    let mut all = BTreeMap::new();
    files(folder.path(), &mut all, "");
    all
}

fn labels(files: &BTreeMap<String, Vec<u8>>) -> BTreeMap<u8, usize> {
    let mut counts = BTreeMap::new();
    for (_, bytes) in files.iter().filter(|(name, _)| name.contains("labels/") && name.ends_with(".png")) {
        for pixel in image::load_from_memory(bytes).expect("a PNG").to_luma8().pixels() {
            *counts.entry(pixel.0[0]).or_default() += 1;
        }
    }
    counts
}

#[test]
fn what_is_no_building_is_never_labelled_as_one() {
    use Feature::{Bananas, Bridge, Court, Crops, Embankment, Grove, Palms, Pergolas, Pits, Quay, Stairs, Tarpaulins};
    let features = [Court, Quay, Bridge, Stairs, Embankment, Grove, Crops, Bananas, Palms, Tarpaulins, Pergolas, Pits];
    for part in features.chunks(6) {
        let made = make(&SynthParams { texture: false, ..params(Quarter::Open, part, 60.0, 3) }, 2);
        let found = labels(&made);
        assert_eq!(found.get(&3), None, "{part:?}: {found:?}");
        let text = String::from_utf8(made["truth/truth.city.jsonl"].clone()).expect("text");
        assert!(!text.contains("\"Building\""), "{part:?}");
    }
}

#[test]
fn faults_are_in_the_mesh_and_what_they_hide_is_not_judged() {
    let features = [Feature::Rim, Feature::Holes, Feature::Pits, Feature::Fill];
    let asked = SynthParams { density: 1.0, ..params(Quarter::Village, &features, 72.0, 5) };
    let made = make(&asked, 1);
    assert_eq!(made, make(&asked, 3), "threads change no byte");
    let unknown = labels(&made)[&255] as f64 * 0.04;
    assert!((200.0..3_500.0).contains(&unknown), "{unknown} m² are not judged");
    let with = |ending: &str, part: &str| {
        made.iter().filter(|(n, b)| n.ends_with(ending) && String::from_utf8_lossy(b).contains(part)).count()
    };
    assert!(with(".mtl", "_1\n") > 0 && with(".obj", "_1\n") > 0, "filled faces have a material of their own");
    let plain = scene(&params(Quarter::Village, &[], 72.0, 5)).expect("a place");
    let mesh = mesh_of(&asked).expect("a mesh");
    let deepest = mesh.vertices.iter().map(|v| plain.ground(v.truncate()) - v.z).fold(0.0, f64::max);
    assert!(deepest > 4.0, "the lowest vertex is {deepest} m under the ground");
}

/// Without noise the mesh of open ground lies on the truth's, at its steps to within the voxels.
#[test]
fn meshes_lie_on_the_ground_of_landforms() {
    for feature in [Feature::Terraces, Feature::Court, Feature::Stairs, Feature::Cutting, Feature::Embankment] {
        let asked = SynthParams { noise: 0.0, slope: 0.1, density: 6.0, ..params(Quarter::Open, &[feature], 44.0, 4) };
        let truth = scene(&asked).expect("a place");
        let clear = |p: gable_geometry::DVec2| {
            truth.trees.iter().all(|t| t.place.distance(p) > 2.0 * t.radius)
                && truth.clutter.iter().all(|k| k.plan.centre.distance(p) > k.plan.half_length + 2.0)
        };
        let mesh = mesh_of(&asked).expect("a mesh");
        let mut errors: Vec<f64> = mesh
            .vertices
            .iter()
            .filter(|v| clear(v.truncate()))
            .map(|v| (v.z - truth.ground(v.truncate())).abs())
            .collect();
        errors.sort_by(f64::total_cmp);
        let (median, most) = (errors[errors.len() / 2], errors[errors.len() * 8 / 10]);
        assert!(errors.len() > 500 && median < 0.05 && most < 0.7, "{feature:?}: {median:.3}, {most:.3} m");
    }
}

/// Features that build something do so in most places.
#[test]
fn features_build_what_they_are_called() {
    let kinds = [
        (Feature::Minarets, "mosque", 4),
        (Feature::Minarets, "minaret", 4),
        (Feature::Stacks, "stack", 4),
        (Feature::Battered, "battered", 4),
    ];
    for (feature, kind, least) in kinds {
        let with = |seed: u64| {
            let scene = scene(&params(Quarter::Village, &[feature], 140.0, seed)).expect("a place");
            let is_one = |b: &gable_synthetic_city::SceneBuilding| {
                format!("{:?}", b.truth.attributes["roof_type"]).contains(kind)
            };
            scene.buildings.iter().any(is_one)
        };
        let found = (1..=6).filter(|&seed| with(seed)).count();
        assert!(found >= least, "{kind}: in {found} of 6 places");
    }
}
