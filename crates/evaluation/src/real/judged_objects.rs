//! Buildings of a result against buildings drawn by hand.

use super::outlines::OutlineClass;
use super::scene::{Known, RealScene, fill};
use crate::city::footprint;
use crate::city::region;
use crate::height_raster::NONE;
use crate::region::{Region, Ring};
use gable_city_model::{Building, CityModel};
use gable_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Smaller objects and buildings are not counted, m².
pub const SMALLEST: f64 = 20.0;

/// An object that has less than this of its sure part on true buildings is invented; a building of which less is covered is missed;
/// an object holds a building of which it covers as much.
const HALF: f64 = 0.5;

/// A part of a building is divided if two objects cover as much of it.
const TENTH: f64 = 0.1;

/// How buildings are found. Only what lies in the judged area where the mesh has a surface counts.
///
/// Objects are the result's buildings with at least [`SMALLEST`] and half of their roof there; those that lie by half or more
/// on `unsure` are left out. What else of an object lies on `unsure` counts neither for nor against it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JudgedObjects {
    /// Share of the area of true buildings that objects of any size cover; `None` if there is no true building.
    pub completeness: Option<f64>,
    /// Share of the sure area of objects of any size that is true building; `None` if there is no object.
    pub correctness: Option<f64>,
    /// True buildings from [`SMALLEST`].
    pub buildings: usize,
    /// Those of which objects together cover at least half.
    pub found: usize,
    /// Those found of which one object covers half, together with half of another building.
    pub merged: usize,
    /// Those found with a part (a polygon of them) of which two objects cover a tenth and [`SMALLEST`] each.
    pub split: usize,
    /// Those that are not found.
    pub missed: usize,
    /// Objects.
    pub objects: usize,
    /// Those of whose sure area less than half is true building.
    pub invented: usize,
    /// Invented ones whose sure area is crowns by half or more.
    pub crowns: usize,
}

/// Pixels of an object.
#[derive(Default)]
struct Cover {
    judged: usize,
    unsure: usize,
    building: usize,
    tree: usize,
    /// By polygon.
    polygons: BTreeMap<u32, usize>,
}

/// The roof of a building seen from above: its LOD0 roof edge, else its footprint.
pub(crate) fn roofprint(building: &Building, shift: DVec3) -> Region {
    let edge = region(building.lods.roof_edge.as_slice(), shift, |_| true);
    if edge.is_empty() { footprint(building, shift) } else { edge }
}

/// `shift` is added to the coordinates of the model.
pub(crate) fn judged_objects(scene: &RealScene, model: &CityModel, shift: DVec3) -> JudgedObjects {
    let mut covered = vec![false; scene.known.len()];
    let mut objects: Vec<Cover> = Vec::new();
    for building in &model.buildings {
        let roof = roofprint(building, shift);
        let rings: Vec<Ring> = roof.rings().cloned().collect();
        let mut cover = Cover::default();
        fill(&scene.surface, &rings, |at| {
            covered[at] = true;
            count(&mut cover, scene.known[at], scene.polygon[at]);
        });
        let judged = scene.area(cover.judged);
        if judged >= SMALLEST && judged >= HALF * roof.area() {
            objects.push(cover);
        }
    }
    objects.retain(|o| (o.unsure as f64) < HALF * o.judged as f64);
    let mut figures = areas(scene, &covered);
    figures.objects = objects.len();
    for object in &objects {
        let sure = (object.judged - object.unsure) as f64;
        if (object.building as f64) < HALF * sure {
            figures.invented += 1;
            figures.crowns += usize::from(object.tree as f64 >= HALF * sure);
        }
    }
    count_buildings(scene, &covered, &objects, &mut figures);
    figures
}

fn count(cover: &mut Cover, known: Known, polygon: u32) {
    match known {
        Known::Nothing => return,
        Known::Drawn(OutlineClass::Unsure) => cover.unsure += 1,
        Known::Drawn(OutlineClass::Building) => {
            cover.building += 1;
            *cover.polygons.entry(polygon).or_default() += 1;
        }
        Known::Drawn(OutlineClass::Tree) => cover.tree += 1,
        Known::Drawn(_) | Known::NotDrawn => {}
    }
    cover.judged += 1;
}

/// Completeness and correctness by area.
fn areas(scene: &RealScene, covered: &[bool]) -> JudgedObjects {
    let (mut truth, mut result, mut both) = (0_usize, 0_usize, 0_usize);
    for (known, &covered) in scene.known.iter().zip(covered) {
        let is_building = match known {
            Known::Nothing | Known::Drawn(OutlineClass::Unsure) => continue,
            known => *known == Known::Drawn(OutlineClass::Building),
        };
        truth += usize::from(is_building);
        result += usize::from(covered);
        both += usize::from(is_building && covered);
    }
    let share = |whole: usize| (whole > 0).then(|| both as f64 / whole as f64);
    JudgedObjects { completeness: share(truth), correctness: share(result), ..JudgedObjects::default() }
}

/// Finds which true buildings are found, merged, split or missed.
fn count_buildings(scene: &RealScene, covered: &[bool], objects: &[Cover], figures: &mut JudgedObjects) {
    let outlines = &scene.outlines;
    // Pixels of each polygon, and of each building those of it and those covered.
    let mut polygons = vec![0_usize; outlines.outlines.len()];
    let mut sizes = vec![0_usize; outlines.buildings.len()];
    let mut hits = vec![0_usize; sizes.len()];
    let building_of = |polygon: u32| outlines.outlines.get(polygon as usize).and_then(|o| o.building);
    for (at, &polygon) in scene.polygon.iter().enumerate().filter(|p| *p.1 != NONE) {
        if let Some(building) = building_of(polygon) {
            polygons[polygon as usize] += 1;
            sizes[building] += 1;
            hits[building] += usize::from(covered[at]);
        }
    }
    let large = |pixels: usize| scene.area(pixels) >= SMALLEST;
    let mut merged = vec![false; sizes.len()];
    let mut holders = vec![0_usize; polygons.len()];
    for object in objects {
        let mut shares: BTreeMap<usize, usize> = BTreeMap::new();
        for (&polygon, &pixels) in &object.polygons {
            if let Some(building) = building_of(polygon) {
                *shares.entry(building).or_default() += pixels;
            }
            let of_part = pixels as f64 / polygons[polygon as usize] as f64;
            holders[polygon as usize] += usize::from(of_part >= TENTH && large(pixels));
        }
        let held = |(building, pixels): (usize, usize)| {
            (large(sizes[building]) && pixels as f64 >= HALF * sizes[building] as f64).then_some(building)
        };
        let held: Vec<usize> = shares.into_iter().filter_map(held).collect();
        if held.len() > 1 {
            held.into_iter().for_each(|building| merged[building] = true);
        }
    }
    let mut split = vec![false; sizes.len()];
    for (polygon, _) in holders.iter().enumerate().filter(|h| *h.1 > 1) {
        if let Some(building) = building_of(polygon as u32) {
            split[building] = true;
        }
    }
    for building in (0..sizes.len()).filter(|&b| large(sizes[b])) {
        figures.buildings += 1;
        if (hits[building] as f64) < HALF * sizes[building] as f64 {
            figures.missed += 1;
            continue;
        }
        figures.found += 1;
        figures.merged += usize::from(merged[building]);
        figures.split += usize::from(split[building]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::outlines::tests::{collection, rectangle};
    use super::super::scene::tests::slab;
    use super::*;
    use gable_city_model::{Attributes, Face, Lods, Semantic, Shell};
    use gable_geometry::{Crs, dvec3};

    /// Buildings whose roof edges are rectangles; their footprints are nothing that should be looked at.
    fn model(roofs: &[[f64; 4]]) -> CityModel {
        let flat = |[x0, y0, x1, y1]: [f64; 4]| Shell {
            vertices: [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| dvec3(x, y, 3.0)).to_vec(),
            faces: vec![Face {
                rings: vec![vec![0, 1, 2, 3]],
                semantic: Semantic::RoofSurface,
                attributes: Attributes::new(),
            }],
        };
        let building = |(number, roof): (usize, &[f64; 4])| Building {
            id: number.to_string(),
            attributes: Attributes::new(),
            lods: Lods { roof_edge: Some(flat(*roof)), footprint: Some(flat([0.0, 0.0, 1.0, 1.0])), ..Lods::default() },
        };
        let buildings = roofs.iter().enumerate().map(building).collect();
        CityModel {
            title: String::new(),
            metadata: Default::default(),
            origin: [0.0; 3],
            crs: Crs::Unknown,
            buildings,
            terrain: None,
        }
    }

    /// A mesh of 100 m × 40 m with six buildings, one of two parts and one too small to count.
    fn scene() -> RealScene {
        let outlines = collection(&[
            rectangle("building", "a", [0.0, 0.0, 10.0, 10.0]),
            rectangle("building", "b", [10.0, 0.0, 20.0, 10.0]),
            rectangle("building", "c", [30.0, 0.0, 40.0, 10.0]),
            rectangle("building", "c", [40.0, 0.0, 50.0, 10.0]),
            rectangle("building", "d", [60.0, 0.0, 70.0, 10.0]),
            rectangle("building", "e", [80.0, 0.0, 84.0, 4.0]),
            rectangle("building", "f", [80.0, 20.0, 88.0, 28.0]),
            rectangle("tree", "", [0.0, 20.0, 20.0, 40.0]),
            rectangle("unsure", "", [30.0, 20.0, 40.0, 40.0]),
        ]);
        RealScene::new(outlines, &slab([0.0, 0.0, 100.0, 40.0], 1.0, 0.0)).unwrap()
    }

    #[test]
    fn objects_of_a_hand_calculation() {
        let result = model(&[
            [0.0, 0.0, 20.0, 10.0],
            [30.0, 0.0, 40.0, 10.0],
            [40.0, 0.0, 50.0, 10.0],
            [60.0, 0.0, 65.0, 10.0],
            [65.0, 0.0, 70.0, 10.0],
            // A crown, one that is unsure but for 20 m², one in no polygon, a small one, and one of which the mesh has a quarter.
            [0.0, 20.0, 10.0, 30.0],
            [30.0, 20.0, 42.0, 30.0],
            [50.0, 20.0, 60.0, 30.0],
            [90.0, 30.0, 93.0, 33.0],
            [95.0, 0.0, 115.0, 10.0],
        ]);
        let figures = judged_objects(&scene(), &result, DVec3::ZERO);
        let share = |found: Option<f64>, wanted: f64| assert!((found.unwrap() - wanted).abs() < 1e-9, "{figures:?}");
        share(figures.completeness, 500.0 / 580.0);
        share(figures.correctness, 500.0 / 779.0);
        let wanted = JudgedObjects {
            completeness: figures.completeness,
            correctness: figures.correctness,
            buildings: 5,
            found: 4,
            merged: 2,
            split: 1,
            missed: 1,
            objects: 7,
            invented: 2,
            crowns: 1,
        };
        assert_eq!(figures, wanted);
    }

    #[test]
    fn halves_decide() {
        // 49 m² of 100 m² cover "a" and miss it; 51 m² find it. 60 m² beside it make the object an invented one.
        let found = |roof: [f64; 4]| judged_objects(&scene(), &model(&[roof]), DVec3::ZERO);
        let (less, more) = (found([0.0, 0.0, 10.0, 4.9]), found([0.0, 0.0, 10.0, 5.1]));
        assert_eq!((less.found, less.missed, less.invented), (0, 5, 0));
        assert_eq!((more.found, more.missed, more.invented), (1, 4, 0));
        let beside = found([0.0, 4.9, 10.0, 16.0]);
        assert_eq!((beside.found, beside.invented, beside.crowns), (1, 1, 0));
        // What is taken from two buildings is one object, which merges them only with half of both.
        assert_eq!(found([0.0, 0.0, 14.9, 10.0]).merged, 0);
        assert_eq!(found([0.0, 0.0, 15.1, 10.0]).merged, 2);
    }

    #[test]
    fn nothing_has_no_shares() {
        let nothing = judged_objects(&scene(), &model(&[]), DVec3::ZERO);
        assert_eq!((nothing.completeness, nothing.correctness, nothing.missed), (Some(0.0), None, 5));
        let wood = RealScene::new(
            collection(&[rectangle("tree", "", [0.0, 0.0, 20.0, 20.0])]),
            &slab([0.0, 0.0, 20.0, 20.0], 1.0, 0.0),
        );
        let figures = judged_objects(&wood.unwrap(), &model(&[[0.0, 0.0, 5.0, 5.0]]), DVec3::ZERO);
        assert_eq!((figures.completeness, figures.correctness), (None, Some(0.0)));
        assert_eq!((figures.buildings, figures.objects, figures.crowns), (0, 1, 1));
    }

    #[test]
    fn the_model_may_count_from_elsewhere() {
        let figures = judged_objects(&scene(), &model(&[[-60.0, 0.0, -50.0, 10.0]]), dvec3(120.0, 0.0, 0.0));
        assert_eq!((figures.found, figures.invented), (1, 0));
    }
}
