//! The ground: a slope with gentle relief, a smooth function of the place, and forms on it that need not be smooth.

use super::landform::Landform;
use crate::noise::noise2;
use gable_geometry::{DVec2, Polygon};
use std::sync::Arc;

/// Bare ground: a tilted plane plus value noise of two wavelengths, changed by the forms of a place, one after the other.
#[derive(Clone, Debug)]
pub struct Relief {
    seed: u64,
    /// Rise per metre along x and y.
    gradient: DVec2,
    /// Height where x = y = 0 without relief, metres.
    base: f64,
    /// Half the range of the relief, metres.
    amplitude: f64,
    forms: Vec<Arc<dyn Landform>>,
}

impl Relief {
    /// A ground that rises by `slope` (metres per metre) in a direction drawn from the seed, on which
    /// relief of ±`amplitude` metres lies.
    #[must_use]
    pub fn new(seed: u64, slope: f64, amplitude: f64) -> Self {
        let azimuth = crate::noise::lattice_unit(seed, 11, 0, 0) * std::f64::consts::TAU;
        Self { seed, gradient: DVec2::from_angle(azimuth) * slope, base: 100.0, amplitude, forms: Vec::new() }
    }

    /// Height at a place, metres.
    #[must_use]
    pub fn height(&self, p: DVec2) -> f64 {
        self.formed(p, self.smooth(p))
    }

    /// Adds a form over those that are there.
    pub(crate) fn add(&mut self, form: Arc<dyn Landform>) {
        self.forms.push(form);
    }

    /// Whether the ground is more than a smooth relief.
    pub(crate) fn has_forms(&self) -> bool {
        !self.forms.is_empty()
    }

    /// Direction of the steepest rise and the rise per metre along it, without noise and forms.
    pub(crate) fn tilt(&self) -> (DVec2, f64) {
        (self.gradient.normalize_or(DVec2::X), self.gradient.length())
    }

    /// The height that the forms make of that of the smooth relief.
    pub(crate) fn formed(&self, p: DVec2, smooth: f64) -> f64 {
        self.forms.iter().fold(smooth, |below, form| form.height(p, below))
    }

    /// Height without forms, metres.
    pub(crate) fn smooth(&self, p: DVec2) -> f64 {
        let swell = 0.8 * noise2(self.seed ^ 0x51, 120.0, p.x, p.y) + 0.2 * noise2(self.seed ^ 0x52, 25.0, p.x, p.y);
        self.base + self.gradient.dot(p) + self.amplitude * swell
    }

    /// Lowest and highest ground along the outline of a polygon, sampled every 2 m.
    #[must_use]
    pub fn range_along(&self, polygon: &Polygon) -> (f64, f64) {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for ring in polygon.rings() {
            for i in 0..ring.len() {
                let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
                let n = (a.distance(b) / 2.0).ceil().max(1.0);
                for k in 0..n as usize {
                    let z = self.height(a.lerp(b, k as f64 / n));
                    low = low.min(z);
                    high = high.max(z);
                }
            }
        }
        (low, high)
    }
}
