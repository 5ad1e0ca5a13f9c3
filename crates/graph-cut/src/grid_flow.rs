//! Maximum flow on 4-connected grids, without stored adjacency.

use crate::Error;
use crate::potts::check_length;
use crate::topology::{Grid, Topology};
use crate::two_trees::TwoTrees;

/// Capacities on a 4-connected grid, pixels row by row from row 0. Each has to be between 0 and 2²⁸
/// (terminals ±2²⁹), so that sums fit 32 bits; arcs over the borders are ignored.
#[derive(Clone, Copy, Debug)]
pub struct GridCapacities<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Capacity from the source (positive) or to the sink (negative).
    pub terminal: &'a [i32],
    /// From a pixel to the one in the next column.
    pub right: &'a [i32],
    /// From a pixel to the one in the column before.
    pub left: &'a [i32],
    /// From a pixel to the one in the next row.
    pub up: &'a [i32],
    /// From a pixel to the one in the row before.
    pub down: &'a [i32],
}

/// The maximum flow through a grid, and for each pixel whether the minimum cut leaves it with the sink; of all minimum
/// cuts the one with the smallest sink side. Capacities are integers: flow and cut are equal exactly.
///
/// Boykov & Kolmogorov's algorithm with neighbours computed and not looked up, in 36 bytes a pixel.
///
/// # Errors
/// If an array does not have one value for each pixel, or a capacity is out of range.
pub fn max_flow_grid(capacities: GridCapacities<'_>) -> Result<(i64, Vec<bool>), Error> {
    let GridCapacities { width, height, terminal, right, left, up, down } = capacities;
    let grid = Grid::new(width, height)?;
    let pixels = width * height;
    for (what, values) in [("right", right), ("left", left), ("up", up), ("down", down)] {
        check_length(what, values.len(), pixels)?;
        if let Some(edge) = values.iter().position(|v| !(0..=1 << 28).contains(v)) {
            return Err(Error::Weight { edge, value: values[edge].into() });
        }
    }
    check_length("terminal", terminal.len(), pixels)?;
    if let Some(edge) = terminal.iter().position(|v| v.unsigned_abs() > 1 << 29) {
        return Err(Error::Weight { edge, value: terminal[edge].into() });
    }
    let mut arcs = vec![0; grid.arcs()];
    for (pixel, out) in arcs[4 * grid.margin()..].chunks_exact_mut(4).take(pixels).enumerate() {
        let column = pixel % width;
        out[0] = if column + 1 < width { right[pixel] } else { 0 };
        out[1] = if column > 0 { left[pixel] } else { 0 };
        out[2] = if pixel + width < pixels { up[pixel] } else { 0 };
        out[3] = if pixel >= width { down[pixel] } else { 0 };
    }
    let mut trees = TwoTrees::new(grid, arcs);
    for (pixel, &t) in terminal.iter().enumerate() {
        trees.set_terminal((pixel + grid.margin()) as u32, t);
    }
    let flow = trees.run();
    Ok((flow, (0..pixels).map(|p| trees.is_sink_side((p + grid.margin()) as u32)).collect()))
}
