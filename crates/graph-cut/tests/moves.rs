//! Labellings against all labellings, and against all single moves.

use gable_graph_cut::{
    Error, FORBIDDEN, GraphProblem, GridProblem, Options, Report, data_optimum, expand, expand_grid, is_forbidden,
    swap, swap_grid,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// A grid problem that owns its arrays.
#[derive(Clone, Debug)]
struct Grid {
    width: usize,
    height: usize,
    labels: usize,
    unary: Vec<f32>,
    right: Vec<f32>,
    up: Vec<f32>,
}

impl Grid {
    fn problem(&self) -> GridProblem<'_> {
        let Self { width, height, labels, unary, right, up } = self;
        GridProblem { width: *width, height: *height, labels: *labels, unary, right, up }
    }

    fn graph(&self) -> GraphProblem {
        let mut edges = Vec::new();
        for row in 0..self.height {
            for column in 0..self.width {
                let p = row * self.width + column;
                if column + 1 < self.width {
                    edges.push((p as u32, p as u32 + 1, f64::from(self.right[p])));
                }
                if row + 1 < self.height {
                    edges.push((p as u32, (p + self.width) as u32, f64::from(self.up[p])));
                }
            }
        }
        GraphProblem { labels: self.labels, unary: self.unary.iter().map(|&c| c.into()).collect(), edges }
    }
}

fn energy(problem: &GraphProblem, labels: &[u16]) -> f64 {
    let costs = labels.iter().enumerate().map(|(n, &l)| problem.unary[n * problem.labels + l as usize]);
    let weights = problem.edges.iter().filter(|e| labels[e.0 as usize] != labels[e.1 as usize]).map(|e| e.2);
    costs.sum::<f64>() + weights.sum::<f64>()
}

fn wide(labels: &[u8]) -> Vec<u16> {
    labels.iter().map(|&l| l.into()).collect()
}

/// The least energy of all labellings.
fn optimum(problem: &GraphProblem, nodes: usize) -> f64 {
    let mut labels = vec![0_u16; nodes];
    let mut best = f64::INFINITY;
    loop {
        best = best.min(energy(problem, &labels));
        let Some(at) = labels.iter().position(|&l| (l as usize) < problem.labels - 1) else { return best };
        labels[at] += 1;
        labels[..at].fill(0);
    }
}

/// The least energy that one move reaches: any subset of `free` nodes changes its label as `change` says.
fn best_move(problem: &GraphProblem, labels: &[u16], change: impl Fn(u16) -> Option<u16>) -> f64 {
    let free: Vec<usize> = (0..labels.len()).filter(|&n| change(labels[n]).is_some()).collect();
    let mut best = f64::INFINITY;
    for subset in 0_u32..1 << free.len() {
        let mut moved = labels.to_vec();
        for (bit, &node) in free.iter().enumerate() {
            if subset >> bit & 1 == 1 {
                moved[node] = change(moved[node]).unwrap();
            }
        }
        best = best.min(energy(problem, &moved));
    }
    best
}

fn check_report(problem: &GraphProblem, start: &[u16], labels: &[u16], report: &Report) {
    let exact = energy(problem, labels);
    assert!((report.energy - exact).abs() <= 1e-9 * exact.abs().max(1.0), "{} is not {exact}", report.energy);
    assert!((report.start_energy - energy(problem, start)).abs() <= 1e-9 * exact.abs().max(1.0));
    assert!(report.energy <= report.start_energy);
}

fn check_expansion(problem: &GraphProblem, labels: &[u16]) {
    let reached = energy(problem, labels);
    for alpha in 0..problem.labels as u16 {
        let better = best_move(problem, labels, |l| (l != alpha).then_some(alpha));
        assert!(better >= reached - 1e-5, "expanding {alpha} gains {}", reached - better);
    }
}

fn check_swap(problem: &GraphProblem, labels: &[u16]) {
    let reached = energy(problem, labels);
    for alpha in 0..problem.labels as u16 {
        for beta in alpha + 1..problem.labels as u16 {
            let other = |l| if l == alpha { Some(beta) } else { (l == beta).then_some(alpha) };
            let better = best_move(problem, labels, other);
            assert!(better >= reached - 1e-5, "swapping {alpha} and {beta} gains {}", reached - better);
        }
    }
}

/// Small grids with weights that are often zero or much larger than the costs.
fn grids() -> impl Strategy<Value = (Grid, Vec<u8>)> {
    let sizes = prop_oneof![(1_usize..4, 1_usize..4), (Just(1), 1_usize..10), (1_usize..10, Just(1))];
    (sizes, 1_usize..4).prop_flat_map(|((width, height), labels)| {
        let n = width * height;
        let weight = || prop_oneof![2 => Just(0.0_f32), 3 => 0.0_f32..1.0, 1 => 0.0_f32..6.0];
        let grid = (vec(-1.0_f32..1.0, n * labels), vec(weight(), n), vec(weight(), n))
            .prop_map(move |(unary, right, up)| Grid { width, height, labels, unary, right, up });
        (grid, vec(0..labels as u8, n))
    })
}

fn graphs() -> impl Strategy<Value = (GraphProblem, Vec<u16>)> {
    (1_usize..9, 1_usize..4).prop_flat_map(|(nodes, labels)| {
        let n = nodes as u32;
        let edge = (0..n, 0..n, 0.0..3.0_f64).prop_filter("no loops", |e| e.0 != e.1);
        let edges = if nodes > 1 { vec(edge, 0..20).boxed() } else { Just(Vec::new()).boxed() };
        let problem = (vec(-2.0..2.0_f64, nodes * labels), edges).prop_map(move |(unary, edges)| GraphProblem {
            labels,
            unary,
            edges,
        });
        (problem, vec(0..labels as u16, nodes))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_expansion_of_a_grid_gains_more((grid, start) in grids()) {
        let graph = grid.graph();
        let from_data = data_optimum(grid.labels, &grid.unary);
        for start in [start, from_data] {
            let (labels, report) = expand_grid(grid.problem(), start.clone(), &Options::default()).unwrap();
            let labels = wide(&labels);
            check_report(&graph, &wide(&start), &labels, &report);
            check_expansion(&graph, &labels);
            let best = optimum(&graph, labels.len());
            if grid.labels == 2 {
                prop_assert!(report.energy <= best + 1e-5);
            }
            // The factor two holds where costs are not negative: shift each node by its least cost.
            let shift: f64 = graph.unary.chunks(grid.labels).map(|c| c.iter().copied().fold(f64::INFINITY, f64::min)).sum();
            prop_assert!(report.energy - shift <= 2.0 * (best - shift) + 1e-5);
        }
    }

    #[test]
    fn no_swap_in_a_grid_gains_more((grid, start) in grids()) {
        let graph = grid.graph();
        let (labels, report) = swap_grid(grid.problem(), start.clone(), &Options::default()).unwrap();
        let labels = wide(&labels);
        check_report(&graph, &wide(&start), &labels, &report);
        check_swap(&graph, &labels);
    }

    #[test]
    fn graphs_do_as_grids_do((graph, start) in graphs()) {
        let (labels, report) = expand(&graph, start.clone(), &Options::default()).unwrap();
        check_report(&graph, &start, &labels, &report);
        check_expansion(&graph, &labels);
        if graph.labels == 2 {
            prop_assert!(report.energy <= optimum(&graph, labels.len()) + 1e-5);
        }
        let (labels, report) = swap(&graph, start.clone(), &Options::default()).unwrap();
        check_report(&graph, &start, &labels, &report);
        check_swap(&graph, &labels);
    }

    #[test]
    fn cycles_only_lower_the_energy((grid, start) in grids()) {
        let mut last = f64::INFINITY;
        for max_cycles in 0..4 {
            let (_, report) = expand_grid(grid.problem(), start.clone(), &Options { max_cycles }).unwrap();
            prop_assert!(report.energy <= last);
            last = report.energy;
        }
    }
}

/// A weak spot of thresholds and of fixed point: labels forbidden, weights of very different size.
#[test]
fn forbidden_labels_and_uneven_weights() {
    let never = f64::from(FORBIDDEN);
    // A chain of three nodes; the middle may not take label 0 and is tied to both ends.
    let problem =
        GraphProblem { labels: 2, unary: vec![0.0, 1.0, never, 0.0, 0.0, 1.0], edges: vec![(0, 1, 0.7), (1, 2, 1e4)] };
    let (labels, report) = expand(&problem, data_optimum(2, &problem.unary), &Options::default()).unwrap();
    assert_eq!(labels, [0, 1, 1]);
    assert!((report.energy - 1.7).abs() < 1e-9 && !is_forbidden(report.energy));
    let (labels, _) = swap(&problem, vec![0, 0, 0], &Options::default()).unwrap();
    assert_eq!(labels, [0, 1, 1]);
}

#[test]
fn trivial_problems() {
    let empty = GridProblem { width: 0, height: 0, labels: 3, unary: &[], right: &[], up: &[] };
    assert_eq!(expand_grid(empty, vec![], &Options::default()).unwrap().0, Vec::<u8>::new());
    assert_eq!(swap_grid(empty, vec![], &Options::default()).unwrap().0, Vec::<u8>::new());
    let one = GridProblem { width: 2, height: 1, labels: 1, unary: &[1.0, 2.0], right: &[1.0, 1.0], up: &[0.0; 2] };
    let (labels, report) = expand_grid(one, vec![0, 0], &Options::default()).unwrap();
    assert_eq!((labels, report.energy, report.moves), (vec![0, 0], 3.0, 0));
    // Without any weight the data decide, from whatever start.
    let free = Grid {
        width: 3,
        height: 1,
        labels: 3,
        unary: vec![2., 1., 3., 0., 5., 5., 4., 4., 1e-9],
        right: vec![0.; 3],
        up: vec![0.; 3],
    };
    assert_eq!(expand_grid(free.problem(), vec![2, 1, 0], &Options::default()).unwrap().0, [1, 0, 2]);
    assert_eq!(swap_grid(free.problem(), vec![2, 1, 0], &Options::default()).unwrap().0, [1, 0, 2]);
}

#[test]
fn wrong_problems_are_refused() {
    let grid = Grid { width: 2, height: 1, labels: 2, unary: vec![0.0; 4], right: vec![1.0; 2], up: vec![0.0; 2] };
    let run = |grid: &Grid, start: Vec<u8>| expand_grid(grid.problem(), start, &Options::default()).unwrap_err();
    assert!(matches!(run(&grid, vec![0]), Error::Length { what: "start", .. }));
    assert!(matches!(run(&grid, vec![0, 2]), Error::Start { node: 1, label: 2, labels: 2 }));
    let nan = Grid { unary: vec![0.0, 0.0, f32::NAN, 0.0], ..grid.clone() };
    assert!(matches!(run(&nan, vec![0, 0]), Error::Cost { node: 1, label: 0, .. }));
    let negative = Grid { right: vec![-1.0, 0.0], ..grid.clone() };
    assert!(matches!(run(&negative, vec![0, 0]), Error::Weight { edge: 0, .. }));
    // The last column's weights are ignored, whatever they are.
    let ignored = Grid { right: vec![1.0, f32::NAN], up: vec![f32::NAN; 2], ..grid.clone() };
    assert!(expand_grid(ignored.problem(), vec![0, 1], &Options::default()).is_ok());
    let none = Grid { labels: 0, unary: vec![], ..grid };
    assert!(matches!(run(&none, vec![0, 0]), Error::Labels { .. }));
    let loose = GraphProblem { labels: 1, unary: vec![0.0], edges: vec![(0, 1, 1.0)] };
    assert!(matches!(expand(&loose, vec![0], &Options::default()).unwrap_err(), Error::Edge { to: 1, .. }));
}
