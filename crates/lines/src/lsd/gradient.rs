//! Gradient and level-line direction between the pixels.

use gable_geometry::{DVec2, dvec2};
use gable_raster::Raster;

/// Level lines on the corners between four pixels; corner (x, y) lies between columns x, x+1 and rows y, y+1.
pub(super) struct Gradient {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Unit direction of the level line, larger values to its left; zero where there is none.
    level: Vec<[f32; 2]>,
    magnitude: Vec<f32>,
    used: Vec<bool>,
}

impl Gradient {
    /// `None` if the raster is too small. Gradients of less than `threshold` per pixel are left out.
    pub(super) fn new(raster: &Raster<f32>, threshold: f64) -> Option<Self> {
        let (width, height) = (raster.width().checked_sub(1)?, raster.height().checked_sub(1)?);
        if width == 0 || height == 0 {
            return None;
        }
        let threshold = threshold as f32;
        let mut level = Vec::with_capacity(width * height);
        let mut magnitude = Vec::with_capacity(width * height);
        for y in 0..height {
            let (south, north) = (raster.row(y), raster.row(y + 1));
            for x in 0..width {
                let (a, b, c, d) = (south[x], south[x + 1], north[x], north[x + 1]);
                let gx = 0.5 * (b + d - a - c);
                let gy = 0.5 * (c + d - a - b);
                let g = (gx * gx + gy * gy).sqrt();
                // Also false for NaN.
                let strong = g > threshold;
                level.push(if strong { [gy / g, -gx / g] } else { [0.0; 2] });
                magnitude.push(if strong { g } else { 0.0 });
            }
        }
        Some(Self { width, height, used: vec![false; level.len()], level, magnitude })
    }

    /// Places of gradients, the largest first, equal ones by place.
    pub(super) fn seeds(&self) -> Vec<u32> {
        // Positive floats sort like their bits.
        let strong = self.magnitude.iter().enumerate().filter(|(_, m)| **m > 0.0);
        let mut keys: Vec<u64> = strong.map(|(i, m)| (u64::from(!m.to_bits()) << 32) | i as u64).collect();
        keys.sort_unstable();
        keys.into_iter().map(|k| k as u32).collect()
    }

    pub(super) fn is_used(&self, at: u32) -> bool {
        self.used[at as usize]
    }

    pub(super) fn set_used(&mut self, at: u32, used: bool) {
        self.used[at as usize] = used;
    }

    pub(super) fn level(&self, at: u32) -> DVec2 {
        let [x, y] = self.level[at as usize];
        dvec2(x.into(), y.into())
    }

    /// Level lines of columns `from..=to` of a row.
    pub(super) fn level_row(&self, y: usize, from: usize, to: usize) -> &[[f32; 2]] {
        &self.level[y * self.width + from..=y * self.width + to]
    }

    pub(super) fn magnitude(&self, at: u32) -> f64 {
        self.magnitude[at as usize].into()
    }

    pub(super) fn place(&self, at: u32) -> DVec2 {
        dvec2((at as usize % self.width) as f64, (at as usize / self.width) as f64)
    }
}
