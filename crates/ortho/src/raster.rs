//! Rasters and the pixel lattice that they lie on.

use gable_geometry::{Box2, DVec2, dvec2};
use serde::{Deserialize, Serialize};

/// A rectangle of the absolute pixel lattice.
///
/// Pixel (i, j) of the lattice covers [i·step, (i+1)·step) × [j·step, (j+1)·step) in local metres: the lattice
/// hangs on the local origin, so a place has the same pixel however the city is cut into blocks.
/// Columns run east, rows run **north** (row 0 is the southern one).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridWindow {
    /// Edge of a pixel, metres.
    pub step: f64,
    /// Lattice column of the window's western pixels.
    pub x0: i64,
    /// Lattice row of the window's southern pixels.
    pub y0: i64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl GridWindow {
    /// The smallest window whose pixels cover a box.
    #[must_use]
    pub fn covering(bounds: Box2, step: f64) -> Self {
        let x0 = (bounds.min.x / step).floor() as i64;
        let y0 = (bounds.min.y / step).floor() as i64;
        let x1 = (bounds.max.x / step).ceil() as i64;
        let y1 = (bounds.max.y / step).ceil() as i64;
        Self { step, x0, y0, width: (x1 - x0).max(0) as usize, height: (y1 - y0).max(0) as usize }
    }

    /// Pixels in the window.
    #[must_use]
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// Whether the window has no pixel.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Local coordinates of a pixel's centre, `(column, row)` counted in the window.
    #[must_use]
    pub fn centre(&self, column: usize, row: usize) -> DVec2 {
        dvec2((self.x0 + column as i64) as f64 + 0.5, (self.y0 + row as i64) as f64 + 0.5) * self.step
    }

    /// The window's extent in local metres.
    #[must_use]
    pub fn bounds(&self) -> Box2 {
        let min = dvec2(self.x0 as f64, self.y0 as f64) * self.step;
        Box2 { min, max: min + dvec2(self.width as f64, self.height as f64) * self.step }
    }

    /// Column and row of the pixel that holds a point, if it is in the window.
    #[must_use]
    pub fn pixel(&self, p: DVec2) -> Option<(usize, usize)> {
        let x = (p.x / self.step).floor() as i64 - self.x0;
        let y = (p.y / self.step).floor() as i64 - self.y0;
        let inside = x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < self.height;
        inside.then_some((x as usize, y as usize))
    }

    /// The window grown by `margin` pixels on every side.
    #[must_use]
    pub fn grown(&self, margin: usize) -> Self {
        let m = margin as i64;
        Self {
            x0: self.x0 - m,
            y0: self.y0 - m,
            width: self.width + 2 * margin,
            height: self.height + 2 * margin,
            ..*self
        }
    }

    /// The pixels that two windows of the same step share.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        debug_assert_eq!(self.step, other.step);
        let x0 = self.x0.max(other.x0);
        let y0 = self.y0.max(other.y0);
        let x1 = (self.x0 + self.width as i64).min(other.x0 + other.width as i64);
        let y1 = (self.y0 + self.height as i64).min(other.y0 + other.height as i64);
        Self { step: self.step, x0, y0, width: (x1 - x0).max(0) as usize, height: (y1 - y0).max(0) as usize }
    }
}

/// Values on the pixels of a window, row by row from the south.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster<T> {
    window: GridWindow,
    values: Vec<T>,
}

impl<T: Clone> Raster<T> {
    /// A raster with the same value everywhere.
    #[must_use]
    pub fn filled(window: GridWindow, value: T) -> Self {
        Self { window, values: vec![value; window.len()] }
    }

    /// The part of this raster on `window`; `outside` where this raster has no pixel.
    #[must_use]
    pub fn crop(&self, window: GridWindow, outside: T) -> Self {
        let mut out = Self::filled(window, outside);
        out.paste(self);
        out
    }

    /// Copies the values of the pixels that `other` shares with this raster.
    pub fn paste(&mut self, other: &Self) {
        let shared = self.window.intersection(&other.window);
        for row in 0..shared.height {
            let y = shared.y0 + row as i64;
            let from = (y - other.window.y0) as usize * other.window.width + (shared.x0 - other.window.x0) as usize;
            let to = (y - self.window.y0) as usize * self.window.width + (shared.x0 - self.window.x0) as usize;
            self.values[to..to + shared.width].clone_from_slice(&other.values[from..from + shared.width]);
        }
    }
}

impl<T> Raster<T> {
    /// A raster from its values, row by row from the south.
    ///
    /// # Panics
    /// If the number of values is not the number of pixels.
    #[must_use]
    pub fn new(window: GridWindow, values: Vec<T>) -> Self {
        assert_eq!(values.len(), window.len(), "a raster needs one value for each pixel");
        Self { window, values }
    }

    /// The window.
    #[must_use]
    pub fn window(&self) -> GridWindow {
        self.window
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.window.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.window.height
    }

    /// All values, row by row from the south.
    #[must_use]
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, to be changed.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// One row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[T] {
        &self.values[row * self.window.width..][..self.window.width]
    }

    /// A raster on the same window, value by value.
    #[must_use]
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Raster<U> {
        Raster { window: self.window, values: self.values.iter().map(f).collect() }
    }

    /// The value of the pixel that holds a point.
    #[must_use]
    pub fn at(&self, p: DVec2) -> Option<&T> {
        self.window.pixel(p).map(|(x, y)| &self[(x, y)])
    }
}

impl<T> std::ops::Index<(usize, usize)> for Raster<T> {
    type Output = T;

    fn index(&self, (column, row): (usize, usize)) -> &T {
        debug_assert!(column < self.window.width);
        &self.values[row * self.window.width + column]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Raster<T> {
    fn index_mut(&mut self, (column, row): (usize, usize)) -> &mut T {
        debug_assert!(column < self.window.width);
        &mut self.values[row * self.window.width + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crop_takes_what_is_shared() {
        let window = GridWindow { step: 0.2, x0: -2, y0: 5, width: 4, height: 3 };
        let raster = Raster::new(window, (0..12).collect());
        let crop = raster.crop(GridWindow { x0: 0, y0: 4, width: 3, height: 2, ..window }, -1);
        assert_eq!(crop.values(), [-1, -1, -1, 2, 3, -1]);
        assert_eq!(window.pixel(window.centre(3, 2)), Some((3, 2)));
        assert_eq!(window.pixel(dvec2(-0.41, 1.1)), None);
        let covering = GridWindow::covering(window.bounds(), 0.2);
        assert_eq!((covering.x0, covering.y0), (-2, 5));
    }
}
