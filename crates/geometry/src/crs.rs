//! Coordinate reference systems, by name: gable keeps them and writes them out, it never reprojects.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The reference system of a city's coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Crs {
    /// Not known: coordinates are metric and z is up, nothing more.
    Unknown,
    /// An EPSG code (a compound one includes the heights).
    Epsg(u32),
    /// A local tangent plane (east, north, up) at latitude and longitude in degrees.
    Enu {
        /// Latitude of the plane's origin, degrees.
        latitude: f64,
        /// Longitude of the plane's origin, degrees.
        longitude: f64,
    },
}

/// A reference system that could not be understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown reference system {0:?}: write it as EPSG:7415 or ENU:latitude,longitude")]
pub struct CrsError(pub String);

impl FromStr for Crs {
    type Err = CrsError;

    fn from_str(text: &str) -> Result<Self, CrsError> {
        let wrong = || CrsError(text.to_owned());
        let (kind, value) = text.trim().split_once(':').ok_or_else(wrong)?;
        match kind.trim().to_ascii_uppercase().as_str() {
            "EPSG" => {
                let code: u32 = value.trim().parse().map_err(|_| wrong())?;
                if (1024..=998_999).contains(&code) { Ok(Self::Epsg(code)) } else { Err(wrong()) }
            }
            "ENU" => {
                let (lat, lon) = value.split_once(',').ok_or_else(wrong)?;
                let latitude: f64 = lat.trim().parse().map_err(|_| wrong())?;
                let longitude: f64 = lon.trim().parse().map_err(|_| wrong())?;
                let fits = latitude.abs() <= 90.0 && longitude.abs() <= 180.0;
                if fits { Ok(Self::Enu { latitude, longitude }) } else { Err(wrong()) }
            }
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for Crs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => write!(f, "unknown"),
            Self::Epsg(code) => write!(f, "EPSG:{code}"),
            Self::Enu { latitude, longitude } => write!(f, "ENU:{latitude},{longitude}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_forms_that_photogrammetry_writes() {
        assert_eq!("EPSG:7415".parse(), Ok(Crs::Epsg(7415)));
        assert_eq!("epsg: 25832".parse(), Ok(Crs::Epsg(25832)));
        assert_eq!("ENU:34.2196,108.9594".parse(), Ok(Crs::Enu { latitude: 34.2196, longitude: 108.9594 }));
        assert!("EPSG:12".parse::<Crs>().is_err());
        assert!("ENU:134.0,20".parse::<Crs>().is_err());
        assert!("WKT".parse::<Crs>().is_err());
    }
}
