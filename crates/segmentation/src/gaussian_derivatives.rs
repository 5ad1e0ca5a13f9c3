//! The bank of Gaussian derivatives: 3 scales, 6 directions (Zhu 2018, §4.1).
//!
//! The paper does not say which derivative. Here it is the second one, which answers to bright and dark spots and lines
//! such as the lit and shaded parts of a crown. The second derivative along a direction θ is
//! `cos²θ·Gxx + 2·cosθ·sinθ·Gxy + sin²θ·Gyy`, so six separable convolutions a scale give every direction.

/// A discrete Gaussian and its first two derivatives, with the scale taken out (σⁿ times the n-th derivative).
struct Kernels {
    radius: usize,
    taps: [Vec<f32>; 3],
}

impl Kernels {
    fn new(sigma: f64) -> Self {
        let radius = (3.0 * sigma).ceil().max(1.0) as usize;
        let offsets: Vec<f64> = (0..=2 * radius).map(|i| i as f64 - radius as f64).collect();
        let mut smooth: Vec<f64> = offsets.iter().map(|x| (-0.5 * (x / sigma).powi(2)).exp()).collect();
        let sum: f64 = smooth.iter().sum();
        smooth.iter_mut().for_each(|w| *w /= sum);
        let mut first: Vec<f64> = offsets.iter().zip(&smooth).map(|(x, g)| -x / sigma * g).collect();
        let mut second: Vec<f64> = offsets.iter().zip(&smooth).map(|(x, g)| ((x / sigma).powi(2) - 1.0) * g).collect();
        // Sampling and cutting leave small errors: make the derivatives exact on lines and parabolas.
        let mean = second.iter().sum::<f64>() / second.len() as f64;
        second.iter_mut().for_each(|w| *w -= mean);
        let slope: f64 = offsets.iter().zip(&first).map(|(x, w)| -x * w).sum();
        first.iter_mut().for_each(|w| *w *= sigma / slope);
        let bend: f64 = offsets.iter().zip(&second).map(|(x, w)| 0.5 * x * x * w).sum();
        second.iter_mut().for_each(|w| *w *= sigma * sigma / bend);
        Self { radius, taps: [smooth, first, second].map(|k| k.iter().map(|&w| w as f32).collect()) }
    }
}

/// The three second derivatives of an image at one scale, times σ².
///
/// `sigma` in pixels. The border is continued by its own values. Cost: 6 convolutions of `6σ + 1` taps.
pub(crate) struct SecondDerivatives {
    pub(crate) xx: Vec<f32>,
    pub(crate) xy: Vec<f32>,
    pub(crate) yy: Vec<f32>,
}

impl SecondDerivatives {
    pub(crate) fn new(image: &[f32], width: usize, height: usize, sigma: f64) -> Self {
        let kernels = Kernels::new(sigma);
        let r = kernels.radius;
        let rows: [Vec<f32>; 3] = [0, 1, 2].map(|order| along_rows(image, width, &kernels.taps[order], r));
        Self {
            xx: along_columns(&rows[2], width, height, &kernels.taps[0], r),
            xy: along_columns(&rows[1], width, height, &kernels.taps[1], r),
            yy: along_columns(&rows[0], width, height, &kernels.taps[2], r),
        }
    }

    /// The second derivative along `angle` (radians, from east to north), into `out`.
    pub(crate) fn along(&self, angle: f64, out: &mut Vec<f32>) {
        let (s, c) = angle.sin_cos();
        let (cc, cs, ss) = ((c * c) as f32, (2.0 * c * s) as f32, (s * s) as f32);
        out.clear();
        out.extend(self.xx.iter().zip(&self.xy).zip(&self.yy).map(|((xx, xy), yy)| cc * xx + cs * xy + ss * yy));
    }
}

// Correlation: out(x) = Σ k(d) image(x − d), the convolution whose odd kernel gives +∂ for a rising image.
fn along_rows(image: &[f32], width: usize, kernel: &[f32], r: usize) -> Vec<f32> {
    let mut out = vec![0.0; image.len()];
    let mut padded = vec![0.0; width + 2 * r];
    for (row, out) in image.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        padded[..r].fill(row[0]);
        padded[r..r + width].copy_from_slice(row);
        padded[r + width..].fill(row[width - 1]);
        for (k, &weight) in kernel.iter().enumerate() {
            let from = &padded[2 * r - k..][..width];
            for (o, v) in out.iter_mut().zip(from) {
                *o += weight * v;
            }
        }
    }
    out
}

fn along_columns(image: &[f32], width: usize, height: usize, kernel: &[f32], r: usize) -> Vec<f32> {
    let mut out = vec![0.0; image.len()];
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        for (k, &weight) in kernel.iter().enumerate() {
            let from = (y + r).saturating_sub(k).min(height - 1);
            for (o, v) in out.iter_mut().zip(&image[from * width..][..width]) {
                *o += weight * v;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_on_a_paraboloid() {
        let (w, h, sigma) = (40, 30, 1.7);
        let image: Vec<f32> = (0..w * h)
            .map(|i| {
                let (x, y) = ((i % w) as f32 - 20.0, (i / w) as f32 - 15.0);
                0.5 * x * x + 0.3 * x * y - 0.25 * y * y + 2.0 * x - y + 7.0
            })
            .collect();
        let d = SecondDerivatives::new(&image, w, h, sigma);
        let at = 15 * w + 20;
        let scale = (sigma * sigma) as f32;
        for (found, expected) in [(d.xx[at], 1.0), (d.xy[at], 0.3), (d.yy[at], -0.5)] {
            assert!((found - expected * scale).abs() < 1e-3, "{found} {expected}");
        }
        let mut along = Vec::new();
        d.along(std::f64::consts::FRAC_PI_4, &mut along);
        assert!((along[at] - (0.25 + 0.3) * scale).abs() < 1e-3);
    }

    #[test]
    fn a_constant_gives_nothing() {
        let d = SecondDerivatives::new(&[3.5; 15 * 9], 15, 9, 2.0);
        assert!(d.xx.iter().chain(&d.xy).chain(&d.yy).all(|v| v.abs() < 1e-5));
    }
}
