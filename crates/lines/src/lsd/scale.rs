//! Blur and sampling on a coarser lattice.

use gable_geometry::{DVec2, dvec2};
use gable_raster::{GridWindow, Raster};

/// The published σ of the blur, in pixels of the result.
const SIGMA: f64 = 0.6;
/// Kernel support on either side, in σ: beyond it a share of less than 10⁻³ is lost.
const SUPPORT: f64 = 3.3;

/// A resampled raster and where it lies.
pub(super) struct Scaled {
    pub(super) values: Raster<f32>,
    /// Edge of its pixels, metres.
    pub(super) pixel: f64,
}

impl Scaled {
    /// Local metres of a place on the gradient's lattice, where whole numbers are corners between four pixels.
    pub(super) fn to_local(&self, p: DVec2) -> DVec2 {
        let window = self.values.window();
        (dvec2(window.x0 as f64, window.y0 as f64) + p + 1.0) * self.pixel
    }
}

/// Weights of the pixels under one sample: the first pixel (counted in the window) and its successors.
struct Taps {
    first: i64,
    weights: Vec<f32>,
}

/// Taps for samples `from..from + count` of the coarser lattice.
fn taps(from: i64, count: usize, scale: f64, origin: i64) -> Vec<Taps> {
    let sigma = SIGMA / scale;
    let reach = (SUPPORT * sigma).ceil() as i64;
    (from..from + count as i64)
        .map(|k| {
            // Centre of sample k on the absolute lattice of the source.
            let centre = (k as f64 + 0.5) / scale - 0.5;
            let nearest = centre.round() as i64;
            let weight = |i: i64| (-0.5 * ((i as f64 - centre) / sigma).powi(2)).exp();
            let sum: f64 = (nearest - reach..=nearest + reach).map(weight).sum();
            let weights = (nearest - reach..=nearest + reach).map(|i| (weight(i) / sum) as f32).collect();
            Taps { first: nearest - reach - origin, weights }
        })
        .collect()
}

/// Blurs and samples at `scale` pixels per pixel. The coarser lattice hangs on the local origin like the finer one.
/// Missing values are left out of the means; a sample is missing where less than half of its weight has values.
pub(super) fn resample(raster: &Raster<f32>, scale: f64) -> Scaled {
    let window = raster.window();
    if scale >= 1.0 {
        return Scaled { values: raster.clone(), pixel: window.step };
    }
    let along = |from: i64, count: usize| {
        let first = (from as f64 * scale).ceil() as i64;
        let last = ((from + count as i64) as f64 * scale).floor() as i64;
        (first, (last - first).max(0) as usize)
    };
    let (x0, width) = along(window.x0, window.width);
    let (y0, height) = along(window.y0, window.height);
    let target = GridWindow { step: window.step / scale, x0, y0, width, height };
    let columns = taps(x0, width, scale, window.x0);
    let rows = taps(y0, height, scale, window.y0);
    // Along rows first: value · weight and weight.
    let mut wide = vec![(0.0f32, 0.0f32); width * window.height];
    for y in 0..window.height {
        let row = raster.row(y);
        for (out, tap) in wide[y * width..].iter_mut().zip(&columns) {
            *out = gather(tap, window.width, |i| if row[i].is_nan() { (0.0, 0.0) } else { (row[i], 1.0) });
        }
    }
    let mut values = Vec::with_capacity(target.len());
    let mut sums = vec![(0.0f32, 0.0f32); width];
    for tap in &rows {
        sums.fill((0.0, 0.0));
        for (k, &weight) in tap.weights.iter().enumerate() {
            let y = tap.first + k as i64;
            if y < 0 || y >= window.height as i64 {
                continue;
            }
            for (sum, value) in sums.iter_mut().zip(&wide[y as usize * width..][..width]) {
                sum.0 += weight * value.0;
                sum.1 += weight * value.1;
            }
        }
        values.extend(sums.iter().map(|&(sum, weight)| if weight >= 0.5 { sum / weight } else { f32::NAN }));
    }
    Scaled { values: Raster::new(target, values), pixel: target.step }
}

fn gather(tap: &Taps, count: usize, value: impl Fn(usize) -> (f32, f32)) -> (f32, f32) {
    let from = (-tap.first).max(0) as usize;
    let to = (count as i64 - tap.first).clamp(0, tap.weights.len() as i64) as usize;
    let mut sum = (0.0, 0.0);
    for k in from..to {
        let (v, w) = value((tap.first + k as i64) as usize);
        sum.0 += tap.weights[k] * v;
        sum.1 += tap.weights[k] * w;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_stay_planes_and_holes_stay_out() {
        let window = GridWindow { step: 0.2, x0: -7, y0: 13, width: 40, height: 30 };
        let plane = |p: gable_geometry::DVec2| (3.0 * p.x - 2.0 * p.y + 1.0) as f32;
        let value = |w: GridWindow, i: usize| plane(w.centre(i % w.width, i / w.width));
        let mut raster = Raster::new(window, (0..window.len()).map(|i| value(window, i)).collect());
        for i in 0..8 {
            raster[(20 + i % 2, 10 + i / 2)] = f32::NAN;
        }
        let scaled = resample(&raster, 0.8).values;
        let w = scaled.window();
        assert_eq!((w.x0, w.y0, w.width, w.height), (-5, 11, 31, 23));
        let mut missing = 0;
        for y in 3..w.height - 3 {
            for x in 3..w.width - 3 {
                let v = scaled[(x, y)];
                missing += usize::from(v.is_nan());
                let near_hole = w.centre(x, y).distance(raster.window().centre(20, 12)) < 1.2;
                assert!(near_hole || (v - plane(w.centre(x, y))).abs() < 1e-4);
            }
        }
        assert!((1..12).contains(&missing));
    }
}
