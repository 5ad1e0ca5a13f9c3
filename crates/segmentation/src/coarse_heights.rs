//! Low heights of a city on coarse cells, gathered block by block.

use std::collections::BTreeMap;

use gable_geometry::Box2;
use gable_raster::{GridWindow, Raster};

/// Samples a cell keeps: the pixels at the centres of its 4 × 4 parts.
pub(crate) const SIDE: usize = 4;

/// Cells along the edge of a tile of the store.
const TILE: i64 = 64;

/// Low height statistics of the surface on the cells of an absolute lattice.
///
/// Cell (i, j) covers [i·cell, (i+1)·cell) × [j·cell, (j+1)·cell) local metres. It keeps the heights of sixteen pixels at
/// fixed places, so the store does not depend on how the city is cut into rasters, in which order they come, or which
/// of them are merged first. Where two rasters cover one place, the lower height stays. 64 B a cell where there is data.
#[derive(Clone, Debug)]
pub struct CoarseHeights {
    cell: f64,
    tiles: BTreeMap<(i64, i64), Vec<[f32; SIDE * SIDE]>>,
}

impl CoarseHeights {
    /// Cell edge that suits streets and courtyards, metres.
    pub const CELL: f64 = 2.0;

    /// An empty store of cells of a size, metres.
    #[must_use]
    pub fn new(cell: f64) -> Self {
        Self { cell, tiles: BTreeMap::new() }
    }

    /// Cell edge, metres.
    #[must_use]
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// Whether nothing was gathered.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tiles.is_empty()
    }

    /// Takes in the heights of a raster of pixels smaller than a cell's part (a quarter of a cell); NaN is no data.
    ///
    /// Cost: O(cells of the raster).
    pub fn accumulate(&mut self, heights: &Raster<f32>) {
        let window = heights.window();
        if window.is_empty() {
            return;
        }
        let part = self.cell / SIDE as f64;
        let bounds = window.bounds();
        let range = |low: f64, high: f64| ((low / part).floor() as i64 - 1, (high / part).ceil() as i64 + 1);
        let (x0, x1) = range(bounds.min.x, bounds.max.x);
        let (y0, y1) = range(bounds.min.y, bounds.max.y);
        // The pixel of a part is the one that holds its centre, on the lattice of pixels.
        let pixel = |at: i64| (((at as f64 + 0.5) * part) / window.step).floor() as i64;
        let side = SIDE as i64;
        for y in y0..y1 {
            let row = pixel(y) - window.y0;
            if row < 0 || row as usize >= window.height {
                continue;
            }
            let row = heights.row(row as usize);
            for x in x0..x1 {
                let column = pixel(x) - window.x0;
                if column < 0 || column as usize >= window.width || row[column as usize].is_nan() {
                    continue;
                }
                let (i, j) = (x.div_euclid(side), y.div_euclid(side));
                let tile = self.tiles.entry((j.div_euclid(TILE), i.div_euclid(TILE))).or_insert_with(empty_tile);
                let cell = &mut tile[(j.rem_euclid(TILE) * TILE + i.rem_euclid(TILE)) as usize];
                lower(&mut cell[(y.rem_euclid(side) * side + x.rem_euclid(side)) as usize], row[column as usize]);
            }
        }
    }

    /// Takes in another store of the same cell size.
    pub fn merge(&mut self, other: &Self) {
        debug_assert_eq!(self.cell, other.cell);
        for (key, theirs) in &other.tiles {
            let ours = self.tiles.entry(*key).or_insert_with(empty_tile);
            for (a, b) in ours.iter_mut().flatten().zip(theirs.iter().flatten()) {
                lower(a, *b);
            }
        }
    }

    /// The cells with data, as column, row and the heights of their samples, NaN where there is none; in a fixed order.
    pub fn cells(&self) -> impl Iterator<Item = (i64, i64, &[f32; SIDE * SIDE])> {
        self.tiles.iter().flat_map(|(&(tj, ti), cells)| {
            let with_data = cells.iter().enumerate().filter(|(_, cell)| cell.iter().any(|v| !v.is_nan()));
            with_data.map(move |(k, cell)| (ti * TILE + k as i64 % TILE, tj * TILE + k as i64 / TILE, cell))
        })
    }

    /// Takes in what [`CoarseHeights::cells`] gave of a store of the same cell size.
    pub fn add_cell(&mut self, column: i64, row: i64, samples: &[f32; SIDE * SIDE]) {
        let tile = self.tiles.entry((row.div_euclid(TILE), column.div_euclid(TILE))).or_insert_with(empty_tile);
        let cell = &mut tile[(row.rem_euclid(TILE) * TILE + column.rem_euclid(TILE)) as usize];
        for (kept, value) in cell.iter_mut().zip(samples).filter(|(_, value)| !value.is_nan()) {
            lower(kept, *value);
        }
    }

    /// The smallest window of whole cells with data; its step is the cell.
    #[must_use]
    pub fn window(&self) -> GridWindow {
        let mut bounds = Box2::of([]);
        for (&(tj, ti), cells) in &self.tiles {
            for (k, cell) in cells.iter().enumerate() {
                if cell.iter().any(|v| !v.is_nan()) {
                    let (i, j) = (ti * TILE + k as i64 % TILE, tj * TILE + k as i64 / TILE);
                    let centre = gable_geometry::dvec2(i as f64 + 0.5, j as f64 + 0.5) * self.cell;
                    bounds.min = bounds.min.min(centre);
                    bounds.max = bounds.max.max(centre);
                }
            }
        }
        if bounds.is_empty() {
            return GridWindow { step: self.cell, x0: 0, y0: 0, width: 0, height: 0 };
        }
        GridWindow::covering(bounds, self.cell)
    }

    /// The samples of each cell of a window, row by row; NaN where there is none.
    pub(crate) fn samples(&self, window: GridWindow) -> Vec<[f32; SIDE * SIDE]> {
        let mut out = vec![[f32::NAN; SIDE * SIDE]; window.len()];
        for (column, row, samples) in self.cells() {
            let (x, y) = (column - window.x0, row - window.y0);
            if x >= 0 && y >= 0 && (x as usize) < window.width && (y as usize) < window.height {
                out[y as usize * window.width + x as usize] = *samples;
            }
        }
        out
    }
}

fn empty_tile() -> Vec<[f32; SIDE * SIDE]> {
    vec![[f32::NAN; SIDE * SIDE]; (TILE * TILE) as usize]
}

fn lower(kept: &mut f32, value: f32) {
    if kept.is_nan() || value < *kept {
        *kept = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;

    fn city() -> Raster<f32> {
        let mut random = Counter::new(8);
        let window = GridWindow { step: 0.3, x0: -70, y0: 15, width: 150, height: 90 };
        Raster::filled(window, ()).map(|()| if random.unit() < 0.1 { f32::NAN } else { random.range(0.0, 9.0) as f32 })
    }

    #[test]
    fn does_not_depend_on_the_cut_or_the_order() {
        let city = city();
        let mut whole = CoarseHeights::new(2.0);
        whole.accumulate(&city);
        let mut parts = CoarseHeights::new(2.0);
        let mut cuts = Vec::new();
        for y in (0..90).step_by(17) {
            for x in (0..150).step_by(23) {
                let w = city.window();
                cuts.push(GridWindow {
                    x0: w.x0 + x,
                    y0: w.y0 + y,
                    width: 23.min(150 - x as usize),
                    height: 17.min(90 - y as usize),
                    ..w
                });
            }
        }
        for cut in cuts.iter().rev() {
            let mut part = CoarseHeights::new(2.0);
            part.accumulate(&city.crop(*cut, f32::NAN));
            parts.merge(&part);
        }
        assert_eq!(whole.window(), parts.window());
        assert_eq!(format!("{:?}", whole.tiles), format!("{:?}", parts.tiles));
        let mut again = CoarseHeights::new(2.0);
        parts.cells().for_each(|(column, row, samples)| again.add_cell(column, row, samples));
        assert_eq!(format!("{:?}", whole.tiles), format!("{:?}", again.tiles));
    }
}
