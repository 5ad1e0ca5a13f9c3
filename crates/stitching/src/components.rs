//! Connected components of one tile, and what has to be known of them at its borders.

use gable_raster::{BorderTraces, Connectivity, GridWindow, Raster, components};
use serde::{Deserialize, Serialize};

/// A 4-connected component on one tile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Component {
    /// Number of pixels.
    pub pixels: u64,
    /// Sum of the lattice columns of its pixels.
    pub sum_x: i64,
    /// Sum of the lattice rows of its pixels.
    pub sum_y: i64,
    /// Lowest and highest lattice column.
    pub columns: [i64; 2],
    /// Lowest and highest lattice row.
    pub rows: [i64; 2],
}

/// The components of one tile and their traces on its four sides (0 for none, else 1 + the component's number).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileComponents {
    /// Lattice column and row of the tile's south-western pixel.
    pub corner: [i64; 2],
    /// Components, numbered by their first pixel in row order.
    pub components: Vec<Component>,
    /// Along the southern row, from west to east.
    pub south: Vec<u32>,
    /// Along the northern row, from west to east.
    pub north: Vec<u32>,
    /// Along the western column, from south to north.
    pub west: Vec<u32>,
    /// Along the eastern column, from south to north.
    pub east: Vec<u32>,
}

impl TileComponents {
    /// The components of the pixels for which `belongs` holds, and the raster of their traces (0 for none, else
    /// 1 + number). Linear in the pixels.
    #[must_use]
    pub fn of<T>(raster: &Raster<T>, belongs: impl Fn(&T) -> bool) -> (Self, Raster<u32>) {
        let window = raster.window();
        let found = components(raster, Connectivity::Four, belongs);
        let none =
            Component { pixels: 0, sum_x: 0, sum_y: 0, columns: [i64::MAX, i64::MIN], rows: [i64::MAX, i64::MIN] };
        let mut own = vec![none; found.list.len()];
        for row in 0..window.height {
            for (column, number) in found.numbers.row(row).iter().enumerate().filter(|(_, number)| **number != 0) {
                own[*number as usize - 1].add(window.x0 + column as i64, window.y0 + row as i64);
            }
        }
        let BorderTraces { south, north, west, east } = found.border_traces();
        let corner = [window.x0, window.y0];
        (Self { corner, components: own, south, north, west, east }, found.numbers)
    }

    /// Columns of the tile.
    #[must_use]
    pub fn width(&self) -> usize {
        self.south.len()
    }

    /// Rows of the tile.
    #[must_use]
    pub fn height(&self) -> usize {
        self.west.len()
    }

    /// The tile's window, for a pixel of `step` metres.
    #[must_use]
    pub fn window(&self, step: f64) -> GridWindow {
        GridWindow { step, x0: self.corner[0], y0: self.corner[1], width: self.width(), height: self.height() }
    }
}

impl Component {
    fn add(&mut self, x: i64, y: i64) {
        self.pixels += 1;
        self.sum_x += x;
        self.sum_y += y;
        self.columns = [self.columns[0].min(x), self.columns[1].max(x)];
        self.rows = [self.rows[0].min(y), self.rows[1].max(y)];
    }

    pub(crate) fn absorb(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.sum_x += other.sum_x;
        self.sum_y += other.sum_y;
        self.columns = [self.columns[0].min(other.columns[0]), self.columns[1].max(other.columns[1])];
        self.rows = [self.rows[0].min(other.rows[0]), self.rows[1].max(other.rows[1])];
    }
}
