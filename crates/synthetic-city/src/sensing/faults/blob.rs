//! A round shape with a ragged border.

use crate::noise::noise2;
use gable_geometry::DVec2;

#[derive(Clone, Debug)]
pub(crate) struct Blob {
    pub(crate) seed: u64,
    pub(crate) centre: DVec2,
    /// Mean radius, metres.
    pub(crate) radius: f64,
    /// How far the border swings, as a share of the radius; below 1.
    pub(crate) swing: f64,
}

impl Blob {
    /// Distance from the centre, 1 on the border.
    pub(crate) fn share(&self, p: DVec2) -> f64 {
        let d = p - self.centre;
        let way = d.normalize_or(DVec2::X) * 1.7;
        let wide = noise2(self.seed, 1.0, way.x, way.y);
        let fine = noise2(self.seed ^ 1, 0.25, way.x, way.y);
        d.length() / (self.radius * (1.0 + self.swing * (0.75 * wide + 0.25 * fine)))
    }

    pub(crate) fn contains(&self, p: DVec2) -> bool {
        p.distance_squared(self.centre) < 4.0 * self.radius * self.radius && self.share(p) < 1.0
    }
}
