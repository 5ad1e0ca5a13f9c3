use super::*;
use crate::trace_outline;
use gable_geometry::{Counter, Polygon, dvec2, ring_area};
use gable_raster::{GridWindow, Raster};
use proptest::prelude::*;

/// The mask of a polygon, with its boundary moved in and out by smooth noise and its corners rounded.
fn mask(polygon: &Polygon, rounding: f64, noise: f64, seed: u64) -> Raster<bool> {
    let window = GridWindow::covering(polygon.bounds().grown(2.0), 0.2);
    let mut rng = Counter::new(seed);
    let waves: Vec<_> = (0..60)
        .map(|_| {
            let direction = DVec2::from_angle(rng.range(0.0, 6.3)) * std::f64::consts::TAU / rng.range(2.0, 6.0);
            (direction, rng.range(0.0, 6.3))
        })
        .collect();
    let shift = |p: DVec2| {
        let sum: f64 = waves.iter().map(|(k, phase)| (k.dot(p) + phase).sin()).sum();
        noise * sum * (2.0 / waves.len() as f64).sqrt()
    };
    // Rounding convex corners: at least a share of a small disc has to be inside.
    let disc: Vec<_> = (-6i32..=6)
        .flat_map(|x| (-6i32..=6).map(move |y| dvec2(f64::from(x), f64::from(y)) / 6.0))
        .filter(|d| d.length() <= 1.0)
        .collect();
    let inside = |p: DVec2| {
        let signed = if polygon.contains(p) { 1.0 } else { -1.0 } * polygon.boundary_distance(p);
        if rounding == 0.0 || signed.abs() > 2.0 * rounding + 4.0 * noise {
            return signed + shift(p) > 0.0;
        }
        // Noise moves the point along the gradient of the distance; close enough here.
        let count = disc.iter().filter(|&&d| polygon.contains(p + d * rounding)).count() as f64 / disc.len() as f64;
        (count - 0.5) * 1.57 * rounding + shift(p) > 0.0
    };
    let values = (0..window.len()).map(|i| inside(window.centre(i % window.width, i / window.width))).collect();
    Raster::new(window, values)
}

fn turned(points: &[(f64, f64)], angle: f64) -> Polygon {
    let turn = DVec2::from_angle(angle);
    Polygon {
        outer: points.iter().map(|&(x, y)| turn.rotate(dvec2(x, y)) + dvec2(103.3, -51.7)).collect(),
        holes: vec![],
    }
}

fn fitted(mask: &Raster<bool>) -> Vec<LineSegment> {
    let mut rings = trace_outline(mask);
    rings.sort_by(|a, b| b.area().total_cmp(&a.area()));
    fit_polyline(&rings[0].middles(), &PolylineParams::default())
}

/// Largest distance from a corner of the polygon to the nearest corner of the chain.
fn worst_corner(polygon: &Polygon, chain: &[LineSegment]) -> f64 {
    let nearest = |p: &DVec2| chain.iter().map(|s| s.a.distance(*p)).fold(f64::INFINITY, f64::min);
    polygon.outer.iter().map(nearest).fold(0.0, f64::max)
}

fn assert_closed(chain: &[LineSegment]) {
    for i in 0..chain.len() {
        assert!(chain[i].b.distance(chain[(i + 1) % chain.len()].a) < 1e-9);
    }
}

const L_SHAPE: [(f64, f64); 6] = [(0.0, 0.0), (14.0, 0.0), (14.0, 6.0), (7.0, 6.0), (7.0, 12.0), (0.0, 12.0)];

#[test]
fn sharp_corners_come_back_at_any_angle() {
    for angle in [0.0, 0.1, 0.3, 0.5, 0.785, 1.2, 1.5] {
        let polygon = turned(&L_SHAPE, angle);
        let mask = mask(&polygon, 0.0, 0.0, 1);
        let chain = fitted(&mask);
        assert_closed(&chain);
        assert_eq!(chain.len(), 6, "at {angle}");
        // A pixel lattice hides up to half a pixel along each axis.
        assert!(worst_corner(&polygon, &chain) < 0.15, "{} at {angle}", worst_corner(&polygon, &chain));
        let area = ring_area(&chain.iter().map(|s| s.a).collect::<Vec<_>>());
        let pixels = mask.values().iter().filter(|&&m| m).count() as f64 * 0.04;
        assert!((area - pixels).abs() < 0.3, "{area} is not {pixels} at {angle}");
    }
}

#[test]
fn rounded_corners_and_noise_leave_the_polygon() {
    let mut worst: f64 = 0.0;
    for seed in 0..8 {
        let polygon = turned(&L_SHAPE, 0.2 * seed as f64);
        let chain = fitted(&mask(&polygon, 0.5, 0.08, seed));
        assert_eq!(chain.len(), 6, "seed {seed}");
        worst = worst.max(worst_corner(&polygon, &chain));
    }
    assert!(worst < 0.4, "{worst}");
}

#[test]
fn a_step_in_a_wall_is_kept_and_a_ripple_is_not() {
    let step =
        |depth: f64| turned(&[(0.0, 0.0), (10.0, 0.0), (10.0, depth), (20.0, depth), (20.0, 9.0), (0.0, 9.0)], 0.4);
    assert_eq!(fitted(&mask(&step(0.8), 0.0, 0.0, 3)).len(), 6);
    assert_eq!(fitted(&mask(&step(0.15), 0.0, 0.0, 3)).len(), 4);
}

#[test]
fn a_round_tower_becomes_a_smooth_chain() {
    let circle: Vec<_> = (0..180)
        .map(|i| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 180.0).sin_cos();
            (6.0 * c, 6.0 * s)
        })
        .collect();
    let polygon = turned(&circle, 0.0);
    let chain = fitted(&mask(&polygon, 0.0, 0.0, 1));
    assert_closed(&chain);
    assert!((8..=16).contains(&chain.len()), "{}", chain.len());
    for i in 0..chain.len() {
        let turn = chain[i].direction().angle_to(chain[(i + 1) % chain.len()].direction());
        assert!((0.15..1.0).contains(&turn), "no zig-zag, but {turn}");
        assert!(polygon.boundary_distance(chain[i].middle()) < 0.35);
    }
}

#[test]
fn degenerate_contours_are_empty_or_small() {
    let params = PolylineParams::default();
    assert!(fit_polyline(&[], &params).is_empty());
    assert!(fit_polyline(&[DVec2::ZERO; 9], &params).is_empty());
    let flat: Vec<_> = (0..9).map(|i| dvec2(f64::from(i), 0.0)).collect();
    assert!(fit_polyline(&flat, &params).len() <= 2);
    let mut one = Raster::filled(GridWindow { step: 0.2, x0: 0, y0: 0, width: 3, height: 3 }, false);
    one[(1, 1)] = true;
    assert!(fitted(&one).len() <= 4);
}

/// Plain dynamic programme over all cuts, without pruning.
fn cheapest(points: &[DVec2], params: &PolylineParams) -> f64 {
    let prefix = Prefix::new(points);
    let scale = 1.0 / (params.tolerance * params.tolerance * params.correlation);
    let mut best = vec![0.0f64; points.len() + 1];
    for to in 1..=points.len() {
        let cost = |from: usize| best[from] + scale * prefix.residual(from, to) + params.segment_cost;
        best[to] = (0..to).map(cost).fold(f64::INFINITY, f64::min);
    }
    best[points.len()]
}

proptest! {
    #[test]
    fn pruning_loses_nothing(steps in prop::collection::vec((-0.3..0.5f64, -0.3..0.3f64), 5..60)) {
        let mut p = DVec2::ZERO;
        let points: Vec<_> = steps.iter().map(|&(x, y)| { p += dvec2(x, y); p }).collect();
        let params = PolylineParams::default();
        let prefix = Prefix::new(&points);
        let scale = 1.0 / (params.tolerance * params.tolerance * params.correlation);
        let cuts = cut(&points, &params);
        let cost: f64 = (0..cuts.len())
            .map(|i| {
                let to = cuts.get(i + 1).copied().unwrap_or(points.len());
                scale * prefix.residual(cuts[i], to) + params.segment_cost
            })
            .sum();
        let best = cheapest(&points, &params);
        prop_assert!((cost - best).abs() < 1e-6 * best.max(1.0), "{} is not {}", cost, best);
        // The residual is that of the best of many directions.
        let n = points.len();
        let steps: Vec<_> = (0..n).map(|k| (points[k], points[(k + 1) % n])).collect();
        let steps: Vec<_> = steps.iter().map(|(p, q)| (0.5 * (*p + *q), p.distance(*q))).collect();
        let total: f64 = steps.iter().map(|s| s.1).sum();
        let across = |i: i32| {
            let normal = DVec2::from_angle(f64::from(i) * std::f64::consts::PI / 720.0);
            let mean = steps.iter().map(|s| s.1 * normal.dot(s.0)).sum::<f64>() / total;
            steps.iter().map(|s| s.1 * (normal.dot(s.0) - mean).powi(2)).sum::<f64>()
        };
        let least = (0..720).map(across).fold(f64::INFINITY, f64::min);
        let residual = prefix.residual(0, n);
        prop_assert!(residual <= least + 1e-9 && residual >= least * 0.98 - 2e-3);
    }
}

proptest! {
    #[test]
    fn chains_of_ragged_masks_are_closed_and_near(bits in prop::collection::vec(0..5u8, 300)) {
        let window = GridWindow { step: 0.3, x0: -3, y0: 4, width: 20, height: 15 };
        for ring in trace_outline(&Raster::new(window, bits.iter().map(|&b| b > 0).collect())) {
            let middles = ring.middles();
            let chain = fit_polyline(&middles, &PolylineParams::default());
            assert_closed(&chain);
            for s in &chain {
                prop_assert!(s.a.is_finite() && s.length() > 0.0 && s.weight > 0.0);
                let near = middles.iter().map(|m| m.distance(s.a)).fold(f64::INFINITY, f64::min);
                prop_assert!(near < 2.5, "{} from the contour", near);
            }
        }
    }
}
