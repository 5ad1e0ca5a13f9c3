//! From the local frame to Earth-centred coordinates (EPSG:4978).

use gable_geometry::{Crs, DVec3, dvec3};
use gable_reference_systems::Projection;

/// Semi-axis of WGS 84, metres.
const A: f64 = 6_378_137.0;
/// Flattening of WGS 84.
const F: f64 = 1.0 / 298.257_223_563;

/// The matrix (4 × 4, column by column) from local metres to Earth-centred ones, exact at `centre` (local metres): the tangent plane
/// there, turned to the grid's north and scaled by its scale. `None` if the reference system is not known or not metric.
///
/// A plane does not follow the Earth's curve: 2 km from the centre it lies 0.3 m too high. `zero` is the height of the system's zero
/// above the ellipsoid, metres: 0 for ellipsoidal heights, the undulation of the geoid (some 45 m in central Europe) for heights above
/// the sea.
#[must_use]
pub fn earth_transform(crs: &Crs, origin: [f64; 3], centre: DVec3, zero: f64) -> Option<[f64; 16]> {
    let origin = DVec3::from_array(origin);
    let (anchor, at, [east, north, up]) = match crs {
        Crs::Unknown => return None,
        // The world coordinates are metres east, north and up of the point of contact.
        Crs::Enu { latitude, longitude, height } => {
            let (latitude, longitude) = (latitude.to_radians(), longitude.to_radians());
            (DVec3::ZERO, earth_centred(longitude, latitude, *height), axes(longitude, latitude))
        }
        Crs::Epsg(_) | Crs::Compound { .. } => {
            let projection = Projection::of(crs)?;
            let place = |dx: f64, dy: f64| {
                let world = origin + centre;
                let (longitude, latitude) = projection.degrees(world.x + dx, world.y + dy)?;
                Some((longitude.to_radians(), latitude.to_radians()))
            };
            let (longitude, latitude) = place(0.0, 0.0)?;
            let flat = |p: (f64, f64)| earth_centred(p.0, p.1, 0.0);
            // Central differences over 100 m give the grid's east and its scale.
            let east = (flat(place(50.0, 0.0)?) - flat(place(-50.0, 0.0)?)) / 100.0;
            let [_, _, up] = axes(longitude, latitude);
            let scale = east.length();
            let east = (east - up * east.dot(up)).normalize() * scale;
            let north = up.cross(east);
            let anchor = dvec3(origin.x + centre.x, origin.y + centre.y, 0.0);
            (anchor, earth_centred(longitude, latitude, 0.0), [east, north, up])
        }
    };
    let shift = origin - anchor + dvec3(0.0, 0.0, zero);
    let zero = at + east * shift.x + north * shift.y + up * shift.z;
    let column = |v: DVec3, w: f64| [v.x, v.y, v.z, w];
    let columns = [column(east, 0.0), column(north, 0.0), column(up, 0.0), column(zero, 1.0)];
    columns.concat().try_into().ok()
}

/// Earth-centred coordinates of longitude, latitude (radians) and ellipsoidal height.
fn earth_centred(longitude: f64, latitude: f64, height: f64) -> DVec3 {
    let e2 = F * (2.0 - F);
    let (sin, cos) = latitude.sin_cos();
    let n = A / (1.0 - e2 * sin * sin).sqrt();
    dvec3((n + height) * cos * longitude.cos(), (n + height) * cos * longitude.sin(), (n * (1.0 - e2) + height) * sin)
}

/// East, north and up at a place.
fn axes(longitude: f64, latitude: f64) -> [DVec3; 3] {
    let ((sl, cl), (sp, cp)) = (longitude.sin_cos(), latitude.sin_cos());
    [dvec3(-sl, cl, 0.0), dvec3(-sp * cl, -sp * sl, cp), dvec3(cp * cl, cp * sl, sp)]
}
