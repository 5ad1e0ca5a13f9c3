//! The flow is the cut, and both are what a slow and simple algorithm finds.

use gable_graph_cut::{FlowGraph, GridCapacities, max_flow_grid};
use proptest::collection::vec;
use proptest::prelude::*;
use std::collections::VecDeque;

/// An edge: from, to, capacity, capacity back.
type Edge = (u32, u32, i64, i64);

/// Edmonds & Karp's algorithm on an adjacency matrix: source is node n, sink n + 1.
fn edmonds_karp(nodes: usize, edges: &[Edge], terminals: &[(i64, i64)]) -> i64 {
    let (source, sink, all) = (nodes, nodes + 1, nodes + 2);
    let mut capacity = vec![vec![0; all]; all];
    for &(p, q, there, back) in edges {
        capacity[p as usize][q as usize] += there;
        capacity[q as usize][p as usize] += back;
    }
    for (node, &(from, to)) in terminals.iter().enumerate() {
        capacity[source][node] += from;
        capacity[node][sink] += to;
    }
    let mut flow = 0;
    loop {
        let mut parent = vec![usize::MAX; all];
        parent[source] = source;
        let mut queue = VecDeque::from([source]);
        while let Some(node) = queue.pop_front() {
            for next in 0..all {
                if parent[next] == usize::MAX && capacity[node][next] > 0 {
                    parent[next] = node;
                    queue.push_back(next);
                }
            }
        }
        if parent[sink] == usize::MAX {
            return flow;
        }
        let path: Vec<(usize, usize)> =
            std::iter::successors(Some(sink), |&n| (parent[n] != source).then(|| parent[n]))
                .map(|n| (parent[n], n))
                .collect();
        let amount = path.iter().map(|&(p, q)| capacity[p][q]).min().unwrap();
        for (p, q) in path {
            capacity[p][q] -= amount;
            capacity[q][p] += amount;
        }
        flow += amount;
    }
}

/// Capacity over the cut.
fn cut(edges: &[Edge], terminals: &[(i64, i64)], sink_side: &[bool]) -> i64 {
    let over = |&(p, q, there, back): &Edge| match (sink_side[p as usize], sink_side[q as usize]) {
        (false, true) => there,
        (true, false) => back,
        _ => 0,
    };
    let ends = terminals.iter().zip(sink_side).map(|(&(from, to), &sink)| if sink { from } else { to });
    edges.iter().map(over).sum::<i64>() + ends.sum::<i64>()
}

fn solve(nodes: usize, edges: &[Edge], terminals: &[(i64, i64)]) -> (i64, Vec<bool>) {
    let mut graph = FlowGraph::new(nodes, edges).unwrap();
    for (node, &(from, to)) in terminals.iter().enumerate() {
        graph.set_terminals(node as u32, from, to);
    }
    let flow = graph.max_flow();
    assert_eq!(graph.max_flow(), flow, "a second call changes nothing");
    (flow, (0..nodes as u32).map(|n| graph.is_sink_side(n)).collect())
}

/// The arcs of a grid as edges: right and left, up and down.
fn grid_edges(width: usize, height: usize, arcs: &[[i32; 4]]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for row in 0..height {
        for column in 0..width {
            let p = row * width + column;
            if column + 1 < width {
                edges.push((p as u32, p as u32 + 1, arcs[p][0].into(), arcs[p + 1][1].into()));
            }
            if row + 1 < height {
                let q = p + width;
                edges.push((p as u32, q as u32, arcs[p][2].into(), arcs[q][3].into()));
            }
        }
    }
    edges
}

fn check_grid(width: usize, height: usize, terminal: &[i32], arcs: &[[i32; 4]]) {
    let side = |k: usize| arcs.iter().map(|a| a[k]).collect::<Vec<_>>();
    let (right, left, up, down) = (side(0), side(1), side(2), side(3));
    let capacities = GridCapacities { width, height, terminal, right: &right, left: &left, up: &up, down: &down };
    let (flow, sink_side) = max_flow_grid(capacities).unwrap();
    let edges = grid_edges(width, height, arcs);
    let terminals: Vec<(i64, i64)> = terminal.iter().map(|&t| (t.max(0).into(), (-t).max(0).into())).collect();
    let (general, general_side) = solve(width * height, &edges, &terminals);
    assert_eq!(flow, general);
    assert_eq!(flow, cut(&edges, &terminals, &sink_side));
    assert_eq!(sink_side, general_side, "both give the smallest sink side");
}

fn graphs() -> impl Strategy<Value = (usize, Vec<Edge>, Vec<(i64, i64)>)> {
    (1_usize..14).prop_flat_map(|nodes| {
        let n = nodes as u32;
        let edge = (0..n, 0..n, 0_i64..9, 0_i64..9).prop_filter("no loops", |e| e.0 != e.1);
        let edges = if nodes > 1 { vec(edge, 0..40).boxed() } else { Just(Vec::new()).boxed() };
        (Just(nodes), edges, vec((0_i64..12, 0_i64..12), nodes))
    })
}

fn grids() -> impl Strategy<Value = (usize, usize, Vec<i32>, Vec<[i32; 4]>)> {
    (1_usize..7, 1_usize..7, 1_i32..30).prop_flat_map(|(w, h, most)| {
        (Just(w), Just(h), vec(-most..=most, w * h), vec([0..=most, 0..=most, 0..=most, 0..=most], w * h))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn general_flow_is_the_cut_and_the_oracle((nodes, edges, terminals) in graphs()) {
        let (flow, sink_side) = solve(nodes, &edges, &terminals);
        prop_assert_eq!(flow, edmonds_karp(nodes, &edges, &terminals));
        prop_assert_eq!(flow, cut(&edges, &terminals, &sink_side));
    }

    #[test]
    fn grid_flow_is_the_cut_and_the_general_flow((width, height, terminal, arcs) in grids()) {
        check_grid(width, height, &terminal, &arcs);
    }
}

#[test]
fn large_noisy_grids_agree() {
    let (width, height) = (97, 61);
    let mut state = 7_u64;
    let mut next = |most: i32| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) % (most as u64 + 1)) as i32
    };
    for (unary, weight) in [(100, 5), (100, 40), (20, 100), (1 << 29, 1 << 28)] {
        let terminal: Vec<i32> = (0..width * height).map(|_| next(unary) - next(unary)).collect();
        let arcs: Vec<[i32; 4]> = (0..width * height).map(|_| std::array::from_fn(|_| next(weight))).collect();
        check_grid(width, height, &terminal, &arcs);
    }
}

#[test]
fn nothing_to_flow() {
    assert_eq!(solve(0, &[], &[]), (0, vec![]));
    assert_eq!(solve(2, &[(0, 1, 4, 4)], &[(3, 3), (0, 0)]), (3, vec![false, false]));
    check_grid(0, 0, &[], &[]);
    check_grid(1, 1, &[-3], &[[9; 4]]);
    check_grid(3, 1, &[-3, 0, 3], &[[0; 4]; 3]);
}

#[test]
fn wrong_graphs_are_refused() {
    assert!(FlowGraph::new(2, &[(0, 2, 1, 1)]).is_err());
    assert!(FlowGraph::new(2, &[(1, 1, 1, 1)]).is_err());
    assert!(FlowGraph::new(2, &[(0, 1, -1, 1)]).is_err());
    let short = GridCapacities {
        width: 2,
        height: 1,
        terminal: &[0; 2],
        right: &[0; 1],
        left: &[0; 2],
        up: &[0; 2],
        down: &[0; 2],
    };
    assert!(max_flow_grid(short).is_err());
    assert!(max_flow_grid(GridCapacities { right: &[-1, 0], ..short }).is_err());
}
