//! From a local tangent plane to longitude and latitude.

/// Semi-axis of WGS 84, metres.
const A: f64 = 6_378_137.0;
/// Square of the eccentricity of WGS 84.
const E2: f64 = 0.006_694_379_990_141_316;

/// A plane that touches the ellipsoid: the point of contact, Earth-centred, and the directions there.
pub(crate) struct Tangent {
    origin: [f64; 3],
    east: [f64; 3],
    north: [f64; 3],
}

impl Tangent {
    /// The plane at a place, degrees.
    pub(crate) fn at(longitude: f64, latitude: f64) -> Self {
        let ((sin_l, cos_l), (sin_p, cos_p)) = (longitude.to_radians().sin_cos(), latitude.to_radians().sin_cos());
        let n = A / (1.0 - E2 * sin_p * sin_p).sqrt();
        Self {
            origin: [n * cos_p * cos_l, n * cos_p * sin_l, n * (1.0 - E2) * sin_p],
            east: [-sin_l, cos_l, 0.0],
            north: [-sin_p * cos_l, -sin_p * sin_l, cos_p],
        }
    }

    /// Longitude and latitude over or under a point of the plane, degrees; `None` beyond 500 km, where nothing is measured by a plane.
    pub(crate) fn degrees(&self, east: f64, north: f64) -> Option<(f64, f64)> {
        let distance = east.hypot(north);
        if distance.is_nan() || distance > 500_000.0 {
            return None;
        }
        let [x, y, z] = [0, 1, 2].map(|i| self.origin[i] + east * self.east[i] + north * self.north[i]);
        let across = x.hypot(y);
        // Each round is good to three digits more (Bowring 1976 begins like that).
        let mut latitude = z.atan2(across * (1.0 - E2));
        for _ in 0..6 {
            let sin = latitude.sin();
            let n = A / (1.0 - E2 * sin * sin).sqrt();
            latitude = (z + E2 * n * sin).atan2(across);
        }
        Some((y.atan2(x).to_degrees(), latitude.to_degrees()))
    }
}
