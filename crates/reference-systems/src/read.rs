//! The texts by which files and people name a reference system.

use crate::identify::identify;
use crate::wkt::Node;
use gable_geometry::Crs;

/// Why a text names no system.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unread {
    /// It cannot be understood, or EPSG has no such system.
    #[error("unknown reference system {0:?}")]
    Unknown(String),
    /// It describes longitudes and latitudes.
    #[error("{0:?} is in degrees")]
    Geographic(String),
}

/// Longest text that is read: real ones have some thousand bytes.
const LONGEST: usize = 1 << 20;

/// The system that a text names; an empty one and `local` stand for an unknown one. See the crate's page for the forms.
///
/// # Errors
/// If it is not understood. Whether the system can be worked in is for [`metric`](crate::metric) to say.
pub fn read(text: &str) -> Result<Crs, Unread> {
    let text = text.trim().trim_start_matches('\u{feff}').trim_end_matches(['\0', ';']).trim();
    if text.is_empty() || text.eq_ignore_ascii_case("local") {
        return Ok(Crs::Unknown);
    }
    let unknown = || Unread::Unknown(text.to_owned());
    if text.len() > LONGEST {
        return Err(Unread::Unknown(format!("{}…", text.chars().take(40).collect::<String>())));
    }
    if let Ok(crs) = text.parse() {
        return Ok(crs);
    }
    if let Some(node) = Node::parse(text) {
        return identify(&node).map_err(|e| match e {
            // The whole text tells more than an empty name.
            Unread::Unknown(name) if name.is_empty() => unknown(),
            other => other,
        });
    }
    let found = ogc(text).or_else(|| proj(text)).or_else(|| in_words(text));
    found.ok_or_else(unknown)
}

/// `urn:ogc:def:crs:EPSG::25832`, `http://www.opengis.net/def/crs/EPSG/0/25832`, and pairs of them.
fn ogc(text: &str) -> Option<Crs> {
    let lower = text.to_ascii_lowercase();
    if !lower.starts_with("urn:ogc:def:crs") && !lower.contains("opengis.net/") {
        return None;
    }
    // What follows the authority and the version; both may be empty.
    let mut codes = Vec::new();
    for piece in lower.split("epsg").skip(1) {
        let digits = piece.split(['&', ',']).next()?.rsplit([':', '/', '#']).next()?;
        codes.push(digits.parse().ok()?);
    }
    match codes[..] {
        [code] => Some(Crs::Epsg(code)),
        [horizontal, vertical] => Some(Crs::Compound { horizontal, vertical }),
        // The schema of old URLs is called epsg as well.
        _ => None,
    }
}

/// The PROJ text of a UTM zone, and of what is a code in it.
fn proj(text: &str) -> Option<Crs> {
    let words: Vec<(&str, &str)> = text
        .split_whitespace()
        .map(|word| word.trim_start_matches('+'))
        .map(|word| word.split_once('=').unwrap_or((word, "")))
        .collect();
    let value = |key: &str| words.iter().find(|(k, _)| *k == key).map(|(_, v)| *v);
    if let Some(init) = value("init") {
        let code = init.to_ascii_lowercase().strip_prefix("epsg:")?.parse().ok()?;
        return Some(Crs::Epsg(code));
    }
    if value("proj") != Some("utm") || value("units").is_some_and(|u| u != "m") || value("nadgrids").is_some() {
        return None;
    }
    let zone: u32 = value("zone")?.parse().ok()?;
    let datum = match (value("datum"), value("ellps"), value("towgs84")) {
        (Some("WGS84"), ..) | (None, Some("WGS84"), _) => Datum::Wgs84,
        (None, Some("GRS80"), None | Some("0,0,0,0,0,0,0" | "0,0,0")) => Datum::Etrs89,
        (Some("NAD83"), ..) => Datum::Nad83,
        _ => return None,
    };
    utm(datum, zone, value("south").is_some())
}

enum Datum {
    Wgs84,
    Etrs89,
    Nad83,
}

/// The UTM zone of a datum.
fn utm(datum: Datum, zone: u32, south: bool) -> Option<Crs> {
    let code = match (datum, zone, south) {
        (Datum::Wgs84, 1..=60, false) => 32600 + zone,
        (Datum::Wgs84, 1..=60, true) => 32700 + zone,
        (Datum::Etrs89, 28..=37, false) => 25800 + zone,
        (Datum::Nad83, 1..=23, false) => 26900 + zone,
        _ => return None,
    };
    Some(Crs::Epsg(code))
}

/// `WGS84 UTM 32N` and `WGS 84 / UTM zone 32N`, as OpenDroneMap and others write them.
fn in_words(text: &str) -> Option<Crs> {
    let lower = text.to_ascii_lowercase().replace(['/', '_', '-', ','], " ");
    let words: Vec<&str> = lower.split_whitespace().filter(|w| *w != "zone").collect();
    let at = words.iter().position(|w| *w == "utm")?;
    let datum = match words[..at].concat().as_str() {
        "wgs84" | "wgs1984" => Datum::Wgs84,
        "etrs89" | "etrs1989" => Datum::Etrs89,
        "nad83" | "nad1983" => Datum::Nad83,
        _ => return None,
    };
    let zone = words[at + 1..].concat();
    let digits = zone.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let south = match &zone[digits.len()..] {
        "n" | "north" => false,
        "s" | "south" => true,
        _ => return None,
    };
    utm(datum, digits.parse().ok()?, south)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GEOG: &str = "GEOGCS[\"ETRS89\",DATUM[\"European_Terrestrial_Reference_System_1989\",SPHEROID[\"GRS 1980\",6378137,298.257222101,\
                        AUTHORITY[\"EPSG\",\"7019\"]],AUTHORITY[\"EPSG\",\"6258\"]],PRIMEM[\"Greenwich\",0,AUTHORITY[\"EPSG\",\"8901\"]],\
                        UNIT[\"degree\",0.0174532925199433,AUTHORITY[\"EPSG\",\"9122\"]],AUTHORITY[\"EPSG\",\"4258\"]]";
    const VERT: &str = "VERT_CS[\"DHHN2016 height\",VERT_DATUM[\"Deutsches Haupthoehennetz 2016\",2005,AUTHORITY[\"EPSG\",\"1170\"]],\
                        UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],AXIS[\"Gravity-related height\",UP],AUTHORITY[\"EPSG\",\"7837\"]]";

    fn projcs(name: &str, meridian: f64, unit: f64, own: &str) -> String {
        format!(
            "PROJCS[\"{name}\",{GEOG},PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\",0],\
             PARAMETER[\"central_meridian\",{meridian}],PARAMETER[\"scale_factor\",0.9996],PARAMETER[\"false_easting\",{}],\
             PARAMETER[\"false_northing\",0],UNIT[\"metre\",{unit},AUTHORITY[\"EPSG\",\"9001\"]]{own}]",
            500_000.0 / unit
        )
    }

    fn crs(text: &str) -> Result<String, String> {
        read(text).map(|c| c.to_string()).map_err(|e| e.to_string())
    }

    fn is(text: &str, expected: &str) {
        assert_eq!(crs(text).as_deref(), Ok(expected), "{text}");
    }

    #[test]
    fn the_forms_of_a_code() {
        for text in [
            "EPSG:25832",
            " epsg:25832 ",
            "EPSG: 25832",
            "EPSG::25832",
            "urn:ogc:def:crs:EPSG::25832",
            "urn:ogc:def:crs:EPSG:9.0:25832",
            "http://www.opengis.net/def/crs/EPSG/0/25832",
            "https://www.opengis.net/def/crs/EPSG/0/25832",
            "http://www.opengis.net/gml/srs/epsg.xml#25832",
            "+init=epsg:25832",
            "+proj=utm +zone=32 +ellps=GRS80 +towgs84=0,0,0,0,0,0,0 +units=m +no_defs",
            "ETRS89 / UTM zone 32N",
            "EPSG:25832;",
        ] {
            is(text, "EPSG:25832");
        }
        is("WGS84 UTM 32N", "EPSG:32632");
        is("WGS84 UTM 32S", "EPSG:32732");
        is("+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs", "EPSG:32632");
        is("+proj=utm +zone=56 +south +datum=WGS84 +units=m +no_defs ", "EPSG:32756");
        is("", "unknown");
        is("LOCAL", "unknown");
        is("ENU:48.10000,11.50000", "ENU:48.1,11.5");
        is("ENU:48.1,11.5,520.0", "ENU:48.1,11.5,520");
    }

    #[test]
    fn the_forms_of_a_pair() {
        for text in [
            "EPSG:25832+7837",
            "EPSG:25832+EPSG:7837",
            "urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::7837",
            "http://www.opengis.net/def/crs-compound?1=http://www.opengis.net/def/crs/EPSG/0/25832&2=http://www.opengis.net/def/crs/EPSG/0/7837",
        ] {
            is(text, "EPSG:25832+7837");
        }
    }

    #[test]
    fn of_a_wkt_the_code_of_the_whole_counts() {
        let coded = projcs("ETRS89 / UTM zone 32N", 9.0, 1.0, ",AXIS[\"Easting\",EAST],AUTHORITY[\"EPSG\",\"25832\"]");
        is(&coded, "EPSG:25832");
        // The unit's code is not the system's.
        assert_eq!(
            crs(&projcs("my own grid", 9.0, 1.0, "")),
            Err("unknown reference system \"my own grid\"".to_owned())
        );
        is(&format!("COMPD_CS[\"x\",{coded},{VERT}]"), "EPSG:25832+7837");
        is(
            &format!("COMPD_CS[\"x\",{coded},VERT_CS[\"somewhere\",VERT_DATUM[\"y\",2005],UNIT[\"metre\",1]]]"),
            "EPSG:25832",
        );
        is(&format!("COMPD_CS[\"x\",{coded},{VERT},AUTHORITY[\"EPSG\",\"5555\"]]"), "EPSG:5555");
        assert!(crs(&format!("COMPD_CS[\"x\",{},{VERT}]", projcs("my own grid", 9.0, 1.0, ""))).is_err());
        is(&format!("COMPD_CS[\"x\",{},{VERT}]", projcs("ETRS89 / UTM zone 32N", 9.0, 1.0, "")), "EPSG:25832+7837");
        assert_eq!(
            crs("LOCAL_CS[\"site\",UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]]]"),
            Err("unknown reference system \"site\"".to_owned())
        );
        assert_eq!(
            read(&GEOG.replace(",AUTHORITY[\"EPSG\",\"4258\"]", "")),
            Err(Unread::Geographic("ETRS89".to_owned()))
        );
        is(GEOG, "EPSG:4258");
    }

    #[test]
    fn a_wkt_without_code_is_known_by_name_and_figures() {
        is(&projcs("ETRS89 / UTM zone 32N", 9.0, 1.0, ""), "EPSG:25832");
        is(&projcs("ETRS_1989_UTM_Zone_32N", 9.0, 1.0, ""), "EPSG:25832");
        is(&projcs("WGS_1984_UTM_Zone_33N", 15.0, 1.0, ""), "EPSG:32633");
        // A name on other figures is no name.
        assert!(crs(&projcs("ETRS89 / UTM zone 32N", 15.0, 1.0, "")).is_err());
        assert!(crs(&projcs("ETRS89 / UTM zone 32N", 9.0, 0.3048, "")).is_err());
        let esri = "PROJCS[\"ETRS_1989_UTM_Zone_32N\",GEOGCS[\"GCS_ETRS_1989\",DATUM[\"D_ETRS_1989\",SPHEROID[\"GRS_1980\",6378137.0,298.257222101]],\
                    PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"Central_Meridian\",9.0],UNIT[\"Meter\",1.0]]";
        is(esri, "EPSG:25832");
        let two = "PROJCRS[\"ETRS89 / UTM zone 32N\",BASEGEOGCRS[\"ETRS89\",DATUM[\"ETRS89\",ELLIPSOID[\"GRS 1980\",6378137,298.257222101,LENGTHUNIT[\"metre\",1]]],ID[\"EPSG\",4258]],\
                   CONVERSION[\"UTM zone 32N\",METHOD[\"Transverse Mercator\",ID[\"EPSG\",9807]],PARAMETER[\"Longitude of natural origin\",9,ANGLEUNIT[\"degree\",0.0174532925199433],ID[\"EPSG\",8802]]],\
                   CS[Cartesian,2],AXIS[\"(E)\",east],AXIS[\"(N)\",north],LENGTHUNIT[\"metre\",1]]";
        is(two, "EPSG:25832");
        is(
            "BOUNDCRS[SOURCECRS[PROJCRS[\"x\",ID[\"EPSG\",31467]]],TARGETCRS[GEOGCRS[\"WGS 84\",ID[\"EPSG\",4326]]]]",
            "EPSG:31467",
        );
    }

    #[test]
    fn what_is_not_understood_is_not_guessed() {
        for text in [
            "WGS84",
            "Gauss-Krueger 3",
            "ESRI:102100",
            "+proj=tmerc +lon_0=9",
            "+proj=utm +zone=99 +datum=WGS84",
            "EPSG:abc",
            "UTM 32N",
            "PROJCS[",
        ] {
            assert!(matches!(read(text), Err(Unread::Unknown(_))), "{text}: {:?}", read(text));
        }
        assert!(read(&"x".repeat(3 << 20)).is_err_and(|e| e.to_string().len() < 100));
    }
}
