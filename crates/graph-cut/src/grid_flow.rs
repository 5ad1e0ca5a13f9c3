//! Maximum flow on 4-connected grids, without stored adjacency.

use crate::Error;
use crate::demand_flow::{DemandFlow, Supply};
use crate::potts::check_length;
use crate::topology::Grid;

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
/// Boykov & Kolmogorov's algorithm, growing from the sink only: the cost depends on the region that its
/// paths explore, with neighbours computed and not looked up.
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
    let mut flow = DemandFlow::new(grid);
    flow.begin();
    let supply = Capacities { grid, capacities };
    for (pixel, &t) in terminal.iter().enumerate() {
        if t < 0 {
            flow.reach((pixel + grid.margin()) as u32, &supply);
        }
    }
    let pushed = flow.run(&supply);
    Ok((pushed, (0..pixels).map(|p| flow.on_sink_side((p + grid.margin()) as u32)).collect()))
}

struct Capacities<'a> {
    grid: Grid,
    capacities: GridCapacities<'a>,
}

impl Supply<i32> for Capacities<'_> {
    fn node(&self, node: u32, out: &mut [i32]) -> i32 {
        let c = &self.capacities;
        out.fill(0);
        let Some(pixel) = (node as usize).checked_sub(self.grid.margin()).filter(|p| *p < c.terminal.len()) else {
            return 0;
        };
        let column = pixel % c.width;
        if column + 1 < c.width {
            out[0] = c.right[pixel];
        }
        if column > 0 {
            out[1] = c.left[pixel];
        }
        if pixel + c.width < c.terminal.len() {
            out[2] = c.up[pixel];
        }
        if pixel >= c.width {
            out[3] = c.down[pixel];
        }
        c.terminal[pixel]
    }
}
