//! Grounds that towns have, and what lies low in a scene: the ground stays ground, and the house on it is one building.
//!
//! Each scene is a height field of 0.5 m with one house, small enough that no window of the method fits into it.

use gable_city_model::CityModel;
use gable_geometry::{Counter, DVec2, DVec3, dvec2};
use gable_tests::{footprints, read_city, run_gable};
use std::fmt::Write as _;
use std::path::Path;

const STEP: f64 = 0.5;

/// A ground with one house on it; heights in metres.
struct Scene {
    name: &'static str,
    size: f64,
    ground: fn(DVec2) -> f64,
    /// What stands on the ground or hangs below it: the height of the surface, given that of the ground.
    surface: fn(DVec2, f64) -> f64,
    /// Footprint of the house: corner and size.
    house: [f64; 4],
    /// Area that its model may have, m².
    area: [f64; 2],
    /// Places where the terrain need not be right (nor within 4 m of them).
    low: fn(DVec2) -> bool,
}

const WIDE: [f64; 4] = [60.0, 55.0, 12.0, 10.0];
const NARROW: [f64; 4] = [60.0, 60.0, 12.0, 9.0];

fn inside(p: DVec2, [x, y, w, h]: [f64; 4]) -> bool {
    p.x >= x && p.x <= x + w && p.y >= y && p.y <= y + h
}

/// A gabled house of 6 m eaves.
fn wide_house(p: DVec2, ground: f64) -> f64 {
    if inside(p, WIDE) { ground + 9.0 - (p.y - 60.0).abs() * 0.6 } else { ground }
}

/// A gabled house of 5 m eaves.
fn narrow_house(p: DVec2, ground: f64) -> f64 {
    if inside(p, NARROW) { ground + 5.0 + (4.5 - (p.y - 64.5).abs()) * 0.8 } else { ground }
}

fn everywhere(_: DVec2) -> bool {
    false
}

const fn scene(name: &'static str, ground: fn(DVec2) -> f64) -> Scene {
    Scene { name, size: 100.0, ground, surface: wide_house, house: WIDE, area: [112.0, 140.0], low: everywhere }
}

/// A flat yard in which something lies low.
const fn yard(name: &'static str, surface: fn(DVec2, f64) -> f64, low: fn(DVec2) -> bool) -> Scene {
    Scene { name, size: 100.0, ground: |_| 0.0, surface, house: NARROW, area: [104.0, 130.0], low }
}

/// Height field as an OFF file.
fn write(scene: &Scene, path: &Path) {
    write_field(path, DVec2::ZERO, scene.size, |p| (scene.surface)(p, (scene.ground)(p)));
}

/// A square of a height field as an OFF file.
fn write_field(path: &Path, corner: DVec2, size: f64, height: impl Fn(DVec2) -> f64) {
    let side = (size / STEP) as usize + 1;
    let mut random = Counter::new(5);
    let mut text = format!("OFF\n{} {} 0\n", side * side, 2 * (side - 1) * (side - 1));
    for j in 0..side {
        for i in 0..side {
            let p = corner + dvec2(i as f64, j as f64) * STEP;
            let z = height(p) + random.range(-0.03, 0.03);
            writeln!(text, "{} {} {z:.3}", p.x, p.y).unwrap();
        }
    }
    for j in 0..side - 1 {
        for i in 0..side - 1 {
            let a = j * side + i;
            writeln!(text, "3 {a} {} {}\n3 {a} {} {}", a + 1, a + side + 1, a + side + 1, a + side).unwrap();
        }
    }
    std::fs::write(path, text).unwrap();
}

/// Heights of the terrain on a grid of 2 m, in the coordinates of the scene.
fn terrain_heights(city: &CityModel) -> Vec<(DVec2, f64)> {
    const SPACING: f64 = 2.0;
    let terrain = city.terrain.as_ref().expect("a terrain is written");
    let origin = DVec3::from(city.origin);
    let mut heights = Vec::new();
    for triangle in &terrain.triangles {
        let [a, b, c] = triangle.map(|i| terrain.vertices[i as usize] + origin);
        let (low, high) = (a.min(b).min(c).truncate(), a.max(b).max(c).truncate());
        let twice = (b - a).truncate().perp_dot((c - a).truncate());
        let range = |from: f64, to: f64| (from / SPACING).ceil() as i64..=(to / SPACING).floor() as i64;
        for j in range(low.y, high.y) {
            for i in range(low.x, high.x) {
                let p = dvec2(i as f64, j as f64) * SPACING;
                let along = |u: DVec3, v: DVec3| (u.truncate() - p).perp_dot(v.truncate() - p) / twice;
                let weights = [along(b, c), along(c, a), along(a, b)];
                if weights.iter().all(|w| *w >= 0.0) {
                    heights.push((p, weights[0] * a.z + weights[1] * b.z + weights[2] * c.z));
                }
            }
        }
    }
    heights
}

/// Root mean square error of the written terrain, away from the house and from low places and steps.
fn terrain_error(scene: &Scene, city: &CityModel) -> f64 {
    let near = |p: DVec2, test: &dyn Fn(DVec2) -> bool| {
        (-4..=4).any(|i| (-4..=4).any(|j| test(p + dvec2(f64::from(i), f64::from(j)))))
    };
    let (mut squares, mut count) = (0.0, 0);
    for (p, z) in terrain_heights(city) {
        let height = (scene.ground)(p);
        let step = |q: DVec2| ((scene.ground)(q) - height).abs() > 3.0;
        let is_open = inside(p, [1.0, 1.0, scene.size - 2.0, scene.size - 2.0])
            && !near(p, &|q| inside(q, scene.house))
            && !near(p, &scene.low)
            && !near(p, &step);
        if is_open {
            squares += (z - height).powi(2);
            count += 1;
        }
    }
    assert!(count > 500, "{}: the terrain covers {count} places in the open", scene.name);
    (squares / f64::from(count)).sqrt()
}

fn check(scenes: &[Scene]) {
    let mut wrong = Vec::new();
    for scene in scenes {
        let folder = tempfile::tempdir().unwrap();
        let (mesh, out) = (folder.path().join("mesh.off"), folder.path().join("out"));
        write(scene, &mesh);
        let arguments = ["run", mesh.to_str().unwrap(), "--out", out.to_str().unwrap(), "--grid", "1x1", "--quiet"];
        let _ = run_gable(&[&arguments[..], &["--set", "output.report=false"]].concat()).success();
        let city = read_city(&out.join("city.city.jsonl"), None);
        let areas: Vec<f64> =
            footprints(&city).values().map(|f| f.iter().map(gable_geometry::Polygon::area).sum()).collect();
        let right = matches!(areas[..], [area] if area > scene.area[0] && area < scene.area[1]);
        let error = terrain_error(scene, &city);
        if !right || error > 0.3 {
            wrong.push(format!("{}: {areas:.1?} m², terrain {error:.2} m", scene.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn slopes_courts_quays_and_terraces_are_ground() {
    check(&[
        scene("flat", |_| 0.0),
        scene("court of 3 m", |p| if inside(p, [20.0, 20.0, 14.0, 14.0]) { -3.0 } else { 0.0 }),
        scene("court of 5 m", |p| if inside(p, [20.0, 20.0, 14.0, 14.0]) { -5.0 } else { 0.0 }),
        scene("pit of 20 m", |p| if inside(p, [20.0, 20.0, 16.0, 16.0]) { -20.0 } else { 0.0 }),
        scene("quay of 5 m", |p| if p.x < 12.0 { -5.0 } else { 0.0 }),
        scene("terrace of 4 m", |p| if p.x > 50.0 { 4.0 } else { 0.0 }),
        scene("slope of 25 %", |p| 0.25 * p.x),
        scene("slope of 40 %", |p| 0.40 * p.x),
        scene("dam", |p| (12.0 - (p.x - 30.0).abs()).clamp(0.0, 7.5) * 0.67),
        scene("cutting", |p| -(14.0 - (p.x - 30.0).abs()).clamp(0.0, 7.5) * 0.8),
    ]);
}

#[test]
fn what_lies_low_does_not_make_a_building_of_the_rest() {
    check(&[
        yard(
            "shaft",
            |p, z| if inside(p, [38.5, 28.5, 3.0, 3.0]) { -4.0 } else { narrow_house(p, z) },
            |p| inside(p, [38.5, 28.5, 3.0, 3.0]),
        ),
        yard(
            "stair",
            |p, z| if inside(p, [36.0, 26.0, 8.0, 8.0]) { -4.0 } else { narrow_house(p, z) },
            |p| inside(p, [36.0, 26.0, 8.0, 8.0]),
        ),
        yard("skirt", |p, z| if p.x < 0.5 { -20.0 } else { narrow_house(p, z) }, |p| p.x < 0.5),
        yard("teeth", |p, z| if p.x < 4.0 && p.y % 6.0 < 3.0 { -20.0 } else { narrow_house(p, z) }, |p| p.x < 4.0),
        yard(
            "webs",
            |p, z| {
                let edge = p.min(dvec2(100.0, 100.0) - p).min_element();
                let hangs = 4.0 + 2.0 * ((p.x + p.y) / 5.0).sin();
                if edge < hangs { 6.0 * (edge - hangs) } else { narrow_house(p, z) }
            },
            |p| p.min(dvec2(100.0, 100.0) - p).min_element() < 7.0,
        ),
    ]);
}

/// A town on a slope: blocks of four houses around a court that a shed fills in part, streets between them.
fn town(p: DVec2) -> f64 {
    let ground = 0.06 * p.x - 0.03 * p.y;
    let block = dvec2(p.x.rem_euclid(52.0), p.y.rem_euclid(44.0));
    let number = (p.x.div_euclid(52.0) + 3.0 * p.y.div_euclid(44.0)).rem_euclid(5.0);
    let is_court = inside(block, [20.0, 18.0, 12.0, 8.0]);
    let is_shed = inside(block, [20.0, 18.0, 6.0, 8.0]);
    match inside(block, [10.0, 8.0, 32.0, 28.0]) {
        true if is_shed => ground + 3.4,
        true if !is_court => ground + 7.0 + number,
        _ => ground,
    }
}

/// Footprint area, mean corner and attributes of each building of a square of the town.
fn town_buildings(corner: DVec2, size: f64) -> Vec<(DVec2, f64, f64)> {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, out) = (folder.path().join("mesh.off"), folder.path().join("out"));
    write_field(&mesh, corner, size, town);
    let arguments = ["run", mesh.to_str().unwrap(), "--out", out.to_str().unwrap(), "--quiet"];
    let _ = run_gable(&[&arguments[..], &["--set", "output.report=false"]].concat()).success();
    let city = read_city(&out.join("city.city.jsonl"), None);
    let origin = DVec3::from(city.origin).truncate();
    let prints = footprints(&city);
    let mut buildings = Vec::new();
    for building in &city.buildings {
        let Some(print) = prints.get(&building.id) else { continue };
        let area = print.iter().map(gable_geometry::Polygon::area).sum();
        let corners: Vec<DVec2> = print.iter().flat_map(|polygon| polygon.outer.iter().copied()).collect();
        let middle = corners.iter().sum::<DVec2>() / corners.len() as f64 + origin;
        let Some(gable_city_model::Value::Number(cut)) = building.attributes.get("cut_share") else {
            panic!("{} does not say whether the rim cuts it", building.id)
        };
        buildings.push((middle, area, *cut));
    }
    buildings
}

#[test]
fn a_crop_has_the_buildings_of_the_whole_away_from_its_rim() {
    let whole = town_buildings(DVec2::ZERO, 260.0);
    let (corner, size) = (dvec2(95.0, 80.0), 150.0);
    let crop = town_buildings(corner, size);
    let is_inner = |p: DVec2| {
        let edge = (p - corner).min(corner + size - p).min_element();
        edge > 30.0
    };
    let mut inner = 0;
    for (middle, area, cut) in whole.iter().filter(|building| is_inner(building.0)) {
        inner += 1;
        let same = crop.iter().find(|other| other.0.distance(*middle) < 1.0 && (other.1 - area).abs() < 0.03 * area);
        let same =
            same.unwrap_or_else(|| panic!("the building of {area:.0} m² at {middle} is not in the crop: {crop:.1?}"));
        assert_eq!((*cut, same.2), (0.0, 0.0), "{middle} is cut by no rim");
    }
    assert!(inner >= 2, "{whole:?}");
    // At the rim of the crop the buildings are cut, and say so.
    let at_rim = crop.iter().filter(|(_, area, cut)| *area > 100.0 && *cut > 0.05).count();
    assert!(at_rim >= 3, "{crop:?}");
}
