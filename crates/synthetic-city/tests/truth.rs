//! Every solid of the truth is valid, and the levels of detail agree.

use gable_city_model::{CityModel, Semantic, Shell, Tolerances, validate_solid};
use gable_geometry::{Crs, DVec2, ring_area};
use gable_synthetic_city::{Cover, RoofCase, Scene, Source, SynthParams, scene};

fn make(source: Source, seed: u64, slope: f64) -> Scene {
    scene(&SynthParams { seed, source, slope, ..SynthParams::default() }).expect("valid parameters")
}

fn volume(shell: &Shell) -> f64 {
    let origin = shell.vertices[0];
    let mut six = 0.0;
    for ring in shell.faces.iter().flat_map(|f| &f.rings) {
        for pair in ring[1..].windows(2) {
            let [a, b, c] = [ring[0], pair[0], pair[1]].map(|v| shell.vertices[v as usize] - origin);
            six += a.dot(b.cross(c));
        }
    }
    six / 6.0
}

fn ground_area(shell: &Shell) -> f64 {
    let faces = shell.faces.iter().filter(|f| f.semantic == Semantic::GroundSurface);
    let ring = |r: &Vec<u32>| r.iter().map(|&v| shell.vertices[v as usize].truncate()).collect::<Vec<DVec2>>();
    faces.flat_map(|f| &f.rings).map(|r| ring_area(&ring(r))).sum::<f64>().abs()
}

fn check(scene: &Scene, what: &str) {
    for building in &scene.buildings {
        let truth = &building.truth;
        let (lod1, lod2) = (&truth.lods.lod1[0], &truth.lods.lod2[0]);
        for shell in [lod1, lod2] {
            let issues = validate_solid(shell, &Tolerances::strict());
            assert!(issues.is_empty(), "{what} {}: {issues:?}", truth.id);
        }
        let (v1, v2) = (volume(lod1), volume(lod2));
        assert!(v2 > 1.0 && (v1 / v2 - 1.0).abs() < 1e-6, "{what} {}: volumes {v1} and {v2}", truth.id);
        let footprint = truth.lods.footprint.as_ref().expect("a footprint");
        assert!((ground_area(footprint) - ground_area(lod2)).abs() < 1e-6, "{what} {}: footprint", truth.id);
        for roof in &building.roof {
            assert!(roof.plane.slope().to_degrees() < 70.0, "{what} {}: a wall taken for a roof", truth.id);
        }
    }
}

#[test]
fn every_case_has_one_valid_building_or_a_row() {
    for case in RoofCase::ALL {
        for seed in 0..5 {
            let scene = make(Source::Case(case), seed, 0.05);
            let expected = match case {
                RoofCase::PartyWalls | RoofCase::TwoHalls => 5,
                _ => 1,
            };
            assert_eq!(scene.buildings.len(), expected, "{case:?} with seed {seed}");
            check(&scene, &format!("{case:?} with seed {seed}"));
        }
    }
}

#[test]
fn towns_are_valid_and_varied() {
    for (seed, slope) in [(1, 0.0), (2, 0.05), (3, 0.15)] {
        let scene = make(Source::Procedural { area_km2: 0.1 }, seed, slope);
        check(&scene, &format!("town {seed}"));
        let kinds: std::collections::BTreeSet<String> =
            scene.buildings.iter().map(|b| format!("{:?}", b.truth.attributes["roof_type"])).collect();
        assert!(scene.buildings.len() > 80 && kinds.len() >= 9, "{} buildings, {kinds:?}", scene.buildings.len());
        let touching = scene.trees.iter().filter(|t| {
            let near = |b: &gable_synthetic_city::SceneBuilding| {
                let reach = t.radius;
                b.rims.iter().any(|r| gable_geometry::point_segment_distance(t.place, r.from, r.to) < reach)
            };
            scene.buildings.iter().any(near)
        });
        let share = touching.count() as f64 / scene.trees.len() as f64;
        assert!((0.15..0.45).contains(&share), "{share:.2} of the trees touch buildings");
    }
}

/// Roof faces by case, counted by hand.
#[test]
fn roofs_have_as_many_planes_as_their_kind_says() {
    let counts = [
        (RoofCase::Gable, 2),
        (RoofCase::Hip, 4),
        (RoofCase::HalfHip, 4),
        (RoofCase::Mansard, 8),
        (RoofCase::Shed, 1),
        (RoofCase::Pyramid, 4),
        (RoofCase::CrossGable, 4),
        (RoofCase::LShape, 4),
        (RoofCase::FlatParapet, 1),
        (RoofCase::Terraces, 3),
        (RoofCase::Courtyard, 8),
        (RoofCase::Skew, 2),
    ];
    for (case, planes) in counts {
        for seed in 0..5 {
            let scene = make(Source::Case(case), seed, 0.0);
            assert_eq!(scene.buildings[0].roof.len(), planes, "{case:?} with seed {seed}");
        }
    }
}

#[test]
fn copies_of_a_model_stay_valid() {
    let town = make(Source::Procedural { area_km2: 0.02 }, 5, 0.05);
    let model = CityModel {
        title: "Town".to_owned(),
        metadata: Default::default(),
        origin: [0.0; 3],
        crs: Crs::Unknown,
        buildings: town.buildings.iter().map(|b| b.truth.clone()).collect(),
        terrain: None,
    };
    let copies = make(Source::Truth { model: Box::new(model), repeat: 3 }, 6, 0.05);
    assert_eq!(copies.buildings.len(), 9 * town.buildings.len());
    let ids: std::collections::BTreeSet<&str> = copies.buildings.iter().map(|b| b.truth.id.as_str()).collect();
    assert_eq!(ids.len(), copies.buildings.len());
    let roofs = |scene: &Scene| scene.buildings.iter().map(|b| b.roof.len()).sum::<usize>();
    assert_eq!(roofs(&copies), 9 * roofs(&town));
    for building in &copies.buildings {
        assert!(copies.extent.contains(building.bounds.min) && copies.extent.contains(building.bounds.max));
        for shell in building.truth.lods.lod1.iter().chain(&building.truth.lods.lod2) {
            let issues = validate_solid(shell, &Tolerances::strict());
            assert!(issues.is_empty(), "{}: {issues:?}", building.truth.id);
        }
        let lowest = building.truth.lods.lod2[0].vertices.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        let centre = (building.bounds.min + building.bounds.max) / 2.0;
        assert!(lowest <= copies.relief.height(centre) && lowest > copies.relief.height(centre) - 6.0);
    }
}

#[test]
fn a_model_without_solids_is_refused() {
    let model = CityModel {
        title: String::new(),
        metadata: Default::default(),
        origin: [0.0; 3],
        crs: Crs::Unknown,
        buildings: Vec::new(),
        terrain: None,
    };
    let params = SynthParams { source: Source::Truth { model: Box::new(model), repeat: 1 }, ..SynthParams::default() };
    let message = scene(&params).err().expect("an error").to_string();
    assert!(message.starts_with("the truth has no building with a usable LOD2 solid"), "{message}");
}

/// Water is level, under the ground around it, and nothing stands in it.
#[test]
fn water_is_level_and_free() {
    let scene = make(Source::Procedural { area_km2: 0.2 }, 101, 0.05);
    let water: Vec<_> = scene.patches.iter().filter(|p| p.cover == Cover::Water).collect();
    assert!(water.len() > 10, "{} pieces", water.len());
    for patch in water {
        let level = patch.level.expect("water has a level");
        for i in -9..=9 {
            for j in -9..=9 {
                let p = patch.plan.at(f64::from(i) / 10.0, f64::from(j) / 10.0);
                assert_eq!(scene.ground(p), level);
                assert!(level < scene.relief.height(p) - 0.3, "{level} at {p}");
                assert_eq!(scene.building_at(p), None);
            }
        }
        assert!(scene.trees.iter().all(|t| !patch.covers(t.place)));
        let beside = patch.plan.at(0.0, 1.0 + 0.5 / patch.plan.half_width);
        assert_eq!(scene.ground(beside), scene.relief.height(beside));
    }
}
