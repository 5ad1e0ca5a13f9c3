//! From the local frame to Earth-centred coordinates (EPSG:4978).

use gable_geometry::{Crs, DVec3, dvec3};
use proj4rs::Proj;

/// Semi-axis of WGS 84, metres.
const A: f64 = 6_378_137.0;
/// Flattening of WGS 84.
const F: f64 = 1.0 / 298.257_223_563;

/// The matrix (4 × 4, column by column) from local metres to Earth-centred ones, exact at `centre` (local metres): the tangent plane
/// there, turned to the grid's north and scaled by its scale. `None` if the reference system is not known or not metric.
///
/// A plane does not follow the Earth's curve: 2 km from the centre it lies 0.3 m too high. Heights are taken for ellipsoidal ones;
/// where they are above a geoid, the city is off by its undulation (some 45 m in central Europe), as a whole.
#[must_use]
pub fn earth_transform(crs: &Crs, origin: [f64; 3], centre: DVec3) -> Option<[f64; 16]> {
    let origin = DVec3::from_array(origin);
    let (anchor, at, [east, north, up]) = match crs {
        Crs::Unknown => return None,
        // The world coordinates are metres east, north and up of the point of contact.
        Crs::Enu { latitude, longitude } => {
            let (latitude, longitude) = (latitude.to_radians(), longitude.to_radians());
            (DVec3::ZERO, earth_centred(longitude, latitude, 0.0), axes(longitude, latitude))
        }
        Crs::Epsg(code) => {
            let definition = crs_definitions::from_code(u16::try_from(*code).ok()?)?.proj4;
            // A unit of feet would need another scale for the heights; degrees are no plane at all.
            if !definition.contains("+units=m") {
                return None;
            }
            let from = Proj::from_proj_string(definition).ok()?;
            let to = Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").ok()?;
            let place = |dx: f64, dy: f64| {
                let world = origin + centre;
                let mut point = (world.x + dx, world.y + dy, 0.0);
                proj4rs::transform::transform(&from, &to, &mut point).ok()?;
                (point.0.is_finite() && point.1.is_finite()).then_some((point.0, point.1))
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
    let shift = origin - anchor;
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
