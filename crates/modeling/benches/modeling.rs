//! Benchmarks of one building from rasters to valid solids, by method and size.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gable_geometry::Counter;
use gable_modeling::{BuildingInput, METHODS, ModelParams, model};
use gable_ortho::WallEvidence;
use gable_parameters::Settings;
use gable_raster::{GridWindow, Raster};
use std::hint::black_box;

/// A block of `houses` gabled houses in a row, eaves at different heights, turned by nothing and with noise.
fn block(houses: usize) -> BuildingInput {
    let (width, depth) = (9.0 * houses as f64, 12.0);
    let (columns, rows) = (((width + 8.0) / 0.2) as usize, ((depth + 8.0) / 0.2) as usize);
    let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: columns, height: rows };
    let mut rng = Counter::new(5);
    let eaves: Vec<f64> = (0..houses).map(|_| rng.range(5.0, 8.0)).collect();
    let roof = |i: usize| {
        let p = window.centre(i % columns, i / columns) - gable_geometry::dvec2(4.0, 4.0);
        let inside = p.x >= 0.0 && p.x < width && p.y >= 0.0 && p.y < depth;
        inside.then(|| {
            let rises = p.y < depth / 2.0;
            let run = if rises { p.y } else { depth - p.y };
            (eaves[(p.x / 9.0) as usize] + 0.7 * run, if rises { -1.0 } else { 1.0 })
        })
    };
    let (mut height, mut normal) = (Vec::with_capacity(window.len()), Vec::with_capacity(window.len()));
    for i in 0..window.len() {
        let (z, n) = roof(i).map_or((0.0, [0.0, 0.0, 1.0]), |(z, side)| {
            let length = 1.0_f64.hypot(0.7);
            (z, [0.0, (side * 0.7 / length) as f32, (1.0 / length) as f32])
        });
        height.push((z + 0.05 * rng.normal()) as f32);
        normal.push(n);
    }
    let height = Raster::new(window, height);
    BuildingInput {
        mask: height.map(|&z| z > 2.0),
        crowns: height.map(|_| false),
        height,
        terrain: Raster::filled(window, 0.0),
        normal: Raster::new(window, normal),
        colour: None,
        walls: Raster::filled(window, WallEvidence::default()),
        roof: None,
        facets: Vec::new(),
    }
}

fn benchmarks(c: &mut Criterion) {
    let mut group = c.benchmark_group("modelling");
    group.sample_size(10);
    for houses in [1, 10] {
        let input = block(houses);
        group.throughput(Throughput::Elements(input.window().len() as u64));
        for method in METHODS {
            let name = method.name();
            let (settings, params) = (Settings::default(), ModelParams::default());
            assert!(model(&input, method, &settings, &params).is_ok(), "{name}: {houses} houses");
            group.bench_function(format!("{name}, houses: {houses}"), |b| {
                b.iter(|| model(black_box(&input), method, &settings, &params));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, benchmarks);
criterion_main!(benches);
