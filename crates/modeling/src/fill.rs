//! The pixels of a polygon, row by row.

use gable_geometry::{DVec2, Polygon};
use gable_raster::GridWindow;

/// Calls `found` with the column and row of each pixel of a window whose centre lies in a polygon, as
/// [`Polygon::contains`] tells. O(edges + crossings of edges with rows + pixels found).
pub(crate) fn pixels_inside(polygon: &Polygon, window: GridWindow, mut found: impl FnMut(usize, usize)) {
    if window.width == 0 || window.height == 0 {
        return;
    }
    let first = window.centre(0, 0).y;
    let row = |y: f64| (((y - first) / window.step).max(0.0) as usize).min(window.height);
    // Where the rings cross each row, with the number of the ring.
    let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); window.height];
    for (number, ring) in polygon.rings().enumerate() {
        for (i, &a) in ring.iter().enumerate() {
            let b = ring[(i + ring.len() - 1) % ring.len()];
            for y in row(a.y.min(b.y) - window.step)..row(a.y.max(b.y) + 2.0 * window.step) {
                rows[y].extend(crossing(a, b, window.centre(0, y).y).map(|x| (number, x)));
            }
        }
    }
    for (y, crossings) in rows.iter_mut().enumerate() {
        crossings.sort_by(|p, q| p.0.cmp(&q.0).then(p.1.total_cmp(&q.1)));
        let mut rings = crossings.chunk_by(|p, q| p.0 == q.0);
        let Some(outer) = rings.next().filter(|outer| outer[0].0 == 0) else { continue };
        let mut holes: Vec<bool> = Vec::new();
        for hole in rings {
            holes.resize(window.width, false);
            spans(hole, window, y, |x| holes[x] = true);
        }
        spans(outer, window, y, |x| {
            if !holes.get(x).copied().unwrap_or(false) {
                found(x, y);
            }
        });
    }
}

/// Where an edge crosses the height `y`; an even-odd rule counts it for all points to the west of there.
fn crossing(a: DVec2, b: DVec2, y: f64) -> Option<f64> {
    ((a.y > y) != (b.y > y)).then(|| (b.x - a.x) * (y - a.y) / (b.y - a.y) + a.x)
}

/// The columns of a row that have an odd number of crossings to the east.
fn spans(crossings: &[(usize, f64)], window: GridWindow, y: usize, mut inside: impl FnMut(usize)) {
    let first = window.centre(0, y).x;
    for pair in crossings.chunks_exact(2) {
        let (west, east) = (pair[0].1, pair[1].1);
        let from = ((west - first) / window.step - 1.0).max(0.0) as usize;
        for x in from..window.width {
            let at = window.centre(x, y).x;
            if at >= east {
                break;
            }
            if at >= west {
                inside(x);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, dvec2};

    #[test]
    fn equals_the_test_of_each_pixel() {
        let window = GridWindow { step: 0.2, x0: -40, y0: -30, width: 90, height: 70 };
        for seed in 0..20 {
            let mut rng = Counter::new(seed);
            let mut ring = |middle: DVec2, size: f64, corners: usize| -> Vec<DVec2> {
                let corner = |k: usize| {
                    let angle = std::f64::consts::TAU * k as f64 / corners as f64;
                    middle + size * rng.range(0.4, 1.0) * DVec2::from_angle(angle)
                };
                (0..corners).map(corner).collect()
            };
            // Some corners lie on centres of pixels, and some of the polygon outside of the window.
            let mut outer = ring(dvec2(0.5, 0.5), 9.0, 11);
            outer[3] = dvec2(3.1, 4.1);
            let polygon = Polygon { outer, holes: vec![ring(dvec2(1.0, 0.0), 2.0, 5), ring(dvec2(-2.0, 1.0), 1.5, 4)] };
            let mut found = vec![false; window.len()];
            pixels_inside(&polygon, window, |x, y| found[y * window.width + x] = true);
            for (p, found) in found.into_iter().enumerate() {
                let (x, y) = (p % window.width, p / window.width);
                assert_eq!(found, polygon.contains(window.centre(x, y)), "{seed}: {x}, {y}");
            }
        }
    }
}
