//! Boundary rings of a mask, along the cracks between pixels.

use gable_geometry::{DVec2, dvec2, ring_area};
use gable_raster::Raster;

/// A closed boundary: one point at each corner of a pixel that it passes, first point not repeated.
///
/// The mask lies to the left: outer rings run counter-clockwise, holes clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    /// Pixel corners in order, local metres.
    pub points: Vec<DVec2>,
}

impl Ring {
    /// Signed area in m², negative for a hole.
    #[must_use]
    pub fn area(&self) -> f64 {
        ring_area(&self.points)
    }

    /// Whether it bounds a hole.
    #[must_use]
    pub fn is_hole(&self) -> bool {
        self.area() < 0.0
    }

    /// Middles of the cracks: the marching-squares contour of the mask. Along slanted boundaries they follow the
    /// line twice as closely as the corners do.
    #[must_use]
    pub fn middles(&self) -> Vec<DVec2> {
        let p = &self.points;
        (0..p.len()).map(|i| 0.5 * (p[i] + p[(i + 1) % p.len()])).collect()
    }
}

/// Directions of travel: east, north, west, south.
const MOVES: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// All boundary rings of the pixels that are `true`; what is outside of the window counts as `false`.
///
/// Pixels hang together by their edges (4-connected): where two touch at a corner only, the rings touch there but
/// do not cross. Each ring starts at its southernmost, then westernmost eastward crack, and rings come in that order,
/// so the result depends on the mask only. Cost: O(pixels).
#[must_use]
pub fn trace_outline(mask: &Raster<bool>) -> Vec<Ring> {
    trace_regions(mask, false).into_iter().map(|(_, ring)| ring).collect()
}

/// The boundary rings of all pixels of each value, as [`trace_outline`] finds them for one, with the value. Pixels that are
/// `none` have no boundary of their own, and what is outside of the window counts as such. Rings come in the order of
/// their first cracks, whatever their values. Cost: O(pixels).
#[must_use]
pub fn trace_regions<T: Copy + PartialEq>(values: &Raster<T>, none: T) -> Vec<(T, Ring)> {
    let window = values.window();
    let (width, height) = (window.width as i64, window.height as i64);
    let at = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && x < width && y < height;
        if inside { values[(x as usize, y as usize)] } else { none }
    };
    let local = |x: i64, y: i64| dvec2((window.x0 + x) as f64, (window.y0 + y) as f64) * window.step;
    let mut rings = Vec::new();
    // Every ring has an eastward crack: the lower edge of a pixel whose southern neighbour is outside.
    let mut traced = Raster::filled(window, false);
    for y in 0..height {
        for x in 0..width {
            let value = at(x, y);
            if value == none || at(x, y - 1) == value || traced[(x as usize, y as usize)] {
                continue;
            }
            let inside = |x: i64, y: i64| at(x, y) == value;
            // Pixels left and right of the crack that leaves corner (x, y) in direction d.
            let left = |x: i64, y: i64, d: usize| inside(x - i64::from(d == 1 || d == 2), y - i64::from(d >= 2));
            let right = |x: i64, y: i64, d: usize| inside(x - i64::from(d >= 2), y - i64::from(d == 0 || d == 3));
            let (mut cx, mut cy, mut d) = (x, y, 0);
            let mut points = Vec::new();
            loop {
                points.push(local(cx, cy));
                if d == 0 {
                    traced[(cx as usize, cy as usize)] = true;
                }
                cx += MOVES[d].0;
                cy += MOVES[d].1;
                // The sharpest left turn first keeps to the same 4-connected piece.
                d = [1, 0, 3]
                    .into_iter()
                    .map(|turn| (d + turn) % 4)
                    .find(|&next| left(cx, cy, next) && !right(cx, cy, next))
                    .unwrap_or((d + 2) % 4);
                if (cx, cy, d) == (x, y, 0) {
                    break;
                }
            }
            rings.push((value, Ring { points }));
        }
    }
    rings
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;
    use proptest::prelude::*;

    fn mask(rows: &[&str]) -> Raster<bool> {
        let window = GridWindow { step: 0.5, x0: -1, y0: 2, width: rows[0].len(), height: rows.len() };
        Raster::new(window, rows.iter().rev().flat_map(|r| r.bytes().map(|b| b == b'#')).collect())
    }

    #[test]
    fn a_ring_with_a_hole() {
        let rings = trace_outline(&mask(&["....", "####", "#..#", "####"]));
        assert_eq!(rings.len(), 2);
        assert_eq!((rings[0].area(), rings[1].area()), (3.0, -0.5));
        assert!(!rings[0].is_hole() && rings[1].is_hole());
        assert_eq!(rings[0].points[0], dvec2(-0.5, 1.0));
        assert_eq!(rings[0].points.len(), 14);
        assert_eq!(rings[0].middles()[0], dvec2(-0.25, 1.0));
    }

    #[test]
    fn corners_that_touch_are_kept_apart() {
        let rings = trace_outline(&mask(&["#.", ".#"]));
        assert_eq!(rings.iter().map(Ring::area).collect::<Vec<_>>(), [0.25, 0.25]);
        // The diagonal gap joins the hole to the outside: pixels outside hang together by corners too.
        let rings = trace_outline(&mask(&["###", "#.#", "##."]));
        assert_eq!(rings.len(), 1);
        assert_eq!(rings[0].area(), 0.25 * 7.0);
    }

    proptest! {
        #[test]
        fn rings_hold_the_area_and_every_crack_once(bits in prop::collection::vec(any::<bool>(), 63)) {
            let window = GridWindow { step: 1.0, x0: 0, y0: 0, width: 9, height: 7 };
            let mask = Raster::new(window, bits);
            let rings = trace_outline(&mask);
            let area: f64 = rings.iter().map(Ring::area).sum();
            let count = mask.values().iter().filter(|&&m| m).count();
            prop_assert_eq!(area, count as f64);
            let at = |x: i64, y: i64| (0..9).contains(&x) && (0..7).contains(&y) && mask[(x as usize, y as usize)];
            let cracks: usize = (-1..9)
                .flat_map(|x| (-1..7).map(move |y| (x, y)))
                .map(|(x, y)| usize::from(at(x, y) != at(x + 1, y)) + usize::from(at(x, y) != at(x, y + 1)))
                .sum();
            prop_assert_eq!(rings.iter().map(|r| r.points.len()).sum::<usize>(), cracks);
            let mut seen: Vec<_> = rings
                .iter()
                .flat_map(|r| (0..r.points.len()).map(|i| (r.points[i], r.points[(i + 1) % r.points.len()])))
                .map(|(a, b)| (a.x as i64, a.y as i64, b.x as i64, b.y as i64))
                .collect();
            seen.sort_unstable();
            seen.dedup();
            prop_assert_eq!(seen.len(), cracks);
        }
    }
}
