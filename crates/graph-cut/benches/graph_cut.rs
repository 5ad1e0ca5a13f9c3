//! Maximum flow where every pixel is in doubt, α-expansion and swap of a made scene with four labels, and a general graph.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gable_graph_cut::{
    FlowGraph, GraphProblem, GridCapacities, Options, data_optimum, expand, expand_grid, max_flow_grid, swap_grid,
};
use std::hint::black_box;

#[path = "../tests/scene/mod.rs"]
mod scene;

/// Coin tosses with a faint pattern and a strong smoothness: every pixel is in doubt. Terminals, right and up.
fn coin_tosses(width: usize, height: usize) -> (Vec<i32>, Vec<i32>, Vec<i32>) {
    let mut state = 9_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 40) & 0xffff) as i32
    };
    let pattern = |x: usize, y: usize| if (x / 40 + y / 40).is_multiple_of(2) { 8000 } else { -8000 };
    let terminal = (0..width * height).map(|p| next() - next() + pattern(p % width, p / width)).collect();
    (terminal, vec![20_000; width * height], vec![20_000; width * height])
}

fn max_flow(c: &mut Criterion) {
    let mut group = c.benchmark_group("max flow 512x512, coin tosses");
    group.throughput(Throughput::Elements(512 * 512)).sample_size(10);
    let (terminal, right, up) = coin_tosses(512, 512);
    let capacities = GridCapacities {
        width: 512,
        height: 512,
        terminal: &terminal,
        right: &right,
        left: &right,
        up: &up,
        down: &up,
    };
    group.bench_function("grid", |b| b.iter(|| max_flow_grid(black_box(capacities))));
    let mut edges = Vec::new();
    for p in 0..512 * 512_u32 {
        let right = (!(p + 1).is_multiple_of(512)).then_some(p + 1);
        let up = (p + 512 < 512 * 512).then_some(p + 512);
        edges.extend([right, up].into_iter().flatten().map(|q| (p, q, 20_000, 20_000)));
    }
    group.bench_function("graph", |b| {
        b.iter(|| {
            let mut graph = FlowGraph::new(512 * 512, &edges).unwrap();
            for (node, &t) in terminal.iter().enumerate() {
                graph.set_terminals(node as u32, t.max(0).into(), (-t).max(0).into());
            }
            graph.max_flow()
        });
    });
    group.finish();
}

fn grid(c: &mut Criterion) {
    let mut group = c.benchmark_group("grid 512x512");
    group.throughput(Throughput::Elements(512 * 512)).sample_size(10);
    for (name, seed, costs) in [("products", 1, scene::products as scene::Costs), ("logarithms", 1, scene::logarithms)]
    {
        let scene = scene::scene(512, 512, seed, costs);
        let problem = scene.problem();
        let start: Vec<u8> = data_optimum(4, &scene.unary);
        group.bench_function(format!("expand, {name}"), |b| {
            b.iter(|| expand_grid(black_box(problem), start.clone(), &Options::default()));
        });
        group.bench_function(format!("swap, {name}"), |b| {
            b.iter(|| swap_grid(black_box(problem), start.clone(), &Options::default()));
        });
    }
    group.finish();
}

/// A graph like that of the faces of a large building block: 3,000 faces, 60 planes.
fn graph(c: &mut Criterion) {
    let (side, labels) = (55_usize, 60_usize);
    let hash = |a: usize, b: usize| {
        let x = (a as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (b as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        ((x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / f64::from(1 << 24)
    };
    let mut unary = Vec::new();
    let mut edges = Vec::new();
    for node in 0..side * side {
        let (x, y) = (node % side, node / side);
        let own = (x / 7 + 8 * (y / 7)) % labels;
        unary.extend((0..labels).map(|l| if l == own { 2.0 * hash(node, l) } else { 0.4 + 4.0 * hash(node, l) }));
        for (dx, dy) in [(1, 0), (0, 1), (1, 1)] {
            if x + dx < side && y + dy < side {
                edges.push((node as u32, (node + dx + dy * side) as u32, 0.2 + hash(node, 1000 + dx + 2 * dy)));
            }
        }
    }
    let problem = GraphProblem { labels, unary, edges };
    let start: Vec<u16> = data_optimum(labels, &problem.unary);
    let mut group = c.benchmark_group("graph");
    group.sample_size(20);
    group.bench_function("expand, 3025 nodes, 60 labels", |b| {
        b.iter(|| expand(black_box(&problem), start.clone(), &Options::default()));
    });
    group.finish();
}

criterion_group!(benches, max_flow, grid, graph);
criterion_main!(benches);
