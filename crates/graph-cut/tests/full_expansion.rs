//! Cutting only where there is something to decide reaches the energy of cutting everything.

use gable_graph_cut::{FlowGraph, Options, data_optimum, expand_grid, swap_grid};

mod scene;

const UNIT: f64 = (1_u64 << 32) as f64;

/// Costs and weights of a labelling, summed in f64.
fn energy(scene: &scene::Scene, labels: &[u8]) -> f64 {
    let n = labels.len();
    let mut sum = 0.0;
    for p in 0..n {
        sum += f64::from(scene.unary[4 * p + usize::from(labels[p])]);
        if !(p + 1).is_multiple_of(scene.width) && labels[p] != labels[p + 1] {
            sum += f64::from(scene.right[p]);
        }
        if p + scene.width < n && labels[p] != labels[p + scene.width] {
            sum += f64::from(scene.up[p]);
        }
    }
    sum
}

/// α-expansion the long way: every pixel and every edge is in every cut (Kolmogorov & Zabih's construction).
fn full_expansion(scene: &scene::Scene, mut labels: Vec<u8>) -> Vec<u8> {
    let (n, width) = (labels.len(), scene.width);
    let mut unchanged = 0;
    for alpha in (0..4_u8).cycle() {
        if unchanged == 4 {
            break;
        }
        let mut linear = vec![0.0_f64; n];
        let mut edges = Vec::new();
        let cost = |p: usize, l: u8| f64::from(scene.unary[4 * p + usize::from(l)]);
        for p in 0..n {
            linear[p] += cost(p, alpha) - cost(p, labels[p]);
            let right = (!(p + 1).is_multiple_of(width)).then(|| (p + 1, scene.right[p]));
            let up = (p + width < n).then(|| (p + width, scene.up[p]));
            for (q, w) in [right, up].into_iter().flatten() {
                let w = f64::from(w);
                let differ = |a: u8, b: u8| if a == b { 0.0 } else { w };
                let (keep, q_moves, p_moves) =
                    (differ(labels[p], labels[q]), differ(labels[p], alpha), differ(alpha, labels[q]));
                linear[p] += p_moves - keep;
                linear[q] -= p_moves;
                edges.push((p as u32, q as u32, ((q_moves + p_moves - keep) * UNIT) as i64, 0));
            }
        }
        let mut graph = FlowGraph::new(n, &edges).unwrap();
        for (p, c) in linear.iter().enumerate() {
            let c = (c * UNIT) as i64;
            graph.set_terminals(p as u32, c.max(0), (-c).max(0));
        }
        graph.max_flow();
        let before = energy(scene, &labels);
        let moved: Vec<u8> = (0..n).map(|p| if graph.is_sink_side(p as u32) { alpha } else { labels[p] }).collect();
        if energy(scene, &moved) < before {
            labels = moved;
            unchanged = 0;
        } else {
            unchanged += 1;
        }
    }
    labels
}

#[test]
fn energy_is_that_of_the_full_expansion() {
    for (costs, seed) in [(scene::products as scene::Costs, 5), (scene::logarithms, 6), (scene::logarithms, 7)] {
        let scene = scene::scene(190, 150, seed, costs);
        let start: Vec<u8> = data_optimum(4, &scene.unary);
        let full = energy(&scene, &full_expansion(&scene, start.clone()));
        let (labels, report) = expand_grid(scene.problem(), start.clone(), &Options::default()).unwrap();
        assert!((report.energy - energy(&scene, &labels)).abs() < 1e-6 * full);
        assert!((report.energy - full).abs() <= 1e-6 * full, "{} against {full}", report.energy);
        assert!(report.energy < 0.95 * report.start_energy, "the scene has something to smooth");
        assert!((0..4).filter(|l| labels.contains(l)).count() >= 3, "the scene has labels to choose from");
        let (_, swapped) = swap_grid(scene.problem(), start, &Options::default()).unwrap();
        assert!(swapped.energy < 1.02 * full);
    }
}
