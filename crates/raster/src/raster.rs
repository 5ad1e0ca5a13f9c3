//! Values on the pixels of a window.

use crate::GridWindow;
use gable_geometry::DVec2;

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
        if shared.is_empty() {
            // It may have rows without columns, at a place that neither raster has.
            return;
        }
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
    }

    #[test]
    fn nothing_is_pasted_from_beside() {
        let window = GridWindow { step: 2.0, x0: 0, y0: 0, width: 4, height: 3 };
        let mut raster = Raster::filled(window, 1);
        for x0 in [-50, 50] {
            raster.paste(&Raster::filled(GridWindow { x0, ..window }, 2));
        }
        assert!(raster.values().iter().all(|&value| value == 1));
    }
}
