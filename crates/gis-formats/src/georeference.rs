//! What the formats have to know of a city's reference system.

use gable_geometry::Crs;
use gable_reference_systems::{horizontal, system, vertical, well_known_text};

/// A reference system as geographic information systems name it: easting first, whatever EPSG's order of the axes.
#[derive(Clone, Debug, PartialEq)]
pub struct GeoReference {
    crs: Crs,
}

impl GeoReference {
    /// That of a city.
    #[must_use]
    pub fn of(crs: &Crs) -> Self {
        Self { crs: crs.clone() }
    }

    /// EPSG code of the plane.
    #[must_use]
    pub fn plane(&self) -> Option<u32> {
        horizontal(&self.crs)
    }

    /// EPSG code of the heights.
    #[must_use]
    pub fn vertical(&self) -> Option<u32> {
        vertical(&self.crs)
    }

    /// Latitude and longitude of the point of contact, if it is a local tangent plane, degrees.
    #[must_use]
    pub fn tangent(&self) -> Option<[f64; 2]> {
        match self.crs {
            Crs::Enu { latitude, longitude, .. } => Some([latitude, longitude]),
            _ => None,
        }
    }

    /// Its name for people.
    #[must_use]
    pub fn name(&self) -> String {
        let known = self.plane().and_then(system).map(|system| system.name.to_owned());
        known.unwrap_or_else(|| self.crs.to_string())
    }

    /// The plane as well-known text (WKT 1); `None` if it is not known. A tangent plane is written as the orthographic projection,
    /// whose coordinates it has.
    #[must_use]
    pub fn text(&self) -> Option<String> {
        if let Some([latitude, longitude]) = self.tangent() {
            return Some(format!(
                "PROJCS[\"local tangent plane\",{WGS_84},PROJECTION[\"Orthographic\"],\
                 PARAMETER[\"latitude_of_origin\",{latitude}],PARAMETER[\"central_meridian\",{longitude}],\
                 PARAMETER[\"false_easting\",0],PARAMETER[\"false_northing\",0],UNIT[\"metre\",1],\
                 AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH]]"
            ));
        }
        self.plane().and_then(well_known_text).map(str::to_owned)
    }
}

/// WGS 84 as well-known text.
pub(crate) const WGS_84: &str = "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563,\
     AUTHORITY[\"EPSG\",\"7030\"]],AUTHORITY[\"EPSG\",\"6326\"]],PRIMEM[\"Greenwich\",0,AUTHORITY[\"EPSG\",\"8901\"]],\
     UNIT[\"degree\",0.0174532925199433,AUTHORITY[\"EPSG\",\"9122\"]],AUTHORITY[\"EPSG\",\"4326\"]]";
