//! Benchmarks of sampling, cleaning and the file, on a dense block with steps and one large texture.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gable_blocks::{BlockMesh, BlockTriangle, UNITS_PER_METRE};
use gable_geometry::Counter;
use gable_ortho::{CleanParams, Orthograph, SampleParams, Texture, TextureSource, clean, sample};
use gable_raster::GridWindow;
use std::hint::black_box;
use std::sync::Arc;

struct OneTexture(Arc<Texture>);

impl TextureSource for OneTexture {
    fn texture(&self, _material: u32) -> Option<Arc<Texture>> {
        Some(self.0.clone())
    }

    fn colour(&self, _material: u32) -> [u8; 3] {
        [128; 3]
    }
}

/// Cells along an edge of the block.
const CELLS: usize = 210;
/// Edge of the block, metres: 7.4 faces per m².
const EDGE: f64 = 109.0;

fn block() -> BlockMesh {
    let mut rng = Counter::new(1);
    let heights: Vec<f64> = (0..(CELLS + 1) * (CELLS + 1))
        .map(|i| {
            let (x, y) = (i % (CELLS + 1), i / (CELLS + 1));
            let roof = if (x / 20 + y / 24) % 2 == 0 { 8.0 } else { 0.0 };
            roof + 0.1 * rng.normal()
        })
        .collect();
    let corner = |(x, y): (usize, usize)| {
        let cell = EDGE / CELLS as f64;
        let p = [x as f64 * cell, y as f64 * cell, heights[y * (CELLS + 1) + x]];
        p.map(|v| (v * UNITS_PER_METRE).round() as i32)
    };
    let uv = |(x, y): (usize, usize)| [x as f32 / CELLS as f32, y as f32 / CELLS as f32];
    let triangle = |c: [(usize, usize); 3]| BlockTriangle {
        corners: c.map(corner),
        uv: c.map(uv),
        material: 0,
        ..Default::default()
    };
    let cells = (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| (x, y)));
    let triangles = cells.flat_map(|(x, y)| {
        [triangle([(x, y), (x + 1, y), (x + 1, y + 1)]), triangle([(x, y), (x + 1, y + 1), (x, y + 1)])]
    });
    BlockMesh { triangles: triangles.collect() }
}

fn texture() -> OneTexture {
    let mut rng = Counter::new(2);
    let texels = (0..2048 * 2048).map(|_| std::array::from_fn(|_| rng.bits() as u8)).collect();
    OneTexture(Arc::new(Texture::new(2048, 2048, texels).expect("the texels are as many as they should be")))
}

fn benchmarks(c: &mut Criterion) {
    let (mesh, texture) = (block(), texture());
    let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 545, height: 545 };
    let sampled = sample(&mesh, window, &texture, &SampleParams::default());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("block.ortho");
    sampled.write(&path).expect("room for the file");
    let mut group = c.benchmark_group("ortho");
    group.throughput(Throughput::Elements(window.len() as u64)).sample_size(20);
    group.bench_function("sample", |b| {
        b.iter(|| sample(black_box(&mesh), window, &texture, &SampleParams::default()));
    });
    group.bench_function("clean", |b| {
        b.iter_batched_ref(|| sampled.clone(), |o| clean(o, &CleanParams::default()), criterion::BatchSize::LargeInput);
    });
    group.bench_function("write", |b| b.iter(|| sampled.write(&path)));
    group.bench_function("read", |b| b.iter(|| Orthograph::read(&path)));
    group.finish();
}

criterion_group!(benches, benchmarks);
criterion_main!(benches);
