//! Maximum flow of a 4-connected grid from a file, timed: the other half of `tests/benchmarks/max_flow.py`.
//!
//! The file holds, as little-endian 32-bit integers: width, height, then for each pixel the terminal capacity (positive from the
//! source, negative to the sink), then for each pixel the capacity to its right neighbour (both ways), then up. Prints, for the
//! grid and for the general graph, the flow and the seconds of setting up and of solving (the grid does both at once).

use gable_graph_cut::{FlowGraph, GridCapacities, max_flow_grid};
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "the figures are read by the script")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give the file of capacities")?;
    let bytes = std::fs::read(path)?;
    let numbers: Vec<i32> = bytes.chunks_exact(4).map(|b| i32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let [width, height] = [numbers[0] as usize, numbers[1] as usize];
    let n = width * height;
    let [terminal, right, up] = [0, 1, 2].map(|k| &numbers[2 + k * n..2 + (k + 1) * n]);
    let left: Vec<i32> = (0..n).map(|p| if p > 0 { right[p - 1] } else { 0 }).collect();
    let down: Vec<i32> = (0..n).map(|p| if p >= width { up[p - width] } else { 0 }).collect();

    let start = Instant::now();
    let capacities = GridCapacities { width, height, terminal, right, left: &left, up, down: &down };
    let (flow, _) = max_flow_grid(capacities)?;
    println!("grid {flow} 0 {}", start.elapsed().as_secs_f64());

    let start = Instant::now();
    let mut edges = Vec::with_capacity(2 * n);
    for p in 0..n {
        if !(p + 1).is_multiple_of(width) {
            edges.push((p as u32, p as u32 + 1, right[p].into(), right[p].into()));
        }
        if p + width < n {
            edges.push((p as u32, (p + width) as u32, up[p].into(), up[p].into()));
        }
    }
    let mut graph = FlowGraph::new(n, &edges)?;
    for (node, &t) in terminal.iter().enumerate() {
        graph.set_terminals(node as u32, t.max(0).into(), (-t).max(0).into());
    }
    let set_up = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let flow = graph.max_flow();
    println!("graph {flow} {set_up} {}", start.elapsed().as_secs_f64());
    Ok(())
}
