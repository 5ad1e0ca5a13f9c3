//! Least-squares planes in a small window around every pixel, chosen so that edges stay sharp.

use gable_geometry::least_squares_slopes;
use gable_raster::Raster;

/// The surface as one pixel sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// Height at the pixel's centre, metres above the field's reference.
    pub(crate) h: f32,
    /// Slope along x.
    pub(crate) a: f32,
    /// Slope along y.
    pub(crate) b: f32,
    /// Mean squared orthogonal residual of the window, m²; infinite where no window could be fitted.
    pub(crate) residual: f32,
}

const NOWHERE: Patch = Patch { h: f32::NAN, a: 0.0, b: 0.0, residual: f32::INFINITY };

/// Heights of one building with a patch for every pixel.
///
/// Coordinates inside: pixel (i, j) lies at (i·step, j·step), heights are relative to `reference`.
pub(crate) struct Field {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) step: f64,
    /// Height that counts as 0, metres.
    pub(crate) reference: f64,
    /// Heights; NaN outside the mask.
    pub(crate) z: Vec<f32>,
    pub(crate) patches: Vec<Patch>,
    /// The pixels of the building, in the order of the raster.
    pub(crate) inside: Vec<u32>,
    /// Variance of the coordinates of a full window along each axis, m².
    pub(crate) spread: f32,
}

impl Field {
    /// Fits patches in windows of `2·radius` metres.
    pub(crate) fn new(height: &Raster<f32>, mask: &Raster<bool>, radius: f64) -> Self {
        let window = height.window();
        let inside = |i: usize| mask.values()[i] && height.values()[i].is_finite();
        let inside: Vec<u32> = (0..window.len()).filter(|&i| inside(i)).map(|i| i as u32).collect();
        let sum: f64 = inside.iter().map(|&p| f64::from(height.values()[p as usize])).sum();
        let reference = (sum / inside.len().max(1) as f64).round();
        let mut z = vec![f32::NAN; window.len()];
        for &p in &inside {
            z[p as usize] = (f64::from(height.values()[p as usize]) - reference) as f32;
        }
        let r = ((radius / window.step).round() as usize).max(1);
        let n = (2 * r + 1) as f64;
        let mut field = Self {
            width: window.width,
            height: window.height,
            step: window.step,
            reference,
            z,
            patches: Vec::new(),
            inside,
            spread: ((n * n - 1.0) / 12.0 * window.step * window.step) as f32,
        };
        let centred = field.centred_fits(r);
        field.patches = field.choose(&centred, r);
        field
    }

    /// Ground coordinates of a pixel.
    pub(crate) fn position(&self, pixel: usize) -> (f64, f64) {
        ((pixel % self.width) as f64 * self.step, (pixel / self.width) as f64 * self.step)
    }

    /// Squared orthogonal distance of a pixel's patch to a plane z = a·x + b·y + c, averaged over the patch:
    /// distance at the pixel plus the difference in slope times the window's variance.
    pub(crate) fn misfit(&self, pixel: usize, [a, b, c]: [f64; 3]) -> f64 {
        let p = &self.patches[pixel];
        let (x, y) = self.position(pixel);
        let d = f64::from(p.h) - (a * x + b * y + c);
        let (da, db) = (f64::from(p.a) - a, f64::from(p.b) - b);
        (d * d + f64::from(self.spread) * (da * da + db * db)) / (1.0 + a * a + b * b)
    }

    /// The plane of the window around each pixel, by moving sums: first along the rows, then across them.
    fn centred_fits(&self, r: usize) -> Vec<Patch> {
        let (w, h) = (self.width, self.height);
        // Sums over 2r + 1 pixels of a row: 1, x, x², z, x·z, z² with x in pixels from the middle.
        let mut rows = vec![[0f32; 6]; w * h];
        for j in 0..h {
            let line = &self.z[j * w..][..w];
            // Pixels off the building need sums only within reach of it along the column; those without any
            // pixel in their own row's window keep zeros.
            let Some(first) = line.iter().position(|z| !z.is_nan()) else { continue };
            let last = line.iter().rposition(|z| !z.is_nan()).unwrap_or(first);
            for i in first.saturating_sub(r)..(last + r + 1).min(w) {
                let s = &mut rows[j * w + i];
                for k in i.saturating_sub(r)..(i + r + 1).min(w) {
                    let z = line[k];
                    if z.is_nan() {
                        continue;
                    }
                    let x = k as f32 - i as f32;
                    s[0] += 1.0;
                    s[1] += x;
                    s[2] += x * x;
                    s[3] += z;
                    s[4] += x * z;
                    s[5] += z * z;
                }
            }
        }
        let enough = 0.35 * ((2 * r + 1) * (2 * r + 1)) as f64;
        let mut out = vec![NOWHERE; w * h];
        for &p in &self.inside {
            let (i, j) = (p as usize % w, p as usize / w);
            let mut s = [0f64; 6];
            let (mut y1, mut yx, mut yy, mut yz) = (0.0, 0.0, 0.0, 0.0);
            for k in j.saturating_sub(r)..(j + r + 1).min(h) {
                let q = &rows[k * w + i];
                let y = k as f64 - j as f64;
                for (sum, &v) in s.iter_mut().zip(q) {
                    *sum += f64::from(v);
                }
                y1 += y * f64::from(q[0]);
                yx += y * f64::from(q[1]);
                yy += y * y * f64::from(q[0]);
                yz += y * f64::from(q[3]);
            }
            if s[0] >= enough {
                out[p as usize] = self.solve(s, [y1, yx, yy, yz]);
            }
        }
        out
    }

    fn solve(&self, [n, x1, xx, z1, xz, zz]: [f64; 6], [y1, yx, yy, yz]: [f64; 4]) -> Patch {
        let (mx, my, mz) = (x1 / n, y1 / n, z1 / n);
        // A ridge of a hundredth of a pixel² keeps windows whose pixels lie on a line solvable.
        let (cxx, cyy, cxy) = (xx / n - mx * mx + 0.01, yy / n - my * my + 0.01, yx / n - mx * my);
        let (cxz, cyz, czz) = (xz / n - mx * mz, yz / n - my * mz, zz / n - mz * mz);
        let [a, b] = least_squares_slopes([cxx, cxy, cyy], [cxz, cyz]);
        let slope2 = (a * a + b * b) / (self.step * self.step);
        let residual = (czz - a * cxz - b * cyz).max(0.0) * n / (n - 3.0).max(1.0) / (1.0 + slope2);
        Patch {
            h: (mz - a * mx - b * my) as f32,
            a: (a / self.step) as f32,
            b: (b / self.step) as f32,
            residual: residual as f32,
        }
    }

    /// For each pixel the plane of the best of nine windows that hold it (the one around it and eight to whose
    /// borders it belongs), after Kuwahara's filter: beside an edge, one of them does not cross it.
    fn choose(&self, centred: &[Patch], r: usize) -> Vec<Patch> {
        let (w, h, r) = (self.width as isize, self.height as isize, r as isize);
        let mut out = centred.to_vec();
        for &p in &self.inside {
            let at = p as usize;
            let (i, j) = (at as isize % w, at as isize / w);
            // The middle window is the most accurate one: others must be clearly better.
            let mut best = 0.6 * centred[at].residual;
            for (di, dj) in [(-r, -r), (0, -r), (r, -r), (-r, 0), (r, 0), (-r, r), (0, r), (r, r)] {
                let (u, v) = (i + di, j + dj);
                if u < 0 || v < 0 || u >= w || v >= h {
                    continue;
                }
                let q = &centred[(v * w + u) as usize];
                if q.residual < best {
                    best = q.residual;
                    let (dx, dy) = (-(di as f32) * self.step as f32, -(dj as f32) * self.step as f32);
                    out[at] = Patch { h: q.h + q.a * dx + q.b * dy, ..*q };
                }
            }
            if out[at].h.is_nan() {
                // Too few neighbours for a window anywhere: the pixel's own height is all there is.
                out[at].h = self.z[at];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, Covariance3, dvec3};
    use gable_raster::GridWindow;

    #[test]
    fn moving_sums_agree_with_a_fit_of_each_window() {
        let window = GridWindow { step: 0.2, x0: 31, y0: -7, width: 23, height: 17 };
        let mut rng = Counter::new(8);
        let height = Raster::new(window, (0..window.len()).map(|_| 50.0 + rng.unit() as f32).collect());
        let mask = Raster::new(window, (0..window.len()).map(|_| rng.unit() < 0.8).collect());
        let field = Field::new(&height, &mask, 0.4);
        let fits = field.centred_fits(2);
        for &p in &field.inside {
            let (i, j) = (p as usize % 23, p as usize / 23);
            let mut sums = Covariance3::default();
            for v in j.saturating_sub(2)..(j + 3).min(17) {
                for u in i.saturating_sub(2)..(i + 3).min(23) {
                    if mask[(u, v)] {
                        let (x, y) = field.position(v * 23 + u);
                        sums.add(dvec3(x, y, f64::from(field.z[v * 23 + u])), 1.0);
                    }
                }
            }
            let patch = fits[p as usize];
            if sums.weight() < 0.35 * 25.0 {
                assert!(patch.h.is_nan());
                continue;
            }
            let plane = sums.height_plane().unwrap();
            let (x, y) = field.position(p as usize);
            // The small ridge of the fast fit moves slopes by a percent.
            assert!((f64::from(patch.h) - plane.height(gable_geometry::dvec2(x, y))).abs() < 0.02);
            assert!((f64::from(patch.a) - plane.a).abs() < 0.03 && (f64::from(patch.b) - plane.b).abs() < 0.03);
        }
    }

    #[test]
    fn windows_beside_a_step_do_not_cross_it() {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 40, height: 30 };
        let height = Raster::new(window, (0..window.len()).map(|p| if p % 40 < 20 { 3.0 } else { 8.0 }).collect());
        let field = Field::new(&height, &Raster::filled(window, true), 0.6);
        for (p, patch) in field.patches.iter().enumerate() {
            assert!((patch.h - field.z[p]).abs() < 1e-3 && patch.a.abs() < 1e-3, "{p}: {patch:?}");
        }
    }
}
