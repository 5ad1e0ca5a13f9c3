//! Scan conversion: the pixel centres that a triangle covers, seen from above.

use gable_blocks::{BlockTriangle, UNITS_PER_METRE};
use gable_geometry::{DVec2, DVec3};
use gable_raster::GridWindow;
use std::ops::Range;

/// The largest whole number that is not larger; much faster than `f64::floor`, which is a call on plain x86-64.
#[inline]
pub(crate) fn floor(v: f64) -> i64 {
    let whole = v as i64;
    whole.saturating_sub(i64::from(whole as f64 > v))
}

/// One edge of the projection, from its southern to its northern end.
#[derive(Clone, Copy, Debug)]
struct Edge {
    from: DVec2,
    slope: f64,
    low: f64,
    high: f64,
}

impl Edge {
    fn new(from: DVec2, to: DVec2) -> Self {
        let rise = to.y - from.y;
        let slope = if rise > 0.0 { (to.x - from.x) / rise } else { 0.0 };
        Self { from, slope, low: from.x.min(to.x), high: from.x.max(to.x) }
    }

    /// Where the edge crosses a row.
    fn x_at(&self, y: f64) -> f64 {
        (self.from.x + (y - self.from.y) * self.slope).clamp(self.low, self.high)
    }
}

/// A triangle made ready for scanning.
///
/// A pixel is covered if its centre is inside the projection **or on its border**, so neighbours leave no crack. All
/// arithmetic starts from the corners (sorted by position) and from absolute lattice rows and columns: whether a
/// pixel is covered depends on the triangle and the pixel only, not on the window, the order of corners or the
/// order of triangles. Two triangles that share an edge round its crossings alike.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanTriangle {
    corners: [DVec2; 3],
    long: Edge,
    lower: Edge,
    upper: Edge,
}

impl ScanTriangle {
    /// `None` if the projection has no area.
    pub(crate) fn new(triangle: &BlockTriangle) -> Option<Self> {
        let mut flat = triangle.corners.map(|[x, y, _]| (y, x));
        flat.sort_unstable();
        let [a, b, c] = flat.map(|(y, x)| DVec2::new(f64::from(x), f64::from(y)) / UNITS_PER_METRE);
        // Differences of lattice coordinates are exact, and so is the sign of their cross product for triangles
        // of up to 8 km.
        ((b - a).perp_dot(c - a) != 0.0).then(|| Self {
            corners: [a, b, c],
            long: Edge::new(a, c),
            lower: Edge::new(a, b),
            upper: Edge::new(b, c),
        })
    }

    /// Calls `f(row, y, columns)` for each row of the window (counted in the window; `y` is that of the centres)
    /// in which the triangle covers pixels.
    #[inline]
    pub(crate) fn spans(&self, window: &GridWindow, mut f: impl FnMut(usize, f64, Range<usize>)) {
        let [a, b, c] = self.corners;
        let per_metre = 1.0 / window.step;
        let first = |v: f64, from: i64| ((v * per_metre - 0.5).ceil() as i64 - from).max(0);
        let last =
            |v: f64, from: i64, count: usize| ((v * per_metre - 0.5).floor() as i64 - from).min(count as i64 - 1);
        let rows = first(a.y, window.y0)..=last(c.y, window.y0, window.height);
        for row in rows {
            let y = ((window.y0 + row) as f64 + 0.5) * window.step;
            let short = if y < b.y || b.y == c.y { &self.lower } else { &self.upper };
            let (x, other) = (self.long.x_at(y), short.x_at(y));
            let from = first(x.min(other), window.x0);
            let to = last(x.max(other), window.x0, window.width);
            if from <= to {
                f(row as usize, y, from as usize..to as usize + 1);
            }
        }
    }
}

/// A quantity that varies linearly over a triangle's projection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gradients {
    origin: DVec2,
    /// Change of the two barycentric weights along x and y.
    first: DVec2,
    second: DVec2,
}

impl Gradients {
    /// Barycentric weights of corners 1 and 2 as linear functions of the ground; the projection must have area.
    pub(crate) fn new(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = corners.map(DVec3::truncate);
        let (u, v) = (b - a, c - a);
        let scale = 1.0 / u.perp_dot(v);
        Self { origin: a, first: DVec2::new(v.y, -v.x) * scale, second: DVec2::new(-u.y, u.x) * scale }
    }

    /// Weights of corners 1 and 2 at a point, kept inside the triangle.
    #[inline]
    pub(crate) fn weights(&self, p: DVec2) -> (f64, f64) {
        let d = p - self.origin;
        (d.dot(self.first).clamp(0.0, 1.0), d.dot(self.second).clamp(0.0, 1.0))
    }

    /// Value at corner 0 and slope of the linear function with the given values at the corners.
    pub(crate) fn slope(&self, values: [f64; 3]) -> DVec2 {
        self.first * (values[1] - values[0]) + self.second * (values[2] - values[0])
    }
}
