use super::*;
use gable_geometry::{Counter, DVec2, Polygon, dvec2};
use gable_raster::GridWindow;

fn window(width: usize, height: usize) -> GridWindow {
    GridWindow { step: 0.2, x0: -40, y0: 25, width, height }
}

/// A picture of polygons of different brightness, each pixel the mean over 4 × 4 points, with noise.
fn picture(window: GridWindow, shapes: &[(Polygon, f32)], noise: f64, seed: u64) -> Raster<f32> {
    let mut rng = Counter::new(seed);
    let mut raster = Raster::filled(window, 60.0);
    for y in 0..window.height {
        for x in 0..window.width {
            let mut sum = 0.0;
            for k in 0..16 {
                let p = window.centre(x, y) + (dvec2(f64::from(k % 4), f64::from(k / 4)) / 4.0 - 0.375) * window.step;
                sum += shapes.iter().rev().find(|s| s.0.contains(p)).map_or(60.0, |s| s.1);
            }
            raster[(x, y)] = sum / 16.0 + (noise * rng.normal()) as f32;
        }
    }
    raster
}

fn rectangle(centre: DVec2, size: DVec2, angle: f64) -> Polygon {
    let turn = DVec2::from_angle(angle);
    let corner = |x: f64, y: f64| centre + turn.rotate(dvec2(x, y) * size * 0.5);
    Polygon { outer: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], holes: vec![] }
}

/// The middle of the test windows of 160 × 140 pixels.
const MIDDLE: DVec2 = dvec2(8.0, 19.0);

#[test]
fn finds_the_sides_of_a_rectangle_between_the_pixels() {
    for (i, angle) in [0.0, 0.2, 0.5, 0.7, 1.1].into_iter().enumerate() {
        let shape = rectangle(MIDDLE, dvec2(18.0, 10.0), angle);
        let raster = picture(window(160, 140), &[(shape.clone(), 120.0)], 3.0, i as u64);
        let found = detect_segments(&raster, Source::Image, &LsdParams::image());
        for k in 0..4 {
            let (a, b) = (shape.outer[k], shape.outer[(k + 1) % 4]);
            let side = (b - a).normalize();
            // The brighter inside lies to the left of a counter-clockwise side.
            let on_side = |d: &&Detection| {
                d.segment.direction().dot(side) > 0.999
                    && [d.segment.a, d.segment.b].iter().all(|p| side.perp_dot(*p - a).abs() < 0.06)
            };
            let covered: f64 = found.iter().filter(on_side).map(|d| d.segment.length()).sum();
            assert!(covered > 0.85 * a.distance(b), "side {k} at {angle}: {covered} of {}", a.distance(b));
            let longest = found.iter().filter(on_side).max_by(|a, b| a.segment.length().total_cmp(&b.segment.length()));
            let contrast = longest.unwrap().contrast;
            assert!((contrast - 60.0).abs() < 12.0, "contrast {contrast}");
        }
        let total: f64 = found.iter().map(|d| d.segment.length()).sum();
        assert!(total < 58.0, "nothing but the sides: {total}");
    }
}

#[test]
fn noise_and_the_border_of_the_data_have_no_lines() {
    let mut rng = Counter::new(1);
    let window = window(300, 300);
    let noise = Raster::new(window, (0..window.len()).map(|_| 40.0 * rng.normal() as f32).collect());
    assert!(detect_segments(&noise, Source::Image, &LsdParams::image()).len() <= 1);
    let disc = |i: usize| window.centre(i % 300, i / 300).distance(window.centre(150, 150)) < 20.0;
    let torn = Raster::new(window, (0..window.len()).map(|i| if disc(i) { 90.0 } else { f32::NAN }).collect());
    assert!(detect_segments(&torn, Source::Image, &LsdParams::image()).is_empty());
    let tiny = Raster::filled(GridWindow { width: 1, height: 1, ..window }, 1.0);
    assert!(detect_segments(&tiny, Source::Image, &LsdParams::image()).is_empty());
}

#[test]
fn a_window_around_the_object_changes_nothing() {
    let shapes = [(rectangle(MIDDLE, dvec2(14.0, 8.0), 0.4), 140.0)];
    let large = picture(window(160, 140), &shapes, 0.0, 5);
    let small = large.crop(GridWindow { x0: -13, y0: 38, width: 111, height: 117, ..large.window() }, f32::NAN);
    let params = LsdParams::image();
    let (a, b) = (detect_segments(&large, Source::Image, &params), detect_segments(&small, Source::Image, &params));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert!(a.segment.a.distance(b.segment.a) < 1e-9 && a.segment.b.distance(b.segment.b) < 1e-9);
    }
}

#[test]
fn a_roof_is_no_step_but_its_eaves_are() {
    let house = rectangle(MIDDLE, dvec2(16.0, 10.0), 0.3);
    let axis = DVec2::from_angle(0.3).perp();
    let window = window(160, 140);
    let height = |i: usize| {
        let p = window.centre(i % 160, i / 160);
        // A roof of 45°, eaves at 3 m, on ground that slopes 10 %.
        let ground = 0.1 * p.x;
        (ground + if house.contains(p) { 8.0 - axis.dot(p - MIDDLE).abs() - ground } else { 0.0 }) as f32
    };
    let raster = Raster::new(window, (0..window.len()).map(height).collect());
    let found = detect_segments(&raster, Source::Height, &LsdParams::height(0.2));
    assert!((4..=8).contains(&found.len()), "{}", found.len());
    for d in &found {
        assert!(house.boundary_distance(d.segment.middle()) < 0.1, "{:?}", d.segment);
        assert!(house.contains(d.segment.middle() + 0.3 * d.segment.direction().perp()), "the house is to the left");
        assert!((2.0..8.0).contains(&d.contrast), "{}", d.contrast);
    }
}

/// Whether most of a segment lies along one of the others.
fn is_covered(a: DVec2, b: DVec2, others: &[(DVec2, DVec2)], distance: f64) -> bool {
    let along = (b - a).normalize();
    let close = |p: DVec2| {
        others.iter().any(|&(c, d)| {
            (d - c).normalize().perp_dot(along).abs() < 0.1
                && gable_geometry::point_segment_distance(p, c, d) < distance
        })
    };
    (0..=20).filter(|&i| close(a + (b - a) * (f64::from(i) / 20.0))).count() >= 15
}

#[test]
fn agrees_with_an_independent_implementation() {
    let mut rng = Counter::new(77);
    let window = GridWindow { step: 1.0, x0: 0, y0: 0, width: 400, height: 400 };
    let shapes: Vec<_> = (0..40)
        .map(|_| {
            let centre = dvec2(rng.range(20.0, 380.0), rng.range(20.0, 380.0));
            let size = dvec2(rng.range(20.0, 120.0), rng.range(10.0, 60.0));
            (rectangle(centre, size, rng.range(0.0, 3.1)), rng.range(20.0, 230.0) as f32)
        })
        .collect();
    let raster = picture(window, &shapes, 4.0, 6).map(|v| v.clamp(0.0, 255.0).round());
    for scale in [1.0, 0.8] {
        let params = LsdParams { scale, ..LsdParams::image() };
        let ours: Vec<_> =
            detect_segments(&raster, Source::Image, &params).iter().map(|d| (d.segment.a, d.segment.b)).collect();
        let theirs: Vec<_> = lsdetect::detect(raster.values(), 400, 400, scale)
            .unwrap()
            .iter()
            .map(|s| (dvec2(s.x1, s.y1), dvec2(s.x2, s.y2)))
            .collect();
        let share = |some: &[(DVec2, DVec2)], of: &[(DVec2, DVec2)]| {
            let long: Vec<_> = some.iter().filter(|s| s.0.distance(s.1) > 20.0).collect();
            assert!(long.len() > 40);
            long.iter().filter(|s| is_covered(s.0, s.1, of, 1.5)).count() as f64 / long.len() as f64
        };
        // At 0.8 theirs misses sides that are there; those count as right, too.
        let sides = shapes.iter().flat_map(|s| (0..4).map(|k| (s.0.outer[k], s.0.outer[(k + 1) % 4])));
        let right: Vec<_> = theirs.iter().copied().chain(sides).collect();
        let (recall, precision) = (share(&theirs, &ours), share(&ours, &right));
        assert!(recall > 0.95 && precision > 0.95, "recall {recall}, precision {precision} at scale {scale}");
    }
}
