//! The grid of blocks: which pixels of the absolute lattice are whose.

use crate::error::BlocksError;
use crate::fit::fit;
use crate::triangle::BlockTriangle;
use crate::triangle::UNITS_PER_METRE;
use gable_geometry::{Box2, Frame, dvec2};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Most blocks that a grid may have.
const MOST_BLOCKS: u64 = 1 << 20;
/// Most pixels of a block: 2.3 km × 2.3 km at 0.2 m.
const MOST_BLOCK_PIXELS: i64 = 1 << 27;
/// Most pixels along a side of the whole grid.
const MOST_PIXELS: f64 = 1e9;

/// How the grid is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GridSpec {
    /// So many columns and rows of blocks of the same size, up to a pixel. A number that is left out fits the scene: as many as are at
    /// least 100 m long, from 1 to 16; more up to 16 where a block would hold more than two million triangles.
    Count {
        /// Blocks from west to east.
        columns: Option<u32>,
        /// Blocks from south to north.
        rows: Option<u32>,
    },
    /// Square blocks of so many metres, rounded to whole pixels; the last ones may be smaller.
    Size(f64),
}

impl FromStr for GridSpec {
    type Err = BlocksError;

    /// `16x16`: columns by rows.
    fn from_str(text: &str) -> Result<Self, BlocksError> {
        let counts = text.split_once(['x', 'X', '×']);
        let counts = counts.and_then(|(c, r)| Some((c.trim().parse().ok()?, r.trim().parse().ok()?)));
        match counts {
            Some((columns, rows)) if columns > 0 && rows > 0 => {
                Ok(Self::Count { columns: Some(columns), rows: Some(rows) })
            }
            _ => Err(BlocksError::Grid { what: format!("{text:?} is no grid: write columns and rows as 16x16") }),
        }
    }
}

/// The part of the pixel lattice that one block is responsible for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct BlockCore {
    /// Row of the block, from the south (first, so that cores sort row by row).
    pub row: u32,
    /// Column of the block, from the west.
    pub column: u32,
    /// Lattice column of its western pixels.
    pub x0: i64,
    /// Lattice row of its southern pixels.
    pub y0: i64,
    /// Columns of pixels.
    pub width: usize,
    /// Rows of pixels.
    pub height: usize,
}

impl BlockCore {
    /// Extent in local metres for pixels of `step` metres.
    #[must_use]
    pub fn bounds(&self, step: f64) -> Box2 {
        let min = dvec2(self.x0 as f64, self.y0 as f64) * step;
        let max = dvec2((self.x0 + self.width as i64) as f64, (self.y0 + self.height as i64) as f64) * step;
        Box2 { min, max }
    }

    /// The name of its block file: `{column}_{row}.block`.
    #[must_use]
    pub fn file_name(&self) -> String {
        format!("{}_{}.block", self.column, self.row)
    }

    /// Whether a triangle's bounding box and the core share a point, borders included.
    #[must_use]
    pub fn meets(&self, triangle: &BlockTriangle, step: f64) -> bool {
        let (min, max) = triangle.bounds();
        Reach::of(self, step).meets(min, max)
    }
}

/// A core's extent, to be compared with many boxes on the coordinate lattice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    bounds: Box2,
}

impl Reach {
    pub(crate) fn of(core: &BlockCore, step: f64) -> Self {
        let bounds = core.bounds(step);
        // The scaling is by a power of two, so it is exact.
        Self { bounds: Box2 { min: bounds.min * UNITS_PER_METRE, max: bounds.max * UNITS_PER_METRE } }
    }

    #[inline]
    pub(crate) fn meets(&self, min: [i32; 3], max: [i32; 3]) -> bool {
        let Box2 { min: low, max: high } = self.bounds;
        f64::from(max[0]) >= low.x
            && f64::from(min[0]) <= high.x
            && f64::from(max[1]) >= low.y
            && f64::from(min[1]) <= high.y
    }
}

/// Blocks that tile a scene's extent without gap or overlap, every border on the pixel lattice.
///
/// The lattice is that of `GridWindow`: multiples of the step from the local origin, row 0 in the south.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlockGrid {
    /// The local frame in which blocks are kept.
    pub frame: Frame,
    /// Edge of a pixel, metres.
    pub step: f64,
    /// Lattice columns at which block columns begin, and the one after the last.
    column_edges: Vec<i64>,
    /// Lattice rows at which block rows begin, and the one after the last.
    row_edges: Vec<i64>,
}

impl BlockGrid {
    /// The grid over the extent, in local metres, of so many triangles: its pixels cover the extent, and no row or column more.
    ///
    /// # Errors
    /// [`BlocksError::Grid`] for an empty extent, a step or size that is no length, no blocks at all, more
    /// columns or rows than pixels, or more than 2²⁰ blocks.
    pub fn new(frame: Frame, extent: Box2, triangles: u64, step: f64, spec: GridSpec) -> Result<Self, BlocksError> {
        let wrong = |what: String| BlocksError::Grid { what };
        if !(step.is_finite() && step > 0.0) {
            return Err(wrong(format!("the step is {step} m: it must be a length above 0")));
        }
        let size = extent.size();
        if !(size.x >= 0.0 && size.y >= 0.0 && size.max_element() / step < MOST_PIXELS) {
            return Err(wrong(format!("{} × {} m cannot be covered with pixels of {step} m", size.x, size.y)));
        }
        let range = |min: f64, max: f64| {
            let first = (min / step).floor() as i64;
            (first, ((max / step).ceil() as i64).max(first + 1))
        };
        let (x, y) = (range(extent.min.x, extent.max.x), range(extent.min.y, extent.max.y));
        let (column_edges, row_edges) = match spec {
            GridSpec::Count { columns, rows } => {
                let [columns, rows] = fit([columns, rows], [x.1 - x.0, y.1 - y.0], step, triangles);
                (count_edges(x, columns, "columns")?, count_edges(y, rows, "rows")?)
            }
            GridSpec::Size(size) => {
                if !(size.is_finite() && size >= step) {
                    return Err(wrong(format!("the block size is {size} m: it must be at least the step, {step} m")));
                }
                let pixels = (size / step).round() as i64;
                (size_edges(x, pixels)?, size_edges(y, pixels)?)
            }
        };
        let blocks = (column_edges.len() as u64 - 1) * (row_edges.len() as u64 - 1);
        if blocks > MOST_BLOCKS {
            return Err(too_many(blocks));
        }
        let widest = |edges: &[i64]| edges.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        let (width, height) = (widest(&column_edges), widest(&row_edges));
        if width.saturating_mul(height) > MOST_BLOCK_PIXELS {
            let metres = |pixels: i64| pixels as f64 * step;
            return Err(wrong(format!(
                "a block would measure {:.0} × {:.0} m and have more than {} million pixels of {step} m: \
                 ask for more or smaller blocks, or leave out what lies far off",
                metres(width),
                metres(height),
                MOST_BLOCK_PIXELS / 1_000_000
            )));
        }
        Ok(Self { frame, step, column_edges, row_edges })
    }

    /// Columns of blocks.
    #[must_use]
    pub fn columns(&self) -> u32 {
        (self.column_edges.len() - 1) as u32
    }

    /// Rows of blocks.
    #[must_use]
    pub fn rows(&self) -> u32 {
        (self.row_edges.len() - 1) as u32
    }

    /// The core of the block in a column (from the west) and row (from the south), if there is one.
    #[must_use]
    pub fn core(&self, column: u32, row: u32) -> Option<BlockCore> {
        let span = |edges: &[i64], at: u32| {
            let at = at as usize;
            Some((*edges.get(at)?, *edges.get(at + 1)?))
        };
        let (x0, x1) = span(&self.column_edges, column)?;
        let (y0, y1) = span(&self.row_edges, row)?;
        Some(BlockCore { row, column, x0, y0, width: (x1 - x0) as usize, height: (y1 - y0) as usize })
    }

    /// All cores, row by row from the south.
    pub fn cores(&self) -> impl Iterator<Item = BlockCore> + '_ {
        (0..self.rows()).flat_map(move |row| (0..self.columns()).filter_map(move |column| self.core(column, row)))
    }

    /// The core of the whole grid as if it were one block: first lattice column and row, columns, rows.
    #[must_use]
    pub fn whole(&self) -> BlockCore {
        let (x0, y0) = (self.column_edges[0], self.row_edges[0]);
        let (x1, y1) = (self.column_edges[self.column_edges.len() - 1], self.row_edges[self.row_edges.len() - 1]);
        BlockCore { row: 0, column: 0, x0, y0, width: (x1 - x0) as usize, height: (y1 - y0) as usize }
    }

    /// The core that a pixel of the lattice belongs to, if it is in the grid.
    #[must_use]
    pub fn core_of_pixel(&self, x: i64, y: i64) -> Option<BlockCore> {
        let at = |edges: &[i64], value: i64| (edges.partition_point(|edge| *edge <= value) as u32).checked_sub(1);
        self.core(at(&self.column_edges, x)?, at(&self.row_edges, y)?)
    }
}

fn too_many(blocks: u64) -> BlocksError {
    BlocksError::Grid { what: format!("it would have {blocks} blocks, more than {MOST_BLOCKS}") }
}

/// Edges of `count` spans that differ by one pixel at most.
fn count_edges((first, end): (i64, i64), count: u32, what: &str) -> Result<Vec<i64>, BlocksError> {
    let pixels = end - first;
    if count == 0 || i64::from(count) > pixels {
        let what = format!("{count} {what} of blocks are asked for, but there are {pixels} {what} of pixels");
        return Err(BlocksError::Grid { what });
    }
    if u64::from(count) > MOST_BLOCKS {
        return Err(too_many(u64::from(count)));
    }
    Ok((0..=i64::from(count)).map(|i| first + pixels * i / i64::from(count)).collect())
}

/// Edges of spans of `pixels`, the last one cut.
fn size_edges((first, end): (i64, i64), pixels: i64) -> Result<Vec<i64>, BlocksError> {
    let count = ((end - first) as u64).div_ceil(pixels as u64);
    if count > MOST_BLOCKS {
        return Err(too_many(count));
    }
    Ok((0..=count as i64).map(|i| (first + pixels * i).min(end)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Crs, DVec2};
    use proptest::prelude::*;

    fn grid(min: DVec2, max: DVec2, step: f64, spec: GridSpec) -> Result<BlockGrid, BlocksError> {
        let frame = Frame { origin: [0.0; 3], crs: Crs::Unknown };
        BlockGrid::new(frame, Box2 { min, max }, 1, step, spec)
    }

    #[test]
    fn says_why_a_grid_cannot_be_made() {
        let said = |step: f64, spec: GridSpec| {
            grid(DVec2::ZERO, dvec2(10.0, 5.0), step, spec).expect_err("no grid").to_string()
        };
        let count = GridSpec::Count { columns: Some(4), rows: Some(40) };
        assert_eq!(
            said(0.2, count),
            "the grid cannot be made: 40 rows of blocks are asked for, but there are 25 rows of pixels"
        );
        assert_eq!(said(0.0, count), "the grid cannot be made: the step is 0 m: it must be a length above 0");
        assert!(said(1e-9, GridSpec::Size(1.0)).contains("cannot be covered"));
        assert!(said(0.001, GridSpec::Size(0.001)).contains("more than 1048576"));
        assert!(said(0.2, GridSpec::Size(f64::NAN)).contains("block size is NaN m"));
        let one = GridSpec::Count { columns: Some(1), rows: Some(1) };
        let wide = |side: f64| grid(DVec2::ZERO, DVec2::splat(side), 0.2, one).map_err(|e| e.to_string());
        assert!(wide(2_300.0).is_ok());
        assert!(wide(2_400.0).is_err_and(|e| e.contains("a block would measure 2400 × 2400 m")));
        let text = "16".parse::<GridSpec>().expect_err("no grid").to_string();
        assert_eq!(text, "the grid cannot be made: \"16\" is no grid: write columns and rows as 16x16");
        assert_eq!("4x 3".parse::<GridSpec>().ok(), Some(GridSpec::Count { columns: Some(4), rows: Some(3) }));
    }

    proptest! {
        #[test]
        fn cores_tile_the_extent(
            min in (-50.0f64..50.0, -50.0f64..50.0),
            size in (0.0f64..80.0, 0.0f64..80.0),
            step in 0.1f64..1.0,
            counts in (1u32..9, 1u32..9),
            metres in 5.0f64..40.0,
            by_size: bool,
        ) {
            let min = dvec2(min.0, min.1);
            let max = min + dvec2(size.0, size.1);
            let count = GridSpec::Count { columns: Some(counts.0), rows: Some(counts.1) };
            let spec = if by_size { GridSpec::Size(metres) } else { count };
            let Ok(grid) = grid(min, max, step, spec) else {
                // Only fewer pixels than blocks may stop it.
                prop_assert!(!by_size && (size.0 / step < 9.0 || size.1 / step < 9.0));
                return Ok(());
            };
            let whole = grid.whole();
            let bounds = whole.bounds(step);
            prop_assert!(bounds.min.cmple(min).all() && bounds.max.cmpge(max).all());
            prop_assert!((min - bounds.min).max_element() < step * 1.0001);
            // Each pixel belongs to exactly one core, the one that is found for it.
            let mut pixels = 0;
            for core in grid.cores() {
                prop_assert!(core.width > 0 && core.height > 0);
                pixels += core.width * core.height;
                let (x1, y1) = (core.x0 + core.width as i64 - 1, core.y0 + core.height as i64 - 1);
                prop_assert_eq!(grid.core_of_pixel(core.x0, core.y0), Some(core));
                prop_assert_eq!(grid.core_of_pixel(x1, y1), Some(core));
            }
            prop_assert_eq!(pixels, whole.width * whole.height);
            prop_assert_eq!(grid.core_of_pixel(whole.x0 - 1, whole.y0), None);
            prop_assert_eq!(grid.core_of_pixel(whole.x0 + whole.width as i64, whole.y0), None);
        }
    }
}
