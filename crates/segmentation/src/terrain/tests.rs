//! The ground of scenes that towns have, against the ground that they were made from.

use super::*;
use gable_geometry::{Counter, dvec2};

const WINDOW: GridWindow = GridWindow { step: 0.5, x0: -500, y0: 300, width: 800, height: 700 };

// A scene from a ground and objects; `objects` gives the height over the ground.
fn scene(ground: impl Fn(f64, f64) -> f64, objects: impl Fn(f64, f64) -> f64) -> (Raster<f32>, CoarseHeights) {
    let mut random = Counter::new(17);
    let mut raster = Raster::filled(WINDOW, 0.0_f32);
    for row in 0..WINDOW.height {
        for column in 0..WINDOW.width {
            let p = WINDOW.centre(column, row) - WINDOW.bounds().min;
            raster[(column, row)] = (ground(p.x, p.y) + objects(p.x, p.y) + random.range(-0.12, 0.12)) as f32;
        }
    }
    let mut coarse = CoarseHeights::new(CoarseHeights::CELL);
    coarse.accumulate(&raster);
    (raster, coarse)
}

// Largest error of the terrain over the places that `at` chooses, in the scene's metres.
fn worst(terrain: &Terrain, ground: impl Fn(f64, f64) -> f64, at: impl Fn(f64, f64) -> bool) -> f64 {
    let mut worst: f64 = 0.0;
    for y in (6..344).step_by(2) {
        for x in (6..394).step_by(2) {
            let (x, y) = (f64::from(x), f64::from(y));
            if at(x, y) {
                let p = dvec2(x, y) + WINDOW.bounds().min;
                worst = worst.max((terrain.height(p) - ground(x, y)).abs());
            }
        }
    }
    worst
}

// Of the places that `at` chooses, those where the terrain is off by more than a metre, and all.
fn wrong_places(terrain: &Terrain, ground: impl Fn(f64, f64) -> f64, at: impl Fn(f64, f64) -> bool) -> (usize, usize) {
    let (mut off, mut all) = (0, 0);
    for y in (6..344).step_by(2) {
        for x in (6..394).step_by(2) {
            let (x, y) = (f64::from(x), f64::from(y));
            if at(x, y) {
                all += 1;
                let p = dvec2(x, y) + WINDOW.bounds().min;
                off += usize::from((terrain.height(p) - ground(x, y)).abs() > 1.0);
            }
        }
    }
    (off, all)
}

fn inside(x: f64, y: f64, [x0, y0, x1, y1]: [f64; 4]) -> bool {
    x0 <= x && x <= x1 && y0 <= y && y <= y1
}

// A hall of 120 × 110 m, a block with a courtyard of 14 m, a low shed, rows of houses.
fn town(x: f64, y: f64) -> f64 {
    let houses = inside(x, y, [250.0, 20.0, 380.0, 330.0]) && (x - 250.0) % 32.0 < 14.0 && (y - 20.0) % 26.0 < 19.0;
    if inside(x, y, [40.0, 180.0, 160.0, 290.0]) {
        8.0
    } else if inside(x, y, [60.0, 40.0, 110.0, 90.0]) && !inside(x, y, [78.0, 58.0, 92.0, 72.0]) {
        18.0
    } else if inside(x, y, [150.0, 60.0, 170.0, 75.0]) {
        2.6
    } else if houses {
        7.0
    } else {
        0.0
    }
}

#[test]
fn follows_slopes_under_wide_buildings_and_into_courtyards() {
    for slope in [0.0, 0.05, 0.15] {
        let ground = move |x: f64, y: f64| 30.0 + slope * x - 0.5 * slope * y;
        let terrain = Terrain::from_coarse(&scene(ground, town).1).unwrap();
        let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0);
        let under = worst(&terrain, ground, |x, y| town(x, y) > 0.0);
        assert!(open < 0.6 && under < 1.0, "slope {slope}: {open:.2} m in the open, {under:.2} m under buildings");
    }
}

#[test]
fn follows_a_hill() {
    let ground = |x: f64, y: f64| 14.0 * (-((x - 200.0).powi(2) + (y - 170.0).powi(2)) / 9000.0).exp();
    let terrain = Terrain::from_coarse(&scene(ground, town).1).unwrap();
    let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0);
    assert!(open < 0.7, "{open:.2} m");
}

#[test]
fn keeps_both_sides_of_a_river_bank() {
    // A quay wall: the town lies 5 m over a river of 70 m width.
    let ground = |x: f64, _: f64| if inside(x, 0.0, [180.0, 0.0, 245.0, 0.0]) { 0.0 } else { 5.0 };
    let terrain = Terrain::from_coarse(&scene(ground, town).1).unwrap();
    // Half a cell beside the wall the surface is between the two.
    let away = |x: f64| (x - 180.0).abs() > 3.0 && (x - 245.0).abs() > 3.0;
    let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0 && away(x));
    assert!(open < 0.6, "{open:.2} m");
}

#[test]
fn pits_and_floaters_do_not_count() {
    let ground = |x: f64, y: f64| 0.03 * x + 0.02 * y;
    let spoilt = |x: f64, y: f64| {
        // Spikes of 1–8 m width under ground, and something that hovers.
        for (cx, cy, width, depth) in [(30.0, 120.0, 1.0, -25.0), (200.0, 150.0, 3.0, -12.0), (210.0, 250.0, 8.0, -6.0)]
        {
            if (x - cx).abs() < width / 2.0 && (y - cy).abs() < width / 2.0 {
                return depth;
            }
        }
        if inside(x, y, [190.0, 30.0, 192.0, 33.0]) { 30.0 } else { town(x, y) }
    };
    let terrain = Terrain::from_coarse(&scene(ground, spoilt).1).unwrap();
    let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0);
    assert!(open < 0.6, "{open:.2} m");
}

#[test]
fn woods_are_no_ground() {
    let ground = |x: f64, y: f64| 0.05 * x + 0.01 * y;
    let crowns = |x: f64, y: f64| {
        if inside(x, y, [100.0, 80.0, 260.0, 240.0]) { 9.0 + 2.5 * ((x / 2.1).sin() + (y / 1.7).cos()) } else { 0.0 }
    };
    let terrain = Terrain::from_coarse(&scene(ground, crowns).1).unwrap();
    let outside = worst(&terrain, ground, |x, y| !inside(x, y, [95.0, 75.0, 265.0, 245.0]));
    assert!(outside < 0.6, "{outside:.2} m");
    // A gap between smooth crowns may look like a clearing: one in a hundred places.
    let (off, all) = wrong_places(&terrain, ground, |_, _| true);
    assert!(off * 100 < all, "{off} of {all}");
}

#[test]
fn low_roofs_between_higher_ones_are_no_ground() {
    // A block whose court is built over, 3.5 m high but for a yard, and another whose roof has a terrace.
    let blocks = |x: f64, y: f64| {
        if inside(x, y, [60.0, 60.0, 130.0, 120.0]) {
            let is_court = inside(x, y, [72.0, 72.0, 118.0, 108.0]);
            let is_yard = inside(x, y, [100.0, 72.0, 118.0, 108.0]);
            if is_yard {
                0.0
            } else if is_court {
                3.5
            } else {
                11.0
            }
        } else if inside(x, y, [200.0, 150.0, 240.0, 190.0]) {
            if inside(x, y, [212.0, 160.0, 226.0, 176.0]) { 4.0 } else { 10.0 }
        } else {
            0.0
        }
    };
    for slope in [0.0, 0.04] {
        let ground = move |x: f64, y: f64| 3.0 + slope * x - 0.5 * slope * y;
        let terrain = Terrain::from_coarse(&scene(ground, blocks).1).unwrap();
        let everywhere = worst(&terrain, ground, |_, _| true);
        assert!(everywhere < 0.8, "slope {slope}: {everywhere:.2} m");
    }
}

#[test]
fn a_meadow_in_a_wood_is_ground() {
    let ground = |x: f64, y: f64| 0.02 * x - 0.01 * y;
    let is_meadow = |x: f64, y: f64| inside(x, y, [150.0, 120.0, 230.0, 180.0]);
    // High plants all over the meadow.
    let plants = |x: f64, y: f64| {
        if is_meadow(x, y) {
            0.6 + 0.45 * ((x / 1.3).sin() + (y / 1.1).cos())
        } else {
            10.0 + 2.5 * ((x / 2.1).sin() + (y / 1.7).cos())
        }
    };
    let terrain = Terrain::from_coarse(&scene(ground, plants).1).unwrap();
    let meadow = worst(&terrain, ground, is_meadow);
    assert!(meadow < 1.6, "{meadow:.2} m");
}

#[test]
fn a_terraced_hillside_is_ground() {
    // Terraces of 9 m with walls of 3 m that end nowhere; houses on some of them.
    let terraces = |x: f64, y: f64| {
        let along = x + 6.0 * (y / 25.0).sin();
        3.0 * (along / 9.0).floor() + 0.1 * along.rem_euclid(9.0)
    };
    let is_house = |x: f64, y: f64| x.rem_euclid(36.0) < 6.0 && y.rem_euclid(40.0) < 11.0;
    let houses = |x: f64, y: f64| if is_house(x, y) { 6.5 } else { 0.0 };
    let (raster, coarse) = scene(terraces, houses);
    let terrain = Terrain::from_coarse(&coarse).unwrap();
    let ground = terrain.under(&raster);
    let window = raster.window();
    let (mut off, mut all) = (0, 0);
    for row in 0..window.height {
        for column in 0..window.width {
            let p = window.centre(column, row) - window.bounds().min;
            all += 1;
            off += usize::from((f64::from(ground[(column, row)]) - terraces(p.x, p.y)).abs() > 1.5);
        }
    }
    assert!(off * 50 < all, "{off} of {all}");
}

#[test]
fn a_bridge_is_ground_and_a_long_hall_is_none() {
    // A river between quays, a bridge over it, and a hall as long and as wide on the bank.
    let is_river = |x: f64| inside(x, 0.0, [150.0, 0.0, 220.0, 0.0]);
    let is_deck = |x: f64, y: f64| inside(x, y, [140.0, 160.0, 230.0, 174.0]);
    let ground = |x: f64, y: f64| if is_river(x) && !is_deck(x, y) { -5.0 } else { 0.01 * x };
    let things = |x: f64, y: f64| {
        let is_railing = is_deck(x, y) && !inside(x, y, [140.0, 160.8, 230.0, 173.2]);
        if is_railing {
            0.9
        } else if inside(x, y, [250.0, 80.0, 340.0, 94.0]) {
            6.0
        } else {
            0.0
        }
    };
    let terrain = Terrain::from_coarse(&scene(ground, things).1).unwrap();
    let at_edge = |x: f64, y: f64| {
        let beside = |at: f64, edge: f64| (at - edge).abs() < 3.0;
        beside(x, 150.0) || beside(x, 220.0) || beside(y, 160.0) || beside(y, 174.0)
    };
    let open = worst(&terrain, ground, |x, y| !at_edge(x, y));
    assert!(open < 0.8, "{open:.2} m");
}

#[test]
fn a_street_between_a_canal_and_houses_is_ground() {
    // A canal 4 m deep, a street of 8 m on either side with trees at the quay, rows of houses without a gap.
    let is_canal = |x: f64| (x - 200.0).abs() < 12.0;
    let ground = |x: f64, y: f64| if is_canal(x) { -4.0 } else { 0.01 * y };
    let things = |x: f64, y: f64| {
        let from_quay = (x - 200.0).abs() - 12.0;
        let is_tree = (from_quay - 1.6).hypot((y + 4.0).rem_euclid(8.0) - 4.0) < 2.0 && from_quay > 0.0;
        if (8.0..20.0).contains(&from_quay) {
            7.0 + (y / 7.0).floor().rem_euclid(3.0)
        } else if is_tree {
            6.0 + (3.0 * x).sin() * (3.0 * y).cos()
        } else {
            0.0
        }
    };
    let terrain = Terrain::from_coarse(&scene(ground, things).1).unwrap();
    let at_quay = |x: f64| ((x - 200.0).abs() - 12.0).abs() < 3.0;
    let (off, all) = wrong_places(&terrain, ground, |x, _| !at_quay(x));
    assert!(off * 200 < all, "{off} of {all}");
}

#[test]
fn cars_and_spikes_leave_no_trace() {
    let ground = |x: f64, y: f64| 0.1 * x + 0.02 * y;
    let cars = |x: f64, y: f64| {
        if x.rem_euclid(23.0) < 2.0 && y.rem_euclid(17.0) < 4.5 {
            0.9
        } else if x.rem_euclid(31.0) < 1.0 && y.rem_euclid(29.0) < 1.0 {
            -2.0
        } else {
            0.0
        }
    };
    let terrain = Terrain::from_coarse(&scene(ground, cars).1).unwrap();
    let everywhere = worst(&terrain, ground, |_, _| true);
    assert!(everywhere < 0.4, "{everywhere:.2} m");
}

#[test]
fn nothing_gives_a_plane() {
    let terrain = Terrain::from_coarse(&CoarseHeights::new(2.0)).unwrap();
    assert_eq!(terrain.height(dvec2(3.0, 4.0)), 0.0);
}
