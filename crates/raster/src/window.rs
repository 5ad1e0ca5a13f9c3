//! Windows of the absolute pixel lattice.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_have_their_places_and_places_their_pixels() {
        let window = GridWindow { step: 0.2, x0: -2, y0: 5, width: 4, height: 3 };
        assert_eq!(window.pixel(window.centre(3, 2)), Some((3, 2)));
        assert_eq!(window.pixel(dvec2(-0.41, 1.1)), None);
        let covering = GridWindow::covering(window.bounds(), 0.2);
        assert_eq!((covering.x0, covering.y0), (-2, 5));
    }
}
