//! Where coordinates lie on Earth.

use crate::table::{horizontal, system};
use crate::tangent::Tangent;
use gable_geometry::Crs;
use proj4rs::Proj;

/// A place on Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geographic {
    /// Longitude in WGS 84, degrees.
    pub longitude: f64,
    /// Latitude in WGS 84, degrees.
    pub latitude: f64,
    /// Metres of the plane for a metre on the ground: 0.9996 on the meridian of a UTM zone, 1.6 at 52° in Web Mercator.
    pub scale: f64,
}

/// The way from a plane in metres to longitude and latitude.
pub struct Projection(Way);

enum Way {
    /// By the definition of the system.
    Projected { from: Box<Proj>, to: Box<Proj> },
    /// Of a local tangent plane.
    Tangent(Tangent),
}

/// A projected system as PROJ writes it, if that is known.
pub(crate) fn definition(code: u32) -> Option<&'static str> {
    let known = u16::try_from(code).ok().and_then(crs_definitions::from_code).map(|d| d.proj4);
    known.or_else(|| system(code).map(|s| s.proj).filter(|text| !text.is_empty()))
}

/// The definition of a projected system as well-known text (WKT 1, as GDAL writes it), if that is known.
#[must_use]
pub fn well_known_text(code: u32) -> Option<&'static str> {
    u16::try_from(code).ok().and_then(crs_definitions::from_code).map(|d| d.wkt).filter(|text| !text.is_empty())
}

impl Projection {
    /// That of a system; `None` if it is not known, or not in metres, or its axes point elsewhere than to east and north.
    #[must_use]
    pub fn of(crs: &Crs) -> Option<Self> {
        if let Crs::Enu { latitude, longitude, .. } = *crs {
            return Some(Self(Way::Tangent(Tangent::at(longitude, latitude))));
        }
        let found = system(horizontal(crs)?)?;
        let turned = found.axes.contains(['W', 'S']);
        if found.plan_unit != Some(1.0) || turned {
            return None;
        }
        let from = Proj::from_proj_string(definition(found.code)?).ok()?;
        let to = Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").ok()?;
        Some(Self(Way::Projected { from: Box::new(from), to: Box::new(to) }))
    }

    /// Longitude and latitude of a point, degrees; `None` where the plane does not reach.
    #[must_use]
    pub fn degrees(&self, easting: f64, northing: f64) -> Option<(f64, f64)> {
        let (from, to) = match &self.0 {
            Way::Tangent(tangent) => return tangent.degrees(easting, northing),
            Way::Projected { from, to } => (from, to),
        };
        let mut point = (easting, northing, 0.0);
        proj4rs::transform::transform(from, to, &mut point).ok()?;
        let (longitude, latitude) = (point.0.to_degrees(), point.1.to_degrees());
        (longitude.is_finite() && latitude.is_finite() && latitude.abs() <= 90.0).then_some((longitude, latitude))
    }

    /// The place of a point, with the scale there.
    #[must_use]
    pub fn place(&self, easting: f64, northing: f64) -> Option<Geographic> {
        // A mean radius is good to 0.5 %.
        const DEGREE: f64 = 6_371_000.0 * std::f64::consts::PI / 180.0;
        let (longitude, latitude) = self.degrees(easting, northing)?;
        let (east, west) = (self.degrees(easting + 50.0, northing)?, self.degrees(easting - 50.0, northing)?);
        let across = (east.0 - west.0 + 180.0).rem_euclid(360.0) - 180.0;
        let ground = (across * latitude.to_radians().cos()).hypot(east.1 - west.1) * DEGREE;
        Some(Geographic { longitude, latitude, scale: 100.0 / ground })
    }
}

/// Height of the geoid of EGM96 above the ellipsoid of WGS 84, metres. Systems of heights lie within about a metre of it.
#[must_use]
pub fn undulation(longitude: f64, latitude: f64) -> f64 {
    egm96::egm96_compute_altitude_offset(latitude, longitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(crs: &Crs, easting: f64, northing: f64) -> Option<Geographic> {
        Projection::of(crs)?.place(easting, northing)
    }

    #[test]
    fn places_are_where_proj_has_them() {
        // By PROJ 9.5: cs2cs EPSG:n EPSG:4326.
        for (code, easting, northing, longitude, latitude) in [
            (25832, 691_000.0, 5_334_000.0, 11.567_053, 48.130_570),
            (28992, 155_000.0, 463_000.0, 5.387_204, 52.155_172),
            (2180, 637_000.0, 487_000.0, 21.006_704, 52.231_977),
            (31256, 0.0, 340_000.0, 16.332_135, 48.198_409),
        ] {
            let found = place(&Crs::Epsg(code), easting, northing).unwrap();
            let off = (found.longitude - longitude).abs().max((found.latitude - latitude).abs());
            assert!(off < 1.0e-4, "EPSG:{code}: {found:?}");
        }
        let pair = Crs::Compound { horizontal: 25832, vertical: 7837 };
        assert_eq!(place(&pair, 691_000.0, 5_334_000.0), place(&Crs::Epsg(25832), 691_000.0, 5_334_000.0));
        // By PROJ 9.1: +proj=ortho +lat_0=52 +lon_0=4.36 +ellps=WGS84, which has the same plane.
        let plane = Crs::Enu { latitude: 52.0, longitude: 4.36, height: 0.0 };
        let found = place(&plane, 1000.0, -2000.0).unwrap();
        let off = (found.longitude - 4.374_555).abs().max((found.latitude - 51.982_024).abs());
        assert!(off < 2.0e-6 && (found.scale - 1.0).abs() < 0.006, "{found:?}");
        assert_eq!(place(&Crs::Epsg(4326), 9.0, 48.0), None);
        assert_eq!(place(&Crs::Unknown, 9.0, 48.0), None);
    }

    #[test]
    fn the_scale_of_web_mercator_is_seen() {
        let berlin = place(&Crs::Epsg(3857), 1_492_000.0, 6_894_000.0).unwrap();
        assert!((berlin.scale - 1.64).abs() < 0.02, "{berlin:?}");
        let utm = place(&Crs::Epsg(25832), 500_000.0, 5_334_000.0).unwrap();
        assert!((utm.scale - 1.0).abs() < 0.006, "{utm:?}");
    }

    #[test]
    fn the_geoid_is_that_of_egm96() {
        // NGA's calculator; the national systems lie within a metre.
        for (longitude, latitude, height) in
            [(4.36, 52.01, 43.3), (11.57, 48.13, 46.1), (10.4, 63.4, 39.9), (-74.0, 40.7, -32.8)]
        {
            let found = undulation(longitude, latitude);
            assert!((found - height).abs() < 1.0, "{longitude} {latitude}: {found}");
        }
    }
}
