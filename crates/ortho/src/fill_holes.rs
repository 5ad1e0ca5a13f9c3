//! Closes small holes of a height map.

use gable_raster::{Connectivity, Raster, flood};

/// Steps east and north of the sixteen directions in which a hole's rim is looked for.
const DIRECTIONS: [(i64, i64); 16] = [
    (1, 0),
    (2, 1),
    (1, 1),
    (1, 2),
    (0, 1),
    (-1, 2),
    (-1, 1),
    (-2, 1),
    (-1, 0),
    (-2, -1),
    (-1, -1),
    (-1, -2),
    (0, -1),
    (1, -2),
    (1, -1),
    (2, -1),
];

/// Rim heights that differ by less belong to the same surface, metres.
const SAME_SURFACE: f32 = 1.0;

/// Fills holes (4-connected NaN pixels) of at most `max_area` m² that do not touch the raster's border.
///
/// Each pixel looks for the rim in sixteen directions. The surface that the hole lies in is the one of the median rim
/// height, weighted by nearness; the pixel becomes the mean of the rim heights within 1 m of it, weighted by the
/// inverse square of the distance. A hole at the foot of a wall is so closed by the ground or by the roof, whichever it
/// borders on more, and never by a ramp between them.
///
/// Only the hole and its rim decide, so a window that holds both gives the same values; holes reach at most
/// `max_area / step²` pixels. Returns the filled map and which pixels were filled. Cost: O(pixels), and for each filled
/// one the hole's diameter.
#[must_use]
pub fn fill_holes(height: &Raster<f32>, max_area: f64) -> (Raster<f32>, Raster<bool>) {
    let window = height.window();
    let max_pixels = (max_area / (window.step * window.step)).round() as usize;
    let mut filled = height.clone();
    let mut changed = Raster::filled(window, false);
    let mut seen = vec![false; window.len()];
    let mut hole = Vec::new();
    for start in 0..window.len() {
        if seen[start] || !height.values()[start].is_nan() {
            continue;
        }
        if !gather(height, start, &mut seen, &mut hole) || hole.len() > max_pixels {
            continue;
        }
        for &pixel in &hole {
            let (x, y) = (pixel % window.width, pixel / window.width);
            if let Some(h) = interpolate(height, x, y, hole.len()) {
                filled[(x, y)] = h;
                changed[(x, y)] = true;
            }
        }
    }
    (filled, changed)
}

/// The hole that a pixel lies in; whether it stays clear of the border.
fn gather(height: &Raster<f32>, start: usize, seen: &mut [bool], hole: &mut Vec<usize>) -> bool {
    let (width, rows) = (height.width(), height.height());
    seen[start] = true;
    flood(start, width, rows, Connectivity::Four, hole, |pixel| {
        height.values()[pixel].is_nan() && !std::mem::replace(&mut seen[pixel], true)
    });
    let is_inner = |x: usize, y: usize| x > 0 && y > 0 && x + 1 < width && y + 1 < rows;
    hole.iter().all(|pixel| is_inner(pixel % width, pixel / width))
}

fn interpolate(height: &Raster<f32>, x: usize, y: usize, reach: usize) -> Option<f32> {
    let mut rim: Vec<(f32, f64)> = Vec::with_capacity(DIRECTIONS.len());
    for (dx, dy) in DIRECTIONS {
        for k in 1..=reach as i64 + 1 {
            let (nx, ny) = (x as i64 + k * dx, y as i64 + k * dy);
            if nx < 0 || ny < 0 || nx >= height.width() as i64 || ny >= height.height() as i64 {
                break;
            }
            let h = height[(nx as usize, ny as usize)];
            if !h.is_nan() {
                rim.push((h, 1.0 / (k * k * (dx * dx + dy * dy)) as f64));
                break;
            }
        }
    }
    rim.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * rim.iter().map(|r| r.1.sqrt()).sum::<f64>();
    let mut sum = 0.0;
    let median = rim.iter().find(|r| {
        sum += r.1.sqrt();
        sum >= half
    })?;
    let near = rim.iter().filter(|r| (r.0 - median.0).abs() <= SAME_SURFACE);
    let (h, w) = near.fold((0.0, 0.0), |(h, w), r| (h + r.1 * f64::from(r.0), w + r.1));
    Some((h / w) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;

    #[test]
    fn holes_get_the_surface_around_them() {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 40, height: 30 };
        let wall = |x: usize| if x < 20 { 10.0 + 0.1 * x as f32 } else { 0.0 };
        let mut h = Raster::new(window, (0..window.len()).map(|i| wall(i % 40)).collect());
        let mut dig = |x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
            y.for_each(|y| x.clone().for_each(|x| h[(x, y)] = f32::NAN));
        };
        dig(5..9, 5..9);
        dig(20..24, 10..14);
        dig(30..40, 3..5);
        dig(26..38, 8..20);
        let (filled, changed) = fill_holes(&h, 2.0);
        for y in 5..9 {
            for x in 5..9 {
                assert!((filled[(x, y)] - wall(x)).abs() < 0.1, "the slope goes on");
                assert!(changed[(x, y)]);
            }
        }
        assert!((10..14).all(|y| (20..24).all(|x| filled[(x, y)].abs() < 0.01 || filled[(x, y)] > 11.0)), "no ramp");
        assert!(filled[(22, 12)] == 0.0);
        assert!(filled[(35, 4)].is_nan(), "open to the border");
        assert!(filled[(30, 12)].is_nan(), "too large");
        assert_eq!(changed.values().iter().filter(|&&c| c).count(), 32);
    }
}
