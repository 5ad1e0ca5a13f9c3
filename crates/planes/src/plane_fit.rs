//! A roof plane while it is regularised, with what its pixels tolerate.

use gable_geometry::{Covariance3, DVec2};

/// One plane under work: z = s·(u·p) + c, fitted to moments.
pub(crate) struct PlaneFit {
    pub(crate) moments: Covariance3,
    /// On the ground, m².
    pub(crate) area: f64,
    /// Downhill is −`direction`·sign(slope); of unit length. Zero for level planes.
    pub(crate) direction: DVec2,
    /// Tangent.
    pub(crate) slope: f64,
    /// Slope before regularisation.
    pub(crate) free_slope: f64,
    /// Whether `direction` is one of the facades' (or shared) ones.
    pub(crate) turned: bool,
    /// Squared orthogonal residual that is still tolerated, m².
    pub(crate) limit: f64,
    /// Variance of the noise that is assumed, m².
    pub(crate) noise: f64,
}

impl PlaneFit {
    /// Mean squared orthogonal distance for a gradient, with the best offset.
    pub(crate) fn misfit(&self, g: DVec2) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.moments.matrix();
        let v = zz - 2.0 * (g.x * xz + g.y * yz) + g.x * g.x * xx + 2.0 * g.x * g.y * xy + g.y * g.y * yy;
        v.max(0.0) / (1.0 + g.length_squared())
    }

    /// Slopes along x and y.
    pub(crate) fn gradient(&self) -> DVec2 {
        self.direction * self.slope
    }

    /// Whether the pixels tolerate a gradient.
    pub(crate) fn tolerates(&self, g: DVec2) -> bool {
        self.misfit(g) <= self.limit
    }

    /// Numerator and denominator of the best slope along a direction, per m² of the plane.
    pub(crate) fn along(&self, u: DVec2) -> (f64, f64) {
        let [xx, xy, xz, yy, yz, _] = self.moments.matrix();
        (u.x * xz + u.y * yz, u.x * u.x * xx + 2.0 * u.x * u.y * xy + u.y * u.y * yy)
    }

    /// Standard deviation of the slope along a direction, from correlated noise.
    pub(crate) fn uncertainty(&self, u: DVec2, noise_area: f64) -> f64 {
        (self.noise * noise_area / (self.area * self.along(u).1.max(1e-6))).sqrt()
    }
}
