//! Benchmarks of the labelling by step: features, classifiers, terrain, and all of it.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gable_geometry::Counter;
use gable_parameters::Settings;
use gable_raster::{GridWindow, Raster};
use gable_segmentation::{
    CoarseHeights, FeatureSet, LABELLERS, LabelInput, Model, Orthograph, Terrain, for_each_feature,
};
use std::hint::black_box;

const SIZE: usize = 512;
const WINDOW: GridWindow = GridWindow { step: 0.2, x0: 0, y0: 0, width: SIZE, height: SIZE };

/// Hipped houses and round crowns on a slope of 5 %, with noise; roofs are red, crowns and some of the ground green.
fn town() -> (Raster<[u8; 3]>, Raster<f32>, Raster<[f32; 3]>) {
    let mut rng = Counter::new(7);
    let things: Vec<_> = (0..40)
        .map(|i| (rng.range(0.0, 102.0), rng.range(0.0, 102.0), rng.range(3.0, 8.0), rng.range(4.0, 9.0), i % 2 == 0))
        .collect();
    let (mut colour, mut height) = (Vec::with_capacity(WINDOW.len()), Vec::with_capacity(WINDOW.len()));
    for i in 0..WINDOW.len() {
        let p = WINDOW.centre(i % SIZE, i / SIZE);
        let ground = 0.05 * p.x;
        let (mut z, mut shade) = (ground, if p.y < 30.0 { [110, 140, 80] } else { [140, 138, 135] });
        for &(x, y, reach, tall, is_house) in &things {
            let (dx, dy) = ((p.x - x).abs(), (p.y - y).abs());
            let top = if is_house {
                (dx.max(dy) < reach).then(|| tall + 0.5 * (reach - dx.max(dy)))
            } else {
                let inside = reach * reach - dx * dx - dy * dy;
                (inside > 0.0).then(|| tall + 0.6 * inside.sqrt() + 0.4 * rng.normal())
            };
            if let Some(top) = top.filter(|top| ground + top > z) {
                (z, shade) = (ground + top, if is_house { [160, 80, 60] } else { [60, 95, 45] });
            }
        }
        height.push((z + 0.05 * rng.normal()) as f32);
        colour.push(shade.map(|c: u8| (f64::from(c) + 8.0 * rng.normal()).clamp(0.0, 255.0) as u8));
    }
    let height = Raster::new(WINDOW, height);
    let at = |x: usize, y: usize| height[(x.min(SIZE - 1), y.min(SIZE - 1))];
    let normal = (0..WINDOW.len()).map(|i| {
        let (x, y) = (i % SIZE, i / SIZE);
        let (dx, dy) = ((at(x + 1, y) - at(x, y)) / 0.2, (at(x, y + 1) - at(x, y)) / 0.2);
        let length = (dx * dx + dy * dy + 1.0).sqrt();
        [-dx / length, -dy / length, 1.0 / length]
    });
    let normal = Raster::new(WINDOW, normal.collect());
    (Raster::new(WINDOW, colour), height, normal)
}

fn benchmarks(c: &mut Criterion) {
    let (colour, height, normal) = town();
    let input = Orthograph { colour: Some(&colour), height: &height, normal: &normal };
    let model = Model::shipped(FeatureSet::Full);
    let ground = || {
        let mut coarse = CoarseHeights::new(CoarseHeights::CELL);
        coarse.accumulate(&height);
        Terrain::from_coarse(&coarse).unwrap().raster(WINDOW)
    };
    let terrain = ground();

    let mut group = c.benchmark_group("segmentation");
    group.throughput(Throughput::Elements(WINDOW.len() as u64)).sample_size(10);
    for set in [FeatureSet::Zhu27, FeatureSet::Full, FeatureSet::Geometric] {
        group.bench_function(format!("features {}", set.name()), |b| {
            b.iter(|| {
                for_each_feature(black_box(&input), set, |_, values| {
                    black_box(values);
                })
            });
        });
    }
    group.bench_function("terrain", |b| b.iter(ground));
    group.bench_function("features and classifiers", |b| b.iter(|| model.probability(black_box(&input))));
    let whole = LabelInput { maps: input, terrain: &terrain, classifier: &model, noise: 1.0, min_area: 8.0 };
    for method in LABELLERS {
        group.bench_function(format!("all of it by {}", method.name()), |b| {
            b.iter(|| method.label(black_box(&whole), &Settings::default()));
        });
    }
    group.finish();
}

criterion_group!(benches, benchmarks);
criterion_main!(benches);
