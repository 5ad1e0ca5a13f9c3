//! From earth-centred coordinates to a plane that touches the Earth: metres to the east, the north and up.

use crate::transform::Transform;
use gable_geometry::{Crs, DVec3, dvec3};

/// WGS 84: the equatorial radius, metres, and the square of the eccentricity.
const RADIUS: f64 = 6_378_137.0;
const ECCENTRICITY: f64 = 0.006_694_379_990_141_317;

/// Distances from the middle of the Earth at which cities lie, metres.
const SHELL: std::ops::Range<f64> = 6.3e6..6.42e6;

/// The origins of planes lie on multiples of this, degrees (1.1 km), so that a city that grows mostly keeps its plane.
const STEP: f64 = 0.01;

/// Whether a point is on the Earth, if coordinates are earth-centred.
pub(crate) fn is_on_earth(point: DVec3) -> bool {
    SHELL.contains(&point.length())
}

/// The point at a latitude and a longitude, radians, and a height above the ellipsoid.
pub(crate) fn point(latitude: f64, longitude: f64, height: f64) -> DVec3 {
    let (sin, cos) = latitude.sin_cos();
    let normal = RADIUS / (1.0 - ECCENTRICITY * sin * sin).sqrt();
    let (east, north) = longitude.sin_cos();
    dvec3(
        (normal + height) * cos * north,
        (normal + height) * cos * east,
        (normal * (1.0 - ECCENTRICITY) + height) * sin,
    )
}

/// Latitude and longitude of a point near the Earth, radians (Bowring 1985: to 1e-9 below 10 km).
fn latitude_longitude(p: DVec3) -> (f64, f64) {
    let across = p.x.hypot(p.y);
    let polar = RADIUS * (1.0 - ECCENTRICITY).sqrt();
    let (sin, cos) = (p.z * RADIUS).atan2(across * polar).sin_cos();
    let second = ECCENTRICITY / (1.0 - ECCENTRICITY);
    let latitude = (p.z + second * polar * sin.powi(3)).atan2(across - ECCENTRICITY * RADIUS * cos.powi(3));
    (latitude, p.y.atan2(p.x))
}

/// The plane near a point: its origin is on the ellipsoid.
pub(crate) fn plane_near(p: DVec3) -> Crs {
    let (latitude, longitude) = latitude_longitude(p);
    let round = |radians: f64| ((radians.to_degrees() / STEP).round() * STEP * 1e6).round() / 1e6;
    Crs::Enu { latitude: round(latitude), longitude: round(longitude), height: 0.0 }
}

/// From earth-centred coordinates to those of a plane at a latitude and a longitude, degrees.
pub(crate) fn to_plane(latitude: f64, longitude: f64, height: f64) -> Transform {
    let (latitude, longitude) = (latitude.to_radians(), longitude.to_radians());
    let origin = point(latitude, longitude, height);
    let ((sin, cos), (sin_long, cos_long)) = (latitude.sin_cos(), longitude.sin_cos());
    let east = dvec3(-sin_long, cos_long, 0.0);
    let north = dvec3(-sin * cos_long, -sin * sin_long, cos);
    let up = dvec3(cos * cos_long, cos * sin_long, sin);
    Transform::of_rows([east, north, up]).after_shift(-origin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_touches_the_earth_where_it_should() {
        // EPSG's own example for earth-centred coordinates (Guidance Note 7-2, 4.1.1).
        let p = dvec3(3_771_793.968, 140_253.342, 5_124_304.349);
        let (latitude, longitude) = latitude_longitude(p);
        assert!((latitude.to_degrees() - (53.0 + 48.0 / 60.0 + 33.82 / 3600.0)).abs() < 1e-7);
        assert!((longitude.to_degrees() - (2.0 + 7.0 / 60.0 + 46.38 / 3600.0)).abs() < 1e-7);
        assert!((point(latitude, longitude, 73.0) - p).length() < 2e-3);
        for (latitude, longitude) in [(52.0, 4.36), (-33.9, 151.2), (0.0, -78.5), (89.0, 0.0), (64.1, -21.9)] {
            let plane = to_plane(latitude, longitude, 0.0);
            let on = |north: f64, east: f64, height: f64| {
                plane.apply(point((latitude + north).to_radians(), (longitude + east).to_radians(), height))
            };
            assert!((on(0.0, 0.0, 12.5) - dvec3(0.0, 0.0, 12.5)).length() < 1e-6, "{latitude}");
            let north = on(1e-4, 0.0, 0.0);
            assert!(north.x.abs() < 1e-6 && (north.y - 11.1).abs() < 0.1 && north.z.abs() < 1e-4, "{north:?}");
            let east = on(0.0, 1e-4, 0.0);
            assert!(east.x > 0.0 && east.y.abs() < 1e-3, "{east:?}");
        }
        let crs = plane_near(point(52.0134_f64.to_radians(), 4.3571_f64.to_radians(), 40.0));
        assert_eq!(crs, Crs::Enu { latitude: 52.01, longitude: 4.36, height: 0.0 });
        assert!(is_on_earth(p) && !is_on_earth(dvec3(690_000.0, 5_330_000.0, 500.0)) && !is_on_earth(DVec3::ZERO));
    }
}
