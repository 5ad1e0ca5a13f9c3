//! Whole buildings, from noisy rasters to valid solids.

use crate::{BuildingInput, BuildingModel, ModelParams, PlanesFirst, Reconstruction as _, model};
use gable_city_model::{Semantic, validate_solid};
use gable_geometry::{Counter, DVec2, dvec2};
use gable_ortho::WallEvidence;
use gable_parameters::Settings;
use gable_raster::{GridWindow, Raster};

const STEP: f64 = 0.2;

/// A building given by its roof height at each place (`None` outside), with rounded corners and correlated noise, on
/// ground at height 0. Axes are turned by 20° so that nothing is aligned with the pixels.
fn building(seed: u64, size: f64, roof: impl Fn(DVec2) -> Option<f64>) -> BuildingInput {
    let half = size * 0.75 + 4.0;
    let n = (2.0 * half / STEP) as usize;
    let window = GridWindow { step: STEP, x0: -(n as i64) / 2, y0: -(n as i64) / 2, width: n, height: n };
    let turn = DVec2::from_angle(-20f64.to_radians());
    let mut rng = Counter::new(seed);
    let coarse: Vec<f64> = (0..64 * 64).map(|_| rng.normal()).collect();
    let noise = |p: DVec2| {
        let u = p / 1.5 + 30.0;
        let (x, y) = (u.x.floor(), u.y.floor());
        let (fx, fy) = (u.x - x, u.y - y);
        let at = |dx: usize, dy: usize| coarse[(y as usize + dy) % 64 * 64 + (x as usize + dx) % 64];
        let low = at(0, 0) * (1.0 - fx) + at(1, 0) * fx;
        let high = at(0, 1) * (1.0 - fx) + at(1, 1) * fx;
        0.1 * (low * (1.0 - fy) + high * fy)
    };
    let sharp = |p: DVec2| roof(turn.rotate(p)).unwrap_or(0.0);
    // Corners are rounded by averaging over a disc of 0.3 m.
    let blurred = |p: DVec2| {
        let mut sum = 0.0;
        for i in 0..16 {
            let r = 0.3 * ((f64::from(i) + 0.5) / 16.0).sqrt();
            sum += sharp(p + r * DVec2::from_angle(2.399_963 * f64::from(i)));
        }
        sum / 16.0
    };
    let centres: Vec<DVec2> = (0..n * n).map(|i| window.centre(i % n, i / n)).collect();
    let height = Raster::new(window, centres.iter().map(|&p| (blurred(p) + noise(p)) as f32).collect());
    let mask = height.map(|&z| z > 2.0);
    BuildingInput {
        mask,
        crowns: Raster::filled(window, false),
        terrain: Raster::filled(window, 0.0),
        normal: Raster::filled(window, [0.0, 0.0, 1.0]),
        colour: None,
        walls: Raster::filled(window, WallEvidence::default()),
        height,
        roof: None,
        facets: Vec::new(),
    }
}

fn in_box(p: DVec2, w: f64, h: f64) -> bool {
    p.x.abs() <= w / 2.0 && p.y.abs() <= h / 2.0
}

fn made(input: &BuildingInput) -> BuildingModel {
    let mut models = model(input, &PlanesFirst, &Settings::default(), &ModelParams::default()).unwrap();
    assert_eq!(models.len(), 1);
    let model = models.remove(0);
    assert_eq!(model.reason, None);
    for shell in model.lods.lod2.iter().chain(&model.lods.lod1) {
        assert!(validate_solid(shell, &ModelParams::default().tolerances).is_empty());
    }
    model
}

fn count(model: &BuildingModel, semantic: Semantic) -> usize {
    model.lods.lod2.iter().flat_map(|s| &s.faces).filter(|f| f.semantic == semantic).count()
}

/// Share of the union of footprint and truth that both cover.
fn iou(model: &BuildingModel, truth: impl Fn(DVec2) -> bool) -> f64 {
    let turn = DVec2::from_angle(-20f64.to_radians());
    let (mut both, mut either) = (0, 0);
    for i in 0..400 * 400 {
        let p = dvec2(f64::from(i % 400) - 200.0, f64::from(i / 400) - 200.0) * 0.1;
        let found = model.roofs.iter().any(|r| r.0.contains(p));
        let real = truth(turn.rotate(p));
        both += i32::from(found && real);
        either += i32::from(found || real);
    }
    f64::from(both) / f64::from(either)
}

#[test]
fn a_gable_house() {
    for seed in 0..3 {
        let roof = |p: DVec2| in_box(p, 12.0, 8.0).then(|| 8.0 - 0.8 * p.y.abs());
        let model = made(&building(seed, 12.0, roof));
        assert_eq!(count(&model, Semantic::RoofSurface), 2, "seed {seed}");
        assert_eq!(count(&model, Semantic::WallSurface), 4, "seed {seed}");
        let iou = iou(&model, |p| in_box(p, 12.0, 8.0));
        assert!(iou > 0.96, "seed {seed}: {iou}");
        assert!(model.rmse < 0.15, "seed {seed}: {}", model.rmse);
    }
}

#[test]
fn a_flat_house_and_its_lower_annexe() {
    let roof = |p: DVec2| {
        let annexe = in_box(p - dvec2(7.0, -1.0), 4.0, 5.0).then_some(3.5);
        in_box(p, 10.0, 9.0).then_some(7.0).or(annexe)
    };
    let model = made(&building(7, 18.0, roof));
    assert_eq!(count(&model, Semantic::RoofSurface), 2);
    // The annexe parts the eastern wall of the house in two, and the step above it is a third.
    assert_eq!(count(&model, Semantic::WallSurface), 9);
    assert!(iou(&model, |p| roof(p).is_some()) > 0.95);
}

#[test]
fn a_slim_tower_stays_and_a_low_stack_goes() {
    let turn = DVec2::from_angle(-20f64.to_radians());
    // A stack in a corner of the roof, turned against it.
    let with = |rise: f32, side: f64, degrees: f64| {
        let mut input = building(6, 14.0, |p| in_box(p, 12.0, 8.0).then_some(7.0));
        let window = input.window();
        let askew = DVec2::from_angle(degrees.to_radians());
        for (p, z) in input.height.values_mut().iter_mut().enumerate() {
            let at = turn.rotate(window.centre(p % window.width, p / window.width));
            let place = askew.rotate(at - dvec2(5.0, 3.0)).abs();
            // Its edges are rounded by a pixel.
            *z += rise * ((side / 2.0 - place.max_element()) / 0.2).clamp(0.0, 1.0) as f32;
        }
        made(&input)
    };
    for (side, degrees) in [(2.2, 0.0), (2.2, 25.0)] {
        let tower = with(9.0, side, degrees);
        let top = tower.roofs.iter().find(|(_, plane)| plane.c > 12.0).expect("the tower has a roof of its own");
        assert!((2.0..5.5).contains(&top.0.area()), "{}", top.0.area());
        assert!((tower.height - 16.0).abs() < 0.5, "{}", tower.height);
    }
    assert_eq!(count(&with(1.5, 2.2, 0.0), Semantic::RoofSurface), 1);
}

#[test]
fn a_hipped_house() {
    let roof = |p: DVec2| in_box(p, 14.0, 8.0).then(|| 4.0 + 0.7 * f64::min(4.0 - p.y.abs(), 7.0 - p.x.abs()));
    let model = made(&building(11, 14.0, roof));
    assert_eq!(count(&model, Semantic::RoofSurface), 4);
    assert_eq!(count(&model, Semantic::WallSurface), 4);
}

#[test]
fn a_courtyard() {
    let roof = |p: DVec2| (in_box(p, 18.0, 16.0) && !in_box(p, 7.0, 6.0)).then_some(9.0);
    let model = made(&building(13, 18.0, roof));
    assert_eq!(count(&model, Semantic::RoofSurface), 1);
    assert_eq!(count(&model, Semantic::WallSurface), 8);
    assert!(iou(&model, |p| roof(p).is_some()) > 0.94);
}

// A crown of a radius over a place of a building, higher than its roof.
fn with_crown(mut input: BuildingInput, at: DVec2, radius: f64) -> BuildingInput {
    let (window, turn) = (input.window(), DVec2::from_angle(20f64.to_radians()));
    for p in 0..window.len() {
        let pixel = window.centre(p % window.width, p / window.width);
        let from = pixel.distance(turn.rotate(at));
        if from < radius {
            input.mask.values_mut()[p] = false;
            input.crowns.values_mut()[p] = true;
            input.height.values_mut()[p] = 9.0 - (0.3 * from) as f32;
        }
    }
    input
}

#[test]
fn a_house_goes_on_under_trees() {
    // Size of the house, and the crowns: their places and radii.
    let cases: [(DVec2, &[(DVec2, f64)]); 5] = [
        // Over a corner, and over the middle of a wall.
        (dvec2(14.0, 9.0), &[(dvec2(6.5, 4.5), 3.0)]),
        (dvec2(14.0, 9.0), &[(dvec2(0.0, 5.5), 2.5)]),
        // Ten metres of a wall, and as much from a corner.
        (dvec2(26.0, 10.0), &[(dvec2(0.0, 6.5), 5.3)]),
        (dvec2(26.0, 10.0), &[(dvec2(8.0, 6.5), 5.6)]),
        // Two crowns over one corner, with a metre and a half of a round outline between them.
        (dvec2(26.0, 10.0), &[(dvec2(7.5, 6.0), 3.2), (dvec2(13.0, 1.5), 3.2)]),
    ];
    for (size, crowns) in cases {
        let house = |p: DVec2| in_box(p, size.x, size.y);
        let whole = building(1, size.x, |p| house(p).then(|| 8.0 - 0.6 * p.y.abs()));
        let hidden = crowns.iter().fold(whole, |input, &(at, radius)| with_crown(input, at, radius));
        let model = made(&hidden);
        let iou = iou(&model, house);
        assert!(iou > 0.96, "{crowns:?}: {iou}");
        assert_eq!(count(&model, Semantic::RoofSurface), 2, "{crowns:?}");
        assert_eq!(count(&model, Semantic::WallSurface), 4, "{crowns:?}");
        assert!(matches!(model.attributes["completeness"], gable_city_model::Value::Number(seen) if seen < 0.97));
    }
}

#[test]
fn a_hedge_hides_no_wall() {
    // A crown over a corner, and a hedge along all of the wall that goes on under it.
    let house = |p: DVec2| in_box(p, 14.0, 9.0);
    let mut seen = with_crown(building(1, 14.0, |p| house(p).then_some(6.0)), dvec2(6.5, 4.5), 3.0);
    let (window, turn) = (seen.window(), DVec2::from_angle(-20f64.to_radians()));
    for p in 0..window.len() {
        let at = turn.rotate(window.centre(p % window.width, p / window.width));
        if at.x.abs() < 7.5 && at.y > 4.5 && at.y < 5.3 && !seen.mask.values()[p] && !seen.crowns.values()[p] {
            seen.crowns.values_mut()[p] = true;
            seen.height.values_mut()[p] = 1.5;
        }
    }
    let model = made(&seen);
    assert!(iou(&model, house) > 0.96, "{}", iou(&model, house));
    assert_eq!(count(&model, Semantic::WallSurface), 4);
}

/// What is added under a crown, in the frame of the building.
fn added(seen: &BuildingInput) -> Vec<DVec2> {
    let Some(whole) = PlanesFirst.completed(seen) else { return Vec::new() };
    let (window, turn) = (seen.window(), DVec2::from_angle(-20f64.to_radians()));
    (0..window.len())
        .filter(|&p| whole.mask.values()[p] && !seen.mask.values()[p])
        .map(|p| turn.rotate(window.centre(p % window.width, p / window.width)))
        .collect()
}

#[test]
fn a_house_goes_on_as_far_as_it_is_seen() {
    // Behind it, the other half of the house stands further out: as far as the inner wall all is the house's.
    let stepped = |p: DVec2| in_box(p, 26.0, 10.0) || (p.x > 0.0 && in_box(p, 26.0, 13.0));
    let roof = |p: DVec2| stepped(p).then_some(6.0);
    let seen = with_crown(building(2, 26.0, roof), dvec2(0.0, 6.0), 4.0);
    let before = seen.mask.values().iter().filter(|&&m| m).count();
    let inner = added(&seen);
    assert!(inner.len() > before / 20 && inner.iter().all(|p| p.y < 5.3), "{}", inner.len());
    // Both corners of a side are hidden: it is square, but no longer than what is seen of its walls.
    let roof = |p: DVec2| in_box(p, 14.0, 9.0).then_some(6.0);
    let square = added(&with_crown(building(1, 14.0, roof), dvec2(8.0, 0.0), 5.5));
    assert!(square.len() > 200 && square.iter().all(|p| p.x < 5.6 && p.y.abs() < 4.8), "{}", square.len());
    assert!(square.iter().any(|p| p.x > 4.0 && p.y.abs() < 0.2));
    // A yard with a tree in it.
    let yard = |p: DVec2| (in_box(p, 26.0, 14.0) && !(p.x.abs() < 4.0 && p.y > -2.0)).then_some(6.0);
    assert!(PlanesFirst.completed(&with_crown(building(3, 26.0, yard), dvec2(0.0, 2.5), 5.6)).is_none());
}

#[test]
fn nothing_is_made_up_under_a_tree() {
    let house = |p: DVec2| in_box(p, 14.0, 9.0);
    let roof = |p: DVec2| house(p).then(|| 8.0 - 0.6 * p.y.abs());
    let whole = building(1, 14.0, roof);
    // A tree in the corner of an L, and one that only touches a wall.
    let l = |p: DVec2| (house(p) && !(p.x > 0.0 && p.y > 0.0)).then_some(6.0);
    assert!(PlanesFirst.completed(&with_crown(building(2, 14.0, l), dvec2(2.5, 2.5), 3.0)).is_none());
    assert!(PlanesFirst.completed(&with_crown(whole, dvec2(0.0, 7.5), 2.9)).is_none());
}

/// The input as the pipeline cuts it out: the box of the mask with so many metres around it.
fn cut_out(input: &BuildingInput, reach: f64) -> BuildingInput {
    let window = input.window();
    let inside = input.mask.values().iter().enumerate().filter(|(_, inside)| **inside);
    let (mut columns, mut rows) = ((usize::MAX, 0), (usize::MAX, 0));
    for (pixel, _) in inside {
        let (x, y) = (pixel % window.width, pixel / window.width);
        columns = (columns.0.min(x), columns.1.max(x));
        rows = (rows.0.min(y), rows.1.max(y));
    }
    let inner = GridWindow {
        x0: window.x0 + columns.0 as i64,
        y0: window.y0 + rows.0 as i64,
        width: columns.1 - columns.0 + 1,
        height: rows.1 - rows.0 + 1,
        ..window
    };
    let cut = inner.grown((reach / STEP).ceil() as usize);
    BuildingInput {
        mask: input.mask.crop(cut, false),
        crowns: input.crowns.crop(cut, false),
        height: input.height.crop(cut, 0.0),
        terrain: input.terrain.crop(cut, 0.0),
        normal: input.normal.crop(cut, [0.0, 0.0, 1.0]),
        colour: None,
        walls: input.walls.crop(cut, WallEvidence::default()),
        roof: None,
        facets: Vec::new(),
    }
}

#[test]
fn a_corner_under_a_crown_is_found_beyond_the_nearest_surroundings() {
    // Turned by 45° in all, a hidden corner reaches beyond the box of what is seen by 0.7 radii of the crown.
    let turn = DVec2::from_angle(-25f64.to_radians());
    let house = |p: DVec2| in_box(turn.rotate(p), 34.0, 34.0);
    let whole = building(4, 34.0, |p| house(p).then_some(8.0));
    let corner = DVec2::from_angle(25f64.to_radians()).rotate(dvec2(17.0, 17.0));
    let hidden = with_crown(whole, corner, 9.5);
    let area = |reach: f64| made(&cut_out(&hidden, reach)).area;
    let (near, far) = (area(crate::MARGIN), area(PlanesFirst.reach_under_crowns()));
    assert!((far - 1156.0).abs() < 8.0, "{far}");
    assert!(near < far - 4.0, "the nearest surroundings are too small: {near}");
}
