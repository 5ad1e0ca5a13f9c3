//! Least-squares planes of the heights in square windows.
//!
//! On a full square window x, y and 1 are orthogonal, so that the plane follows from four sums: this is
//! [`Covariance3::height_plane`](gable_geometry::Covariance3::height_plane) where each pixel has a height.

/// Least-squares plane of the heights in a square window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WindowPlane {
    /// Rise towards east and north, height units per pixel.
    pub slope: [f32; 2],
    /// Rms distance in z, height units.
    pub residual: f32,
}

/// Sums over the heights z of a square window, x and y in pixels from its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowSums {
    /// Pixels a side.
    pub side: f64,
    /// Σz.
    pub z: f64,
    /// Σz².
    pub zz: f64,
    /// Σx·z.
    pub xz: f64,
    /// Σy·z.
    pub yz: f64,
}

impl WindowSums {
    /// Σx² over the window, which is also Σy².
    #[inline]
    fn spread(&self) -> f64 {
        self.side * self.side * (self.side * self.side - 1.0) / 12.0
    }

    /// Rise of the least-squares plane towards east and north, height units per pixel.
    #[inline]
    #[must_use]
    pub fn slope(&self) -> [f64; 2] {
        [self.xz / self.spread(), self.yz / self.spread()]
    }

    /// Sum of the squared distances in z from the least-squares plane, not negative.
    #[inline]
    #[must_use]
    pub fn squares(&self) -> f64 {
        let rise = (self.xz * self.xz + self.yz * self.yz) / self.spread();
        (self.zz - self.z * self.z / (self.side * self.side) - rise).max(0.0)
    }
}

/// Rms distance in z of the heights in the square window around each pixel to their least-squares plane, see [`window_planes`].
///
/// ```
/// // Without a spike in reach the heights lie on a plane.
/// let heights = [0.0, 1.0, 2.0, 3.0, 9.0, 5.0];
/// let residual = gable_raster::plane_residual(&heights, 6, 1, 1);
/// assert!(residual[1] < 1e-3 && residual[4] > 1.0);
/// ```
#[must_use]
pub fn plane_residual(heights: &[f32], width: usize, height: usize, radius: usize) -> Vec<f32> {
    window_planes(heights, width, height, radius, |plane| plane.residual)
}

/// The planes of the windows around all pixels, each mapped by `what`.
///
/// `heights` are rows of `width` pixels without NaN; the window has `2·radius + 1` pixels a side and the border is continued by its
/// own values. Rows use prefix sums, columns running ones, in f64: O(pixels), whatever the radius, which has to be 1 at least.
///
/// ```
/// let heights: Vec<f32> = (0..25).map(|pixel| 0.5 * (pixel % 5) as f32).collect();
/// let slopes = gable_raster::window_planes(&heights, 5, 5, 1, |plane| plane.slope);
/// assert_eq!(slopes[12], [0.5, 0.0]);
/// ```
#[must_use]
pub fn window_planes<T: Clone + Default>(
    heights: &[f32],
    width: usize,
    height: usize,
    radius: usize,
    what: impl Fn(WindowPlane) -> T,
) -> Vec<T> {
    let side = (2 * radius + 1) as f64;
    let n = side * side;
    let mut out = vec![T::default(); heights.len()];
    // Running sums down each column: Σz, Σz², Σdx·z, Σy·z.
    let mut sums = vec![[0.0_f64; 4]; width];
    let mut row = vec![[0.0_f64; 3]; width];
    let mut prefix = Vec::new();
    let r = radius as i64;
    for y in -r..height as i64 + r {
        let mut apply = |at: i64, sign: f64, sums: &mut [[f64; 4]]| {
            let source = at.clamp(0, height as i64 - 1) as usize;
            row_sums(&heights[source * width..][..width], radius, &mut prefix, &mut row);
            for (sum, [z, zz, xz]) in sums.iter_mut().zip(&row) {
                sum[0] += sign * z;
                sum[1] += sign * zz;
                sum[2] += sign * xz;
                sum[3] += sign * (at as f64) * z;
            }
        };
        apply(y, 1.0, &mut sums);
        if y - 2 * r > -r {
            apply(y - 2 * r - 1, -1.0, &mut sums);
        }
        let centre = y - r;
        if centre >= 0 {
            for (out, [z, zz, xz, yz]) in out[centre as usize * width..][..width].iter_mut().zip(&sums) {
                let sums = WindowSums { side, z: *z, zz: *zz, xz: *xz, yz: yz - centre as f64 * z };
                let residual = (sums.squares() / n).sqrt() as f32;
                *out = what(WindowPlane { slope: sums.slope().map(|s| s as f32), residual });
            }
        }
    }
    out
}

// Σz, Σz² and Σ(x − centre)·z over the window of each pixel of one row.
fn row_sums(row: &[f32], radius: usize, prefix: &mut Vec<[f64; 3]>, out: &mut [[f64; 3]]) {
    let width = row.len();
    let padded = width + 2 * radius;
    prefix.clear();
    prefix.push([0.0; 3]);
    let mut sum = [0.0; 3];
    for x in 0..padded {
        let z = f64::from(row[x.saturating_sub(radius).min(width - 1)]);
        sum = [sum[0] + z, sum[1] + z * z, sum[2] + x as f64 * z];
        prefix.push(sum);
    }
    for (x, out) in out.iter_mut().enumerate() {
        let (low, high) = (prefix[x], prefix[x + 2 * radius + 1]);
        let z = high[0] - low[0];
        *out = [z, high[1] - low[1], high[2] - low[2] - (x + radius) as f64 * z];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, Covariance3, dvec2};

    #[test]
    fn a_plane_has_no_residual_and_a_checkerboard_its_amplitude() {
        let (w, h) = (30, 24);
        let plane: Vec<f32> = (0..w * h).map(|i| 400.0 + 0.4 * (i % w) as f32 - 0.2 * (i / w) as f32).collect();
        let fit = window_planes(&plane, w, h, 3, |fit| fit)[12 * w + 15];
        assert!(fit.residual < 1e-3 && (fit.slope[0] - 0.4).abs() < 1e-4 && (fit.slope[1] + 0.2).abs() < 1e-4);
        let board: Vec<f32> =
            plane.iter().enumerate().map(|(i, z)| z + 0.1 * (1 - 2 * ((i % w + i / w) % 2) as i32) as f32).collect();
        let rough = plane_residual(&board, w, h, 3);
        assert!((rough[12 * w + 15] - 0.1).abs() < 2e-3, "{}", rough[12 * w + 15]);
    }

    #[test]
    fn equals_the_fit_to_the_points_of_each_window() {
        let (w, h) = (19, 13);
        let mut random = Counter::new(11);
        let values: Vec<f32> = (0..w * h).map(|_| random.range(-1.0, 3.0) as f32).collect();
        for radius in [1, 2, 5, 8] {
            let fits = window_planes(&values, w, h, radius, |fit| fit);
            let r = radius as i64;
            for y in 0..h as i64 {
                for x in 0..w as i64 {
                    let mut points = Covariance3::default();
                    for dy in -r..=r {
                        for dx in -r..=r {
                            let (u, v) = ((x + dx).clamp(0, w as i64 - 1), (y + dy).clamp(0, h as i64 - 1));
                            let z = f64::from(values[v as usize * w + u as usize]);
                            points.add(dvec2(dx as f64, dy as f64).extend(z), 1.0);
                        }
                    }
                    let plane = points.height_plane().expect("there are points");
                    let [_, _, xz, _, yz, zz] = points.matrix();
                    let residual = (zz - plane.a * xz - plane.b * yz).sqrt();
                    let fit = fits[y as usize * w + x as usize];
                    assert!((f64::from(fit.residual) - residual).abs() < 1e-5);
                    assert!((f64::from(fit.slope[0]) - plane.a).abs() < 1e-5);
                    assert!((f64::from(fit.slope[1]) - plane.b).abs() < 1e-5);
                }
            }
        }
    }
}
