//! Benchmarks of detection beside an independent LSD, and of outlines.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gable_geometry::{Counter, DVec2};
use gable_lines::{LineSegment, LsdParams, PolylineParams, Source, detect_segments, fit_polyline, trace_outline};
use gable_raster::{GridWindow, Raster};
use std::hint::black_box;

const SIZE: usize = 512;
const WINDOW: GridWindow = GridWindow { step: 0.2, x0: 0, y0: 0, width: SIZE, height: SIZE };

/// Turned rectangles of random brightness, with noise.
fn picture() -> Raster<f32> {
    let mut rng = Counter::new(3);
    let shapes: Vec<_> = (0..60)
        .map(|_| {
            let centre = DVec2::new(rng.range(0.0, 102.0), rng.range(0.0, 102.0));
            let axis = DVec2::from_angle(rng.range(0.0, 3.2));
            (centre, axis, rng.range(2.0, 10.0), rng.range(2.0, 6.0), rng.range(20.0, 230.0))
        })
        .collect();
    let value = |i: usize| {
        let p = WINDOW.centre(i % SIZE, i / SIZE);
        let inside = shapes.iter().find(|(c, axis, length, width, _)| {
            axis.dot(p - *c).abs() < *length && axis.perp_dot(p - *c).abs() < *width
        });
        (inside.map_or(90.0, |s| s.4) + 4.0 * rng.normal()).clamp(0.0, 255.0) as f32
    };
    Raster::new(WINDOW, (0..WINDOW.len()).map(value).collect())
}

fn benchmarks(c: &mut Criterion) {
    let raster = picture();
    let mut group = c.benchmark_group("lsd");
    group.throughput(Throughput::Elements(WINDOW.len() as u64)).sample_size(30);
    group.bench_function("gable", |b| {
        b.iter(|| detect_segments(black_box(&raster), Source::Image, &LsdParams::image()));
    });
    group.bench_function("lsdetect", |b| b.iter(|| lsdetect::detect(black_box(raster.values()), SIZE, SIZE, 0.8)));
    group.finish();

    let mask = raster.map(|&v| v > 120.0);
    let rings = trace_outline(&mask);
    let contours: Vec<_> = rings.iter().filter(|r| r.area().abs() > 4.0).map(gable_lines::Ring::middles).collect();
    let points: usize = contours.iter().map(Vec::len).sum();
    let mut group = c.benchmark_group("outline");
    group.throughput(Throughput::Elements(WINDOW.len() as u64)).sample_size(30);
    group.bench_function("trace", |b| b.iter(|| trace_outline(black_box(&mask))));
    group.throughput(Throughput::Elements(points as u64));
    group.bench_function("fit", |b| {
        b.iter(|| {
            contours.iter().flat_map(|c| fit_polyline(c, &PolylineParams::default())).collect::<Vec<LineSegment>>()
        });
    });
    group.finish();
}

criterion_group!(benches, benchmarks);
criterion_main!(benches);
