//! Faults of the mesh are counted once, whatever the grid, and left out.

use crate::scenes::{Folder, count, sheet};
use gable_blocks::{BlockTriangle, Defects};
use gable_geometry::{Counter, DVec3, dvec3};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// A sheet of 80 × 80 m across several spill cells.
fn city() -> Vec<[DVec3; 3]> {
    sheet(80, 1.0, dvec3(10.0, 20.0, 5.0))
}

fn defects(triangles: &[[DVec3; 3]]) -> Defects {
    let folder = Folder::new();
    let path = folder.obj("a.obj", triangles);
    let one = folder.split(&path, count(1, 1), "one").expect("splits");
    let many = folder.split(&path, count(7, 5), "many").expect("splits");
    assert_eq!(one.defects, many.defects, "the grid changes what is counted");
    let left = triangles.len() as u64 - one.defects.slivers - one.defects.duplicates - one.defects.floating_triangles;
    assert_eq!(folder.blocks(&one, "one")[0].len() as u64, left);
    one.defects
}

#[test]
fn a_sound_sheet_has_none() {
    assert_eq!(defects(&city()), Defects { parts: 1, ..Defects::default() });
}

#[test]
fn twins_in_any_order_are_counted_once_and_the_first_stays() {
    let mut triangles = city();
    // Across a border of the grid and of the spill's cells too: the same corners in other orders, one of them thrice.
    for at in [0, 17, 4000, 6399, 12_799] {
        let [a, b, c] = triangles[at];
        triangles.push([c, a, b]);
        if at == 17 {
            triangles.push([b, a, c]);
        }
    }
    // Within half a unit of the lattice is the same place.
    let [a, b, c] = triangles[100];
    triangles.push([a + DVec3::splat(1e-6), b, c]);
    assert_eq!(defects(&triangles), Defects { duplicates: 7, parts: 1, ..Defects::default() });
}

#[test]
fn triangles_that_are_lines_on_the_lattice_are_slivers() {
    let mut triangles = city();
    let [a, b, _] = triangles[0];
    triangles.push([a, b, (a + b) / 2.0 + dvec3(0.0, 1e-6, 0.0)]);
    assert_eq!(defects(&triangles), Defects { slivers: 1, parts: 1, ..Defects::default() });
}

#[test]
fn only_small_parts_that_are_clear_of_everything_float() {
    let above = |z: f64| sheet(4, 0.5, dvec3(40.0, 40.0, z));
    let with = |more: &[Vec<[DVec3; 3]>]| defects(&[city(), more.concat()].concat());
    // In the air, across the border between two cells of the grid of 7 × 5.
    let floating = with(&[above(12.0)]);
    assert_eq!(floating, Defects { floating_parts: 1, floating_triangles: 32, parts: 2, ..Defects::default() });
    // A car roof 0.4 m above the ground, and one that rises from it, stay.
    assert_eq!(with(&[above(5.4)]), Defects { parts: 2, ..Defects::default() });
    // Two that are near to one another are one.
    let two = with(&[above(12.0), above(12.3)]);
    assert_eq!((two.floating_parts, two.floating_triangles, two.parts), (1, 64, 3));
    // Two that are not.
    assert_eq!(with(&[above(12.0), above(14.0)]).floating_parts, 2);
    // A roof of 6 m is no small part.
    assert_eq!(with(&[sheet(4, 1.5, dvec3(40.0, 40.0, 12.0))]).floating_parts, 0);
}

#[test]
fn a_soup_is_not_judged() {
    let crumbs: Vec<_> = (0..200)
        .flat_map(|i| sheet(1, 0.5, dvec3(f64::from(i % 20) * 2.0, f64::from(i / 20) * 2.0, f64::from(i % 7))))
        .collect();
    assert_eq!(defects(&crumbs), Defects { parts: 200, ..Defects::default() });
}

/// Triangles between few points, so that corners, parts and twins come again, over several cells and sizes.
fn random(seed: u64, triangles: usize) -> Vec<[DVec3; 3]> {
    let mut random = Counter::new(seed);
    let points: Vec<DVec3> = (0..triangles)
        .map(|_| dvec3(random.range(0.0, 150.0), random.range(0.0, 100.0), random.range(0.0, 9.0)).round())
        .collect();
    let mut pick = || points[(random.range(0.0, 1.0) * points.len() as f64) as usize % points.len()];
    (0..triangles).map(|_| [pick(), pick(), pick()]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn agrees_with_looking_at_all_pairs(seed in any::<u64>(), triangles in 1usize..60) {
        let folder = Folder::new();
        let mut scene = random(seed, triangles);
        scene.push([dvec3(0.0, 0.0, 0.0), dvec3(9.0, 0.0, 0.0), dvec3(0.0, 9.0, 0.0)]);
        let path = folder.obj("a.obj", &scene);
        let report = folder.split(&path, count(3, 2), "a").expect("splits");
        let key = |t: &[DVec3; 3]| {
            let mut corners = t.map(|c| c.to_array().map(|v| v as i64));
            corners.sort_unstable();
            corners
        };
        let whole: Vec<_> = scene.iter().filter(|[a, b, c]| (*b - *a).cross(*c - *a) != DVec3::ZERO).collect();
        let distinct: BTreeSet<_> = whole.iter().map(|t| key(t)).collect();
        // Labels spread along shared corners until nothing changes.
        let mut label: Vec<usize> = (0..whole.len()).collect();
        let mut changed = true;
        while changed {
            changed = false;
            let mut lowest: BTreeMap<[i64; 3], usize> = BTreeMap::new();
            for (t, l) in whole.iter().zip(&label) {
                key(t).iter().for_each(|c| { let e = lowest.entry(*c).or_insert(*l); *e = (*e).min(*l); });
            }
            for (t, l) in whole.iter().zip(&mut label) {
                for c in key(t) {
                    if lowest[&c] < *l { *l = lowest[&c]; changed = true; }
                }
            }
        }
        let parts: BTreeSet<_> = label.iter().collect();
        prop_assert_eq!(report.defects.duplicates, (whole.len() - distinct.len()) as u64);
        prop_assert_eq!(report.defects.parts, parts.len() as u64);
        let found: BTreeSet<_> = folder.blocks(&report, "a").iter().flatten().map(|t: &BlockTriangle| t.corners).collect();
        prop_assert!(found.len() as u64 + report.defects.floating_triangles >= distinct.len() as u64);
    }
}
