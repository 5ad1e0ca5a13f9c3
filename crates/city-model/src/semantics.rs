//! Names that files give to surfaces and reference systems.

use crate::Semantic;
use gable_geometry::{Crs, DVec3};

/// The meaning of a surface by its CityGML name, if it is one of the three.
pub(crate) fn kind_of(name: &str) -> Option<Semantic> {
    match name {
        "GroundSurface" => Some(Semantic::GroundSurface),
        "WallSurface" => Some(Semantic::WallSurface),
        "RoofSurface" => Some(Semantic::RoofSurface),
        _ => None,
    }
}

/// The meaning that a surface's direction suggests: within 10° of vertical a wall, else roof above and ground below.
pub(crate) fn of_normal(normal: DVec3) -> Semantic {
    let up = normal.normalize_or_zero().z;
    // sin 10°
    if up.abs() < 0.1736 {
        Semantic::WallSurface
    } else if up > 0.0 {
        Semantic::RoofSurface
    } else {
        Semantic::GroundSurface
    }
}

/// A reference system by OGC URL, URN or `EPSG:…`, or by the German surveys' URNs; `None` if it is not understood.
/// Of a German compound system the horizontal code is taken.
pub(crate) fn crs_of(text: &str) -> Option<Crs> {
    const GERMAN: [(&str, u32); 6] = [
        ("DE_DHDN_3GK2", 31466),
        ("DE_DHDN_3GK3", 31467),
        ("DE_DHDN_3GK4", 31468),
        ("DE_DHDN_3GK5", 31469),
        ("ETRS89_UTM32", 25832),
        ("ETRS89_UTM33", 25833),
    ];
    if let Some(name) = text.strip_prefix("urn:adv:crs:") {
        let horizontal = name.split('*').next()?;
        return GERMAN.iter().find(|(known, _)| *known == horizontal).map(|&(_, code)| Crs::Epsg(code));
    }
    gable_reference_systems::read(text).ok().filter(|crs| *crs != Crs::Unknown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    #[test]
    fn reference_systems() {
        for text in ["https://www.opengis.net/def/crs/EPSG/0/7415", "urn:ogc:def:crs:EPSG::7415", "EPSG:7415"] {
            assert_eq!(crs_of(text), Some(Crs::Epsg(7415)));
        }
        assert_eq!(crs_of("urn:adv:crs:DE_DHDN_3GK4*DE_DHN92_NH"), Some(Crs::Epsg(31468)));
        assert_eq!(crs_of("ENU:34.2,108.9"), Some(Crs::Enu { latitude: 34.2, longitude: 108.9, height: 0.0 }));
        let pair = Crs::Compound { horizontal: 25832, vertical: 7837 };
        assert_eq!(crs_of("urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::7837"), Some(pair));
        assert_eq!(crs_of("urn:adv:crs:MARS"), None);
        assert_eq!(crs_of("EPSG"), None);
    }

    #[test]
    fn directions() {
        assert_eq!(of_normal(dvec3(0.0, 0.1, 3.0)), Semantic::RoofSurface);
        assert_eq!(of_normal(dvec3(0.0, 9.0, 1.0)), Semantic::WallSurface);
        assert_eq!(of_normal(dvec3(0.0, 0.0, -1.0)), Semantic::GroundSurface);
    }
}
