//! Time to build arrangements of the sizes that buildings have.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use gable_arrangement::{Arrangement, Options};
use gable_geometry::{Counter, DVec2, dvec2};
use std::hint::black_box;

/// Short segments in a box whose side grows with their number, as the walls of a large building do.
fn walls(n: usize) -> Vec<(DVec2, DVec2)> {
    let mut rng = Counter::new(n as u64);
    let side = 4.0 * (n as f64).sqrt();
    let mut out = Vec::new();
    for _ in 0..n {
        let a = dvec2(rng.range(0.0, side), rng.range(0.0, side));
        out.push((a, a + DVec2::from_angle(rng.range(0.0, 6.3)) * rng.range(2.0, 16.0)));
    }
    out
}

fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("arrangement");
    for n in [30, 300, 5000] {
        let segments = walls(n);
        group.bench_with_input(BenchmarkId::new("build", n), &segments, |b, s| {
            b.iter(|| Arrangement::build(black_box(s), &Options::default()));
        });
        let arrangement = Arrangement::build(&segments, &Options::default());
        let side = (4.0 * (n as f64).sqrt() / 0.2) as usize;
        group.bench_function(BenchmarkId::new("face_raster", n), |b| {
            b.iter(|| black_box(&arrangement).face_raster(0, 0, side, side, 0.2));
        });
    }
    group.finish();
}

criterion_group!(benches, build);
criterion_main!(benches);
