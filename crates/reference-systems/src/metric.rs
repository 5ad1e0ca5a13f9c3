//! What is to be done with coordinates so that they are metres.

use crate::table::{Kind, System, system, systems};
use gable_geometry::Crs;

/// How coordinates of a system become metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Metric {
    /// The system of the metres: the same, or its twin.
    pub crs: Crs,
    /// Metres of the unit of eastings and northings.
    pub plan: f64,
    /// Metres of the unit of heights.
    pub height: f64,
}

/// A system in which there is no modelling. The message says what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{crs} {why}")]
pub struct NotMetric {
    /// The system.
    pub crs: String,
    /// What it is, and what to do.
    pub why: String,
}

/// Says how coordinates of a system become metres.
///
/// A system in feet becomes the same system in metres where EPSG has one (State Plane 2263 becomes 32118), heights included: those of a
/// system that does not tell them are in the unit of its plan. A pair of plane and heights that EPSG has a code for gets that code.
///
/// # Errors
/// If it is no reference system, not a plane, or has no twin in metres.
pub fn metric(crs: &Crs) -> Result<Metric, NotMetric> {
    match crs {
        Crs::Unknown | Crs::Enu { .. } => Ok(Metric { crs: crs.clone(), plan: 1.0, height: 1.0 }),
        Crs::Epsg(code) => {
            let found = known(*code)?;
            if let Some((flat, up)) = found.parts {
                return compound(flat, up, crs);
            }
            let (code, plan) = plane(&found, crs)?;
            Ok(Metric { crs: Crs::Epsg(code), plan, height: found.height_unit.unwrap_or(plan) })
        }
        Crs::Compound { horizontal, vertical } => compound(*horizontal, *vertical, crs),
    }
}

fn compound(flat: u32, up: u32, crs: &Crs) -> Result<Metric, NotMetric> {
    let (flat, plan) = plane(&known(flat)?, crs)?;
    let (up, height) = level(&known(up)?, crs)?;
    let pair = systems().find(|s| s.parts == Some((flat, up)) && !s.deprecated).map(|s| Crs::Epsg(s.code));
    // A pair that EPSG numbers twice keeps its number.
    let same = matches!(crs, Crs::Epsg(code) if system(*code).and_then(|s| s.parts) == Some((flat, up)));
    let crs = if same { crs.clone() } else { pair.unwrap_or(Crs::Compound { horizontal: flat, vertical: up }) };
    Ok(Metric { crs, plan, height })
}

fn known(code: u32) -> Result<System, NotMetric> {
    system(code).ok_or_else(|| NotMetric {
        crs: format!("EPSG:{code}"),
        why: "is no reference system of EPSG (it may be the number of a unit or a datum): give the code of the projected system that the \
              coordinates are in, such as EPSG:25832"
            .to_owned(),
    })
}

/// The plane in metres, and the metres of its unit.
fn plane(found: &System, crs: &Crs) -> Result<(u32, f64), NotMetric> {
    let refused = |why: String| NotMetric { crs: crs.to_string(), why: format!("({}) {why}", found.name) };
    match (found.kind, found.plan_unit) {
        (Kind::Projected, Some(1.0)) => Ok((found.code, 1.0)),
        (Kind::Projected, Some(unit)) => match found.in_metres {
            Some(twin) => Ok((twin, unit)),
            None => Err(refused(format!(
                "is in units of {unit} m, and there is no such system in metres: transform the mesh to a system in metres, such as the UTM zone"
            ))),
        },
        (Kind::Geographic, _) => Err(refused(
            "is in degrees: give the projected system that the coordinates are in; coordinates in degrees have to be transformed, \
             such as to the UTM zone"
                .to_owned(),
        )),
        (Kind::Geocentric, _) => Err(refused(
            "is earth-centred: transform the mesh to a projected system, z up, or to a local one (ENU:latitude,longitude)".to_owned(),
        )),
        (Kind::Vertical, _) => {
            Err(refused("tells heights alone: give the projected system too, as in EPSG:25832+7837".to_owned()))
        }
        (Kind::Compound | Kind::Projected | Kind::Other, _) => {
            Err(refused("is no projected system: give the code of one, such as EPSG:25832".to_owned()))
        }
    }
}

/// The system of heights in metres, and the metres of its unit.
fn level(found: &System, crs: &Crs) -> Result<(u32, f64), NotMetric> {
    let refused = |why: &str| NotMetric { crs: crs.to_string(), why: format!("({}) {why}", found.name) };
    match (found.kind, found.height_unit, found.in_metres) {
        (Kind::Vertical, ..) if found.axes.starts_with('D') => {
            Err(refused("measures depths: give the mesh with heights, z up, and name the system of the heights"))
        }
        (Kind::Vertical, Some(1.0), _) => Ok((found.code, 1.0)),
        (Kind::Vertical, Some(unit), Some(twin)) => Ok((twin, unit)),
        (Kind::Vertical, ..) => {
            Err(refused("is not in metres, and EPSG has no such system that is: leave the heights out"))
        }
        _ => Err(refused("is no system of heights: give a pair such as EPSG:25832+7837")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<(String, f64, f64), String> {
        metric(&text.parse().unwrap()).map(|m| (m.crs.to_string(), m.plan, m.height)).map_err(|e| e.to_string())
    }

    #[test]
    fn metres_stay_and_feet_are_scaled() {
        let us = 0.304_800_609_601_219_24;
        for (given, crs, plan, height) in [
            ("EPSG:25832", "EPSG:25832", 1.0, 1.0),
            ("EPSG:7415", "EPSG:7415", 1.0, 1.0),
            ("EPSG:28992+5709", "EPSG:7415", 1.0, 1.0),
            ("EPSG:25832+7837", "EPSG:25832+7837", 1.0, 1.0),
            ("EPSG:2263", "EPSG:32118", us, us),
            ("EPSG:2263+5703", "EPSG:32118+5703", us, 1.0),
            ("EPSG:2263+6360", "EPSG:32118+5703", us, us),
            ("EPSG:6539", "EPSG:6538", us, us),
            ("ENU:48.1,11.5", "ENU:48.1,11.5", 1.0, 1.0),
        ] {
            assert_eq!(of(given), Ok((crs.to_owned(), plan, height)), "{given}");
        }
    }

    #[test]
    fn what_is_no_plane_is_refused_with_what_to_do() {
        for (given, said) in [
            ("EPSG:4326", "(WGS 84) is in degrees"),
            ("EPSG:4979", "is in degrees"),
            ("EPSG:4978", "is earth-centred"),
            ("EPSG:5773", "(EGM96 height) tells heights alone"),
            // The number of the metre, too, and of a system of the year 1997.
            ("EPSG:9001", "(IGS97) is earth-centred"),
            ("EPSG:9122", "is no reference system of EPSG"),
            ("EPSG:7019", "is no reference system of EPSG"),
            ("EPSG:25832+25833", "(ETRS89 / UTM zone 33N) is no system of heights"),
            ("EPSG:4326+5773", "(WGS 84) is in degrees"),
            ("EPSG:25832+5336", "measures depths"),
            ("EPSG:25832+9122", "EPSG:9122 is no reference system"),
        ] {
            let error = of(given).expect_err(given);
            assert!(error.contains(said), "{given}: {error}");
        }
    }
}
