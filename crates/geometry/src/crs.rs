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
    /// A plane and heights that have no code together.
    Compound {
        /// EPSG code of the plane.
        horizontal: u32,
        /// EPSG code of the heights.
        vertical: u32,
    },
    /// A local tangent plane (east, north, up) at latitude and longitude in degrees.
    Enu {
        /// Latitude of the plane's origin, degrees.
        latitude: f64,
        /// Longitude of the plane's origin, degrees.
        longitude: f64,
        /// Height of the plane's origin above the ellipsoid, metres.
        #[serde(default)]
        height: f64,
    },
}

/// A reference system that could not be understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown reference system {0:?}: write it as EPSG:7415, EPSG:25832+7837 or ENU:latitude,longitude")]
pub struct CrsError(pub String);

impl FromStr for Crs {
    type Err = CrsError;

    fn from_str(text: &str) -> Result<Self, CrsError> {
        let wrong = || CrsError(text.to_owned());
        let (kind, value) = text.trim().split_once(':').ok_or_else(wrong)?;
        match kind.trim().to_ascii_uppercase().as_str() {
            "EPSG" => {
                let code = |text: &str| {
                    let digits = text.trim().trim_start_matches(':').trim();
                    digits.parse().ok().filter(|code| (1024..=998_999).contains(code)).ok_or_else(wrong)
                };
                match value.split_once('+') {
                    None => Ok(Self::Epsg(code(value)?)),
                    Some((plane, heights)) => {
                        let heights = heights.trim();
                        let bare = heights.get(..5).filter(|start| start.eq_ignore_ascii_case("EPSG:"));
                        let vertical = code(bare.map_or(heights, |start| &heights[start.len()..]))?;
                        Ok(Self::Compound { horizontal: code(plane)?, vertical })
                    }
                }
            }
            "ENU" => {
                let numbers: Option<Vec<f64>> = value.split(',').map(|n| n.trim().parse().ok()).collect();
                let (latitude, longitude, height) = match numbers.as_deref() {
                    Some(&[latitude, longitude]) => (latitude, longitude, 0.0),
                    Some(&[latitude, longitude, height]) => (latitude, longitude, height),
                    _ => return Err(wrong()),
                };
                let fits = latitude.abs() <= 90.0 && longitude.abs() <= 180.0 && height.abs() <= 10_000.0;
                if fits { Ok(Self::Enu { latitude, longitude, height }) } else { Err(wrong()) }
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
            Self::Compound { horizontal, vertical } => write!(f, "EPSG:{horizontal}+{vertical}"),
            Self::Enu { latitude, longitude, height: 0.0 } => write!(f, "ENU:{latitude},{longitude}"),
            Self::Enu { latitude, longitude, height } => write!(f, "ENU:{latitude},{longitude},{height}"),
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
        let enu = |height| Crs::Enu { latitude: 34.2196, longitude: 108.9594, height };
        assert_eq!("ENU:34.2196,108.9594".parse(), Ok(enu(0.0)));
        assert_eq!("ENU: 34.2196, 108.9594, 445.5".parse(), Ok(enu(445.5)));
        let pair = Crs::Compound { horizontal: 25832, vertical: 7837 };
        for text in ["EPSG:25832+7837", "epsg:25832 + epsg:7837"] {
            assert_eq!(text.parse(), Ok(pair.clone()));
        }
        for crs in [enu(0.0), enu(445.5), pair, Crs::Epsg(7415)] {
            assert_eq!(crs.to_string().parse(), Ok(crs));
        }
        for wrong in ["EPSG:25832+", "EPSG:+7837", "EPSG:25832+é", "ENU:1", "ENU:1,2,3,4", "ENU:nan,1"] {
            assert!(wrong.parse::<Crs>().is_err(), "{wrong}");
        }
        assert!("EPSG:12".parse::<Crs>().is_err());
        assert!("ENU:134.0,20".parse::<Crs>().is_err());
        assert!("WKT".parse::<Crs>().is_err());
    }
}
