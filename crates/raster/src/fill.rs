//! Smooth filling of the places where a raster has no value.

use crate::bilinear::bilinear;

/// Replaces every NaN of `values` (rows of `width`) by a smooth continuation of the values around it.
///
/// Two passes over a pyramid: means of 2 × 2 cells that skip what is missing, up to a single cell; then back down, each
/// missing cell taking the bilinear value of the level above, and `sweeps` Gauss–Seidel sweeps of Laplace's equation
/// over the missing cells only. Values that are there are never changed. Nothing happens if all are missing.
/// Cost: O(cells · (1 + sweeps · missing share)).
///
/// ```
/// let mut heights = [2.0, 2.0, f32::NAN, 2.0];
/// gable_raster::fill_missing(&mut heights, 4, 1, 4);
/// assert_eq!(heights, [2.0; 4]);
/// ```
pub fn fill_missing(values: &mut [f32], width: usize, height: usize, sweeps: usize) {
    if values.iter().all(|v| !v.is_nan()) || values.iter().all(|v| v.is_nan()) {
        return;
    }
    let (cw, ch) = (width.div_ceil(2), height.div_ceil(2));
    let mut coarse = vec![f32::NAN; cw * ch];
    for y in 0..ch {
        for x in 0..cw {
            let (mut sum, mut n) = (0.0, 0.0);
            for v in 2 * y..(2 * y + 2).min(height) {
                for u in 2 * x..(2 * x + 2).min(width) {
                    let value = values[v * width + u];
                    if !value.is_nan() {
                        sum += value;
                        n += 1.0;
                    }
                }
            }
            coarse[y * cw + x] = sum / n;
        }
    }
    fill_missing(&mut coarse, cw, ch, sweeps);
    let mut missing = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            if values[i].is_nan() {
                values[i] = bilinear(&coarse, cw, ch, 0.5 * x as f32 - 0.25, 0.5 * y as f32 - 0.25);
                missing.push(i);
            }
        }
    }
    for _ in 0..sweeps {
        for &i in &missing {
            let (x, y) = (i % width, i / width);
            let west = values[if x > 0 { i - 1 } else { i }];
            let east = values[if x + 1 < width { i + 1 } else { i }];
            let south = values[if y > 0 { i - width } else { i }];
            let north = values[if y + 1 < height { i + width } else { i }];
            values[i] = 0.25 * (west + east + south + north);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_in_a_slope_is_filled_with_the_slope() {
        let (w, h) = (64, 48);
        let plane = |i: usize| 0.3 * (i % w) as f32 - 0.1 * (i / w) as f32 + 5.0;
        let mut values: Vec<f32> = (0..w * h).map(plane).collect();
        for y in 15..33 {
            for x in 20..45 {
                values[y * w + x] = f32::NAN;
            }
        }
        fill_missing(&mut values, w, h, 30);
        for (i, v) in values.iter().enumerate() {
            assert!((v - plane(i)).abs() < 0.35, "{i}: {v} {}", plane(i));
        }
        // Outside the hole nothing changed.
        assert_eq!(values[0], plane(0));
    }

    #[test]
    fn all_missing_stays_missing() {
        let mut values = vec![f32::NAN; 12];
        fill_missing(&mut values, 4, 3, 3);
        assert!(values.iter().all(|v| v.is_nan()));
    }
}
