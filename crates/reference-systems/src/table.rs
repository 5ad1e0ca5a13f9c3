//! The systems of EPSG, as far as their names, kinds, units, axes and areas go.

use gable_geometry::Crs;
use std::sync::LazyLock;

/// What a system measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A plane: eastings and northings in a unit of length.
    Projected,
    /// Degrees.
    Geographic,
    /// From the centre of the Earth.
    Geocentric,
    /// Heights or depths alone.
    Vertical,
    /// A plane or degrees, and heights.
    Compound,
    /// Of a site or a ship.
    Other,
}

/// Where a system may be used, degrees. `west` is the larger where it crosses the date line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Western border.
    pub west: f64,
    /// Southern border.
    pub south: f64,
    /// Eastern border.
    pub east: f64,
    /// Northern border.
    pub north: f64,
}

impl Area {
    /// Whether a place lies in it, or by less than `margin` degrees outside.
    #[must_use]
    pub fn contains(&self, longitude: f64, latitude: f64, margin: f64) -> bool {
        let width = (self.east - self.west).rem_euclid(360.0);
        let width = if width == 0.0 { 360.0 } else { width };
        let from_west = (longitude - self.west + margin).rem_euclid(360.0);
        let along = from_west <= width + 2.0 * margin;
        along && latitude >= self.south - margin && latitude <= self.north + margin
    }
}

/// One system of EPSG.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct System {
    /// Its code.
    pub code: u32,
    /// What it measures.
    pub kind: Kind,
    /// Of a compound: the codes of its plane and of its heights.
    pub parts: Option<(u32, u32)>,
    /// Of a system that is not in metres: the code of the same system in metres, if there is one.
    pub in_metres: Option<u32>,
    /// Metres of the unit of the plan, if that is a length.
    pub plan_unit: Option<f64>,
    /// Metres of the unit of the heights, if there are heights.
    pub height_unit: Option<f64>,
    /// Directions of the first two axes: `E`, `N`, `S`, `W`, `U` (up), `D` (down), `?`.
    pub axes: &'static str,
    /// Whether EPSG advises against it.
    pub deprecated: bool,
    /// Where it may be used.
    pub area: Option<Area>,
    /// Its name.
    pub name: &'static str,
    /// Its name in Esri's files; empty if that is not known.
    pub(crate) alias: &'static str,
    /// Its definition as PROJ writes it, where no other table has it.
    pub(crate) proj: &'static str,
}

/// See `data/make.py` for the fields.
static TABLE: &str = include_str!("../data/epsg.tsv");

/// Each line with its code, in the order of the codes.
static LINES: LazyLock<Vec<(u32, &'static str)>> = LazyLock::new(|| {
    let code = |line: &'static str| Some((line.split('\t').next()?.parse().ok()?, line));
    TABLE.lines().filter_map(code).collect()
});

/// The system of a code; `None` if EPSG has none: the number of a unit, of a datum, or of nothing.
#[must_use]
pub fn system(code: u32) -> Option<System> {
    let at = LINES.binary_search_by_key(&code, |(code, _)| *code).ok()?;
    parse(LINES[at].1)
}

/// All systems, in the order of their codes.
pub(crate) fn systems() -> impl Iterator<Item = System> {
    LINES.iter().filter_map(|(_, line)| parse(line))
}

fn parse(line: &'static str) -> Option<System> {
    let mut fields = line.split('\t');
    let mut field = || fields.next().unwrap_or_default();
    let code = field().parse().ok()?;
    let kind = match field() {
        "P" => Kind::Projected,
        "G" => Kind::Geographic,
        "C" => Kind::Geocentric,
        "V" => Kind::Vertical,
        "K" => Kind::Compound,
        _ => Kind::Other,
    };
    let related = field();
    let (plan_unit, height_unit) = (field().parse().ok(), field().parse().ok());
    let axes = field();
    let borders: Vec<f64> = field().split(',').filter_map(|b| b.parse().ok()).collect();
    let area = match borders[..] {
        [west, south, east, north] => Some(Area { west, south, east, north }),
        _ => None,
    };
    let parts = related.split_once('+').and_then(|(flat, up)| Some((flat.parse().ok()?, up.parse().ok()?)));
    Some(System {
        code,
        kind,
        parts,
        in_metres: related.parse().ok(),
        plan_unit,
        height_unit,
        axes: axes.trim_end_matches('-'),
        deprecated: axes.ends_with('-'),
        area,
        name: field(),
        alias: field(),
        proj: field(),
    })
}

/// The code of the plane of a system; `None` if it has none in EPSG.
#[must_use]
pub fn horizontal(crs: &Crs) -> Option<u32> {
    match crs {
        Crs::Epsg(code) => Some(system(*code).and_then(|s| s.parts).map_or(*code, |(flat, _)| flat)),
        Crs::Compound { horizontal, .. } => Some(*horizontal),
        Crs::Unknown | Crs::Enu { .. } => None,
    }
}

/// The code of the heights of a system, if it tells them.
#[must_use]
pub fn vertical(crs: &Crs) -> Option<u32> {
    match crs {
        Crs::Epsg(code) => system(*code)?.parts.map(|(_, up)| up),
        Crs::Compound { vertical, .. } => Some(*vertical),
        Crs::Unknown | Crs::Enu { .. } => None,
    }
}

/// Whether EPSG names the northing of a system before its easting. gable, as most programs, writes the easting first.
#[must_use]
pub fn northing_first(crs: &Crs) -> bool {
    horizontal(crs).and_then(system).is_some_and(|s| matches!(s.axes.as_bytes().first(), Some(b'N' | b'S')))
}

/// What the heights of a system are above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heights {
    /// The ellipsoid, or a local plane that touches it.
    Ellipsoid,
    /// A level surface near the sea's; the name of the system of heights.
    Sea(&'static str),
    /// The system does not tell.
    Untold,
}

/// What the heights of a system are above.
#[must_use]
pub fn heights(crs: &Crs) -> Heights {
    match crs {
        Crs::Enu { .. } => Heights::Ellipsoid,
        Crs::Epsg(code) if system(*code).is_some_and(|s| s.kind == Kind::Projected && s.height_unit.is_some()) => {
            Heights::Ellipsoid
        }
        _ => vertical(crs).and_then(system).map_or(Heights::Untold, |s| Heights::Sea(s.name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_a_system() {
        assert!(LINES.is_sorted_by_key(|(code, _)| *code) && LINES.len() > 7000);
        for (code, line) in LINES.iter() {
            let system = parse(line).unwrap_or_else(|| panic!("{line}"));
            assert_eq!(system.code, *code);
            assert!(!system.name.is_empty(), "{line}");
            assert_eq!(system.kind == Kind::Compound, system.parts.is_some(), "{line}");
            assert_eq!(
                system.kind == Kind::Vertical,
                system.kind != Kind::Compound && system.plan_unit.is_none() && system.height_unit.is_some(),
                "{line}"
            );
        }
    }

    #[test]
    fn systems_are_what_epsg_says() {
        let utm = system(25832).unwrap();
        assert_eq!(
            (utm.kind, utm.plan_unit, utm.axes, utm.name),
            (Kind::Projected, Some(1.0), "EN", "ETRS89 / UTM zone 32N")
        );
        assert_eq!(system(7415).unwrap().parts, Some((28992, 5709)));
        assert_eq!(system(2263).unwrap().in_metres, Some(32118));
        assert_eq!(system(4326).unwrap().kind, Kind::Geographic);
        assert_eq!(system(4978).unwrap().kind, Kind::Geocentric);
        assert_eq!(system(5773).unwrap().kind, Kind::Vertical);
        for none in [9122, 7019, 9102, 999, 102_100, 999_999] {
            assert_eq!(system(none), None, "{none}");
        }
    }

    #[test]
    fn planes_heights_and_axes_are_found() {
        let pair = Crs::Compound { horizontal: 25832, vertical: 7837 };
        assert_eq!((horizontal(&pair), vertical(&pair)), (Some(25832), Some(7837)));
        assert_eq!((horizontal(&Crs::Epsg(7415)), vertical(&Crs::Epsg(7415))), (Some(28992), Some(5709)));
        assert_eq!(heights(&Crs::Epsg(7415)), Heights::Sea("NAP height"));
        assert_eq!(heights(&Crs::Epsg(25832)), Heights::Untold);
        for code in [2180, 3006, 31467, 31256, 6677, 2193, 3879, 3035] {
            assert!(northing_first(&Crs::Epsg(code)), "{code}");
        }
        for code in [25832, 7415, 28992, 2154, 27700, 32633, 2056] {
            assert!(!northing_first(&Crs::Epsg(code)), "{code}");
        }
    }

    #[test]
    fn areas_may_cross_the_date_line() {
        let fiji = Area { west: 176.0, south: -20.0, east: -178.0, north: -12.0 };
        assert!(
            fiji.contains(179.0, -17.0, 0.0) && fiji.contains(-179.0, -17.0, 0.0) && fiji.contains(175.5, -17.0, 1.0)
        );
        assert!(!fiji.contains(0.0, -17.0, 1.0) && !fiji.contains(179.0, 17.0, 1.0));
        let world = Area { west: -180.0, south: -90.0, east: 180.0, north: 90.0 };
        assert!(world.contains(13.0, 52.0, 0.0));
    }
}
