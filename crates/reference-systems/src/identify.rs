//! Which system of EPSG a WKT describes.

use crate::read::Unread;
use crate::table::{Kind, System, systems};
use crate::wkt::Node;
use gable_geometry::Crs;

const PLANES: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const HEIGHTS: [&str; 4] = ["VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"];

/// The system that a WKT describes: that of its own code, or that of its name if its figures are the same.
pub(crate) fn identify(whole: &Node) -> Result<Crs, Unread> {
    let unknown = || Unread::Unknown(whole.name().to_owned());
    if let Some(code) = whole.epsg() {
        return Ok(Crs::Epsg(code));
    }
    match whole.keyword.as_str() {
        keyword if PLANES.contains(&keyword) => {
            let known = by_name(whole, Kind::Projected).find(|s| has_figures_of(whole, s));
            known.map(|s| Crs::Epsg(s.code)).ok_or_else(unknown)
        }
        "COMPD_CS" | "COMPDCS" | "COMPOUNDCRS" => {
            let plane = whole.inside(&PLANES).chain(whole.inside(&["BOUNDCRS"])).next().ok_or_else(unknown)?;
            let Crs::Epsg(horizontal) = identify(plane)? else { return Err(unknown()) };
            let height = whole.inside(&HEIGHTS).next();
            let vertical = height.and_then(|h| h.epsg().or_else(|| by_name(h, Kind::Vertical).map(|s| s.code).next()));
            Ok(match vertical {
                Some(vertical) => Crs::Compound { horizontal, vertical },
                None => Crs::Epsg(horizontal),
            })
        }
        "BOUNDCRS" => {
            let source = whole.inside(&["SOURCECRS"]).flat_map(|source| &source.children).next();
            identify(source.ok_or_else(unknown)?)
        }
        "GEOGCS" | "GEOGCRS" | "GEOGRAPHICCRS" | "GEODCRS" | "GEODETICCRS" => {
            Err(Unread::Geographic(whole.name().to_owned()))
        }
        _ => Err(unknown()),
    }
}

/// Letters and digits in small letters: programs differ in the rest.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The systems of a kind that bear the name of a WKT, those in use first.
fn by_name(whole: &Node, kind: Kind) -> impl Iterator<Item = System> + use<> {
    let name = plain(whole.name());
    let mut found: Vec<System> = systems()
        .filter(|s| s.kind == kind && !name.is_empty() && (plain(s.name) == name || plain(s.alias) == name))
        .collect();
    found.sort_by_key(|s| s.deprecated);
    found.into_iter()
}

/// Whether a WKT's unit, central meridian and false origin are those of a system, as far as both tell them.
fn has_figures_of(whole: &Node, system: &System) -> bool {
    let near = |a: f64, b: f64, by: f64| (a - b).abs() <= by;
    let unit = unit_of(whole).unwrap_or(1.0);
    if !system.plan_unit.is_some_and(|expected| near(unit, expected, 1e-7)) {
        return false;
    }
    let expected = figures(crate::projection::definition(system.code).unwrap_or_default());
    // Parameters of WKT 2 stand in the conversion, with units of their own.
    let conversion = whole.inside(&["CONVERSION"]).next().unwrap_or(whole);
    conversion.inside(&["PARAMETER"]).all(|parameter| {
        let Some(value) = parameter.values.get(1).and_then(|v| v.parse::<f64>().ok()) else { return true };
        let length = unit_of(parameter).unwrap_or(unit);
        match plain(parameter.name()).as_str() {
            "centralmeridian" | "longitudeofnaturalorigin" | "longitudeoforigin" => {
                expected.meridian.is_none_or(|e| near(value, e, 1e-6))
            }
            "falseeasting" => expected.easting.is_none_or(|e| near(value * length, e, 0.01)),
            "falsenorthing" => expected.northing.is_none_or(|e| near(value * length, e, 0.01)),
            "scalefactor" | "scalefactoratnaturalorigin" => expected.scale.is_none_or(|e| near(value, e, 1e-8)),
            _ => true,
        }
    })
}

/// Metres of the unit that stands in a node itself.
fn unit_of(node: &Node) -> Option<f64> {
    // The last one is that of the axes.
    node.inside(&["UNIT", "LENGTHUNIT"]).next_back()?.values.get(1)?.parse().ok()
}

#[derive(Default)]
struct Figures {
    meridian: Option<f64>,
    easting: Option<f64>,
    northing: Option<f64>,
    scale: Option<f64>,
}

/// The figures of a PROJ text, in degrees and metres.
fn figures(text: &str) -> Figures {
    let mut found = Figures::default();
    let utm = text.contains("+proj=utm");
    if utm {
        found = Figures { meridian: None, easting: Some(500_000.0), northing: Some(0.0), scale: Some(0.9996) };
    }
    for word in text.split_whitespace() {
        let (key, value) = word.split_once('=').unwrap_or((word, ""));
        let value: Option<f64> = value.parse().ok();
        match key {
            "+lon_0" => found.meridian = value,
            "+x_0" => found.easting = value,
            "+y_0" => found.northing = value,
            "+k" | "+k_0" => found.scale = value,
            "+zone" if utm => found.meridian = value.map(|zone| 6.0 * zone - 183.0),
            "+south" => found.northing = Some(1e7),
            _ => {}
        }
    }
    found
}
