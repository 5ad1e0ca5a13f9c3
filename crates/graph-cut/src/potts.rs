//! Potts energies on grids and graphs, and their fixed-point form.

use crate::Error;
use crate::demand_flow::Capacity;
use crate::topology::{Grid, Rows, Topology};
use std::fmt::Debug;

/// The cost of a label that must not be taken. Finite, so that sums stay finite; large against any cost or weight that
/// makes sense. A labelling that starts without a forbidden label never gets one.
pub const FORBIDDEN: f32 = 1e9;

/// A labelling problem on the pixels of a raster, 4-connected, row by row from row 0:
/// energy = Σ unary(pixel, label) + Σ weight(p, q)·[label p ≠ label q].
#[derive(Clone, Copy, Debug)]
pub struct GridProblem<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Labels, 1 to 256.
    pub labels: usize,
    /// Cost of each label at each pixel: `[pixel * labels + label]`, any finite value, [`FORBIDDEN`] for never.
    pub unary: &'a [f32],
    /// Weight ≥ 0 between a pixel and its neighbour in the next column, one value for each pixel (the last column's are
    /// ignored).
    pub right: &'a [f32],
    /// Weight ≥ 0 between a pixel and its neighbour in the next row, one value for each pixel (the last row's are ignored).
    pub up: &'a [f32],
}

/// A labelling problem on a general graph:
/// energy = Σ unary(node, label) + Σ weight(p, q)·[label p ≠ label q].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GraphProblem {
    /// Labels, 1 to 65,536.
    pub labels: usize,
    /// Cost of each label at each node: `[node * labels + label]`, any finite value, [`FORBIDDEN`] for never.
    pub unary: Vec<f64>,
    /// Pairs of nodes with their weight ≥ 0. Several edges between two nodes add up.
    pub edges: Vec<(u32, u32, f64)>,
}

/// Types that labels are kept in.
pub(crate) trait Label: Copy + Eq + Debug + TryFrom<usize> + Into<usize> {}
impl Label for u8 {}
impl Label for u16 {}

/// A problem on a topology, with its weights as integers. The unit is a power of two such that half of the largest
/// weight has [`Field::BITS`] bits: weights and differences of costs keep the resolution that the largest weight has in
/// f32 (grid) or better (graph). Weights are even, because moves split them in halves.
pub(crate) trait Field {
    /// Capacities.
    type Capacity: Capacity + Debug;
    /// Neighbours.
    type Topology: Topology;
    /// Bits of half of the largest weight.
    const BITS: i32;

    /// Labels.
    fn labels(&self) -> usize;
    /// The node numbers that carry a label (a margin does not).
    fn range(&self) -> std::ops::Range<usize>;
    /// Cost of a label.
    fn cost(&self, node: usize, label: usize) -> f64;
    /// Weight of an arc.
    fn weight(&self, node: u32, arc: u32) -> f64;
    /// Half of the weight of an arc, fixed point.
    fn half(&self, node: u32, arc: u32) -> Self::Capacity;
    /// A cost in fixed point, moved into ±`limit`.
    fn fixed(&self, cost: f64, limit: Self::Capacity) -> Self::Capacity;
}

/// Units to the metre of energy: a power of two that gives `largest` about `bits` bits.
fn unit(largest: f64, bits: i32) -> f64 {
    let exponent = if largest > 0.0 { largest.log2().ceil().clamp(-900.0, 900.0) as i32 } else { 0 };
    2_f64.powi(bits - exponent)
}

/// Rounds away from zero, so that a difference of costs never loses its sign.
fn rounded(value: f64, limit: f64) -> f64 {
    (value.abs().ceil()).min(limit).copysign(value)
}

pub(crate) struct GridField<'a> {
    problem: GridProblem<'a>,
    grid: Grid,
    unit: f64,
    /// Half weights with the margin of the grid, 0 over the borders.
    right: Vec<i32>,
    up: Vec<i32>,
}

impl<'a> GridField<'a> {
    pub(crate) fn new(problem: GridProblem<'a>) -> Result<Self, Error> {
        let GridProblem { width, height, labels, unary, right, up } = problem;
        check_labels(labels, 256)?;
        let grid = Grid::new(width, height)?;
        let pixels = width * height;
        check_length("unary", unary.len(), pixels * labels)?;
        check_length("right", right.len(), pixels)?;
        check_length("up", up.len(), pixels)?;
        if let Some(at) = unary.iter().position(|c| !c.is_finite()) {
            return Err(Error::Cost { node: at / labels, label: at % labels, value: unary[at].into() });
        }
        let mut largest = 0.0_f32;
        for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
            let at = row * width + column;
            let used = [(column + 1 < width).then(|| right[at]), (row + 1 < height).then(|| up[at])];
            for value in used.into_iter().flatten() {
                check_weight(at, value.into())?;
                largest = largest.max(value);
            }
        }
        let unit = unit(largest.into(), Self::BITS);
        let half = |weight: f32| (f64::from(weight) * unit).round() as i32;
        let mut field = Self { problem, grid, unit, right: vec![0; grid.nodes()], up: vec![0; grid.nodes()] };
        for row in 0..height {
            for column in 0..width {
                let (at, node) = (row * width + column, (row + 1) * width + column);
                if column + 1 < width {
                    field.right[node] = half(right[at]);
                }
                if row + 1 < height {
                    field.up[node] = half(up[at]);
                }
            }
        }
        Ok(field)
    }

    pub(crate) fn topology(&self) -> Grid {
        self.grid
    }
}

impl Field for GridField<'_> {
    type Capacity = i32;
    type Topology = Grid;
    const BITS: i32 = 24;

    fn labels(&self) -> usize {
        self.problem.labels
    }

    fn range(&self) -> std::ops::Range<usize> {
        self.grid.margin()..self.grid.nodes() - self.grid.margin()
    }

    #[inline(always)]
    fn cost(&self, node: usize, label: usize) -> f64 {
        f64::from(self.problem.unary[(node - self.grid.margin()) * self.problem.labels + label])
    }

    fn weight(&self, node: u32, arc: u32) -> f64 {
        let width = self.problem.width;
        let at = node as usize - width;
        f64::from(match arc & 3 {
            0 if !(at + 1).is_multiple_of(width) => self.problem.right[at],
            1 if !at.is_multiple_of(width) => self.problem.right[at - 1],
            2 if at + width < width * self.problem.height => self.problem.up[at],
            3 if at >= width => self.problem.up[at - width],
            _ => 0.0,
        })
    }

    #[inline(always)]
    fn half(&self, node: u32, arc: u32) -> i32 {
        let node = node as usize;
        match arc & 3 {
            0 => self.right[node],
            1 => self.right[node - 1],
            2 => self.up[node],
            _ => self.up[node - self.grid.margin()],
        }
    }

    #[inline(always)]
    fn fixed(&self, cost: f64, limit: i32) -> i32 {
        rounded(cost * self.unit * 2.0, f64::from(limit)) as i32
    }
}

pub(crate) struct GraphField<'a> {
    problem: &'a GraphProblem,
    rows: Rows,
    /// Weight of each arc, and half of it in fixed point.
    weights: Vec<(f64, i64)>,
    nodes: usize,
    unit: f64,
}

impl<'a> GraphField<'a> {
    pub(crate) fn new(problem: &'a GraphProblem) -> Result<Self, Error> {
        let labels = problem.labels;
        check_labels(labels, 1 << 16)?;
        let nodes = problem.unary.len() / labels;
        check_length("unary", problem.unary.len(), nodes * labels)?;
        if let Some(at) = problem.unary.iter().position(|c| !c.is_finite()) {
            return Err(Error::Cost { node: at / labels, label: at % labels, value: problem.unary[at] });
        }
        let (rows, origin) = Rows::new(nodes, problem.edges.iter().map(|&(p, q, _)| (p, q)))?;
        let mut largest = 0.0_f64;
        for (edge, &(_, _, weight)) in problem.edges.iter().enumerate() {
            check_weight(edge, weight)?;
            largest = largest.max(weight);
        }
        let unit = unit(largest, Self::BITS);
        let weights = origin.iter().map(|&arc| problem.edges[arc as usize / 2].2);
        let weights = weights.map(|w| (w, (w * unit).round() as i64)).collect();
        Ok(Self { problem, rows, weights, nodes, unit })
    }

    pub(crate) fn topology(&self) -> Rows {
        self.rows.clone()
    }
}

impl Field for GraphField<'_> {
    type Capacity = i64;
    type Topology = Rows;
    const BITS: i32 = 36;

    fn labels(&self) -> usize {
        self.problem.labels
    }

    fn range(&self) -> std::ops::Range<usize> {
        0..self.nodes
    }

    #[inline(always)]
    fn cost(&self, node: usize, label: usize) -> f64 {
        self.problem.unary[node * self.problem.labels + label]
    }

    fn weight(&self, _node: u32, arc: u32) -> f64 {
        self.weights[arc as usize].0
    }

    #[inline(always)]
    fn half(&self, _node: u32, arc: u32) -> i64 {
        self.weights[arc as usize].1
    }

    #[inline(always)]
    fn fixed(&self, cost: f64, limit: i64) -> i64 {
        rounded(cost * self.unit * 2.0, limit as f64) as i64
    }
}

fn check_labels(labels: usize, most: usize) -> Result<(), Error> {
    if (1..=most).contains(&labels) { Ok(()) } else { Err(Error::Labels { labels, most }) }
}

pub(crate) fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), Error> {
    if found == expected { Ok(()) } else { Err(Error::Length { what, found, expected }) }
}

fn check_weight(edge: usize, value: f64) -> Result<(), Error> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(Error::Weight { edge, value }) }
}
