//! Far-off bits must not blow up the grid.

use crate::scenes::{Folder, count, sheet};
use gable_geometry::{DVec3, dvec3};

#[test]
fn a_floater_far_away_is_left_out_and_reported() {
    let folder = Folder::new();
    let city = sheet(60, 4.0, dvec3(1000.0, 2000.0, 30.0));
    let alone = folder.obj("alone.obj", &city);
    let expected = folder.split(&alone, count(4, 4), "alone").expect("splits");
    // First, so that the lattice is hung on it, and south-west, so that it would move the frame.
    let floater = sheet(2, 1.0, dvec3(-4000.0, -2500.0, 90.0));
    let path = folder.obj("city.obj", &[floater, city].concat());
    let report = folder.split(&path, count(4, 4), "city").expect("splits");
    assert_eq!((report.outliers.parts, report.outliers.triangles), (1, 8));
    assert!((report.outliers.reach - 5000.0).abs() < 1.0, "{}", report.outliers.reach);
    assert_eq!(report.grid, expected.grid);
    let counts = |r: &gable_blocks::SplitReport| r.blocks.iter().map(|b| b.triangles).collect::<Vec<_>>();
    assert_eq!(counts(&report), counts(&expected));
}

#[test]
fn a_spike_out_of_the_city_does_not_widen_the_grid() {
    let folder = Folder::new();
    let mut triangles = sheet(60, 4.0, DVec3::ZERO);
    triangles.push([dvec3(100.0, 100.0, 0.0), dvec3(101.0, 100.0, 0.0), dvec3(9000.0, 120.0, 50.0)]);
    let path = folder.obj("spike.obj", &triangles);
    let report = folder.split(&path, count(2, 2), "spike").expect("splits");
    assert_eq!(report.max[0], 240.0);
    assert_eq!((report.outliers.parts, report.outliers.triangles), (1, 1));
}

#[test]
fn a_village_beside_the_city_stays() {
    let folder = Folder::new();
    let village = sheet(2, 4.0, dvec3(400.0, 0.0, 0.0));
    let path = folder.obj("a.obj", &[sheet(60, 4.0, DVec3::ZERO), village].concat());
    let report = folder.split(&path, count(2, 2), "a").expect("splits");
    assert_eq!((report.max[0], report.outliers.parts), (408.0, 0));
}

#[test]
fn scattered_islands_are_all_kept() {
    let folder = Folder::new();
    let island = |i: i32| sheet(1, 5.0, dvec3(f64::from(i % 20) * 300.0, f64::from(i / 20) * 300.0, 0.0));
    let path = folder.obj("a.obj", &(0..400).flat_map(island).collect::<Vec<_>>());
    let report = folder.split(&path, count(3, 3), "a").expect("splits");
    assert_eq!((report.outliers.parts, report.max[0]), (0, 5705.0));
}

#[test]
fn what_lies_beyond_the_lattice_is_counted_or_refused() {
    let folder = Folder::new();
    let city = sheet(20, 4.0, DVec3::ZERO);
    let floater = sheet(1, 4.0, dvec3(4.0e5, 0.0, 0.0));
    let path = folder.obj("a.obj", &[city.clone(), floater.clone()].concat());
    let report = folder.split(&path, count(2, 2), "a").expect("splits");
    assert_eq!(report.outliers.beyond_lattice, 2);
    let path = folder.obj("b.obj", &[floater, city].concat());
    let said = folder.split(&path, count(2, 2), "b").expect_err("too wide").to_string();
    assert_eq!(
        said,
        "the scene measures 400004 m, but only 262144 m around its first vertex can be worked on: \
         cut it into parts, or remove stray vertices"
    );
}
