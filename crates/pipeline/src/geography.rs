//! Where a city lies on Earth: whether that can be, and how high its zero is.

use gable_geometry::{Crs, DVec3};
use gable_reference_systems::{Heights, Projection, heights, horizontal, system, undulation};

/// How far outside of a system's area a city may lie, degrees: programs use UTM zones beyond their borders. Local coordinates taken for those of
/// a UTM zone lie on the equator, 1.49° beyond the zone.
const MARGIN: f64 = 1.0;
/// How much longer or shorter than on the ground lengths of the plane may be.
const DISTORTION: f64 = 0.01;

/// What is odd about a place (world coordinates, metres) in its system: in the singular, and what follows of it.
pub(crate) fn judge(crs: &Crs, centre: DVec3) -> Option<(&'static str, String)> {
    let known = system(horizontal(crs)?)?;
    let projection = Projection::of(crs)?;
    let at = format!("{:.0} {:.0}", centre.x, centre.y);
    let outside = "mesh outside of the area of its reference system";
    let what_to_do = "if its coordinates are local, give their origin by --origin x,y,z; if they are of another system, say by --crs which";
    let Some(place) = projection.place(centre.x, centre.y) else {
        return Some((outside, format!("{at} is no place in {crs} ({}): {what_to_do}", known.name)));
    };
    if let Some(area) = known.area
        && !area.contains(place.longitude, place.latitude, MARGIN)
    {
        let (west, south, east, north) = (area.west, area.south, area.east, area.north);
        return Some((
            outside,
            format!(
                "{at} in {crs} ({}) would be {:.2}° east, {:.2}° north; it is for {west}° to {east}° east, {south}° to {north}° north: {what_to_do}",
                known.name, place.longitude, place.latitude
            ),
        ));
    }
    let scale = place.scale;
    if (scale - 1.0).abs() > DISTORTION {
        return Some((
            "reference system that distorts lengths here",
            format!(
                "lengths in {crs} ({}) are {scale:.2} times those on the ground, areas {:.2} times, heights are not: transform the mesh to a \
                 local system, such as the UTM zone, for true sizes and slopes",
                known.name,
                scale * scale
            ),
        ));
    }
    None
}

/// The height of the zero of a city's heights above the ellipsoid.
pub(crate) struct Zero {
    /// Metres.
    pub(crate) metres: f64,
    /// What there is to say of it, and what follows of it.
    pub(crate) said: Option<(&'static str, String)>,
}

/// The height of the zero of heights above the ellipsoid at a place (world coordinates, metres): what the user gives, else the geoid of
/// EGM96 where the system tells that its heights are above the sea, else 0.
pub(crate) fn zero(crs: &Crs, centre: DVec3, given: Option<f64>) -> Zero {
    if let Some(metres) = given {
        return Zero { metres, said: None };
    }
    let place = Projection::of(crs).and_then(|projection| projection.degrees(centre.x, centre.y));
    let Some((longitude, latitude)) = place else { return Zero { metres: 0.0, said: None } };
    let geoid = undulation(longitude, latitude);
    match heights(crs) {
        Heights::Ellipsoid => Zero { metres: 0.0, said: None },
        Heights::Sea(name) => Zero {
            metres: geoid,
            said: Some((
                "shift of heights in 3D Tiles",
                format!(
                    "heights in {name} are {geoid:.1} m above the ellipsoid here by EGM96, good to about a metre: set output.geoid to the \
                     undulation in metres if you know it better"
                ),
            )),
        },
        Heights::Untold => Zero {
            metres: 0.0,
            said: Some((
                "reference system that does not tell what heights are above",
                format!(
                    "3D Tiles take them for ellipsoidal: if they are above the sea, set output.geoid={geoid:.1} (by EGM96), or name the \
                     heights, as in --crs EPSG:25832+7837"
                ),
            )),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    fn judged(text: &str, x: f64, y: f64) -> Option<String> {
        judge(&text.parse().unwrap(), dvec3(x, y, 0.0)).map(|(what, why)| format!("{what}: {why}"))
    }

    #[test]
    fn a_city_in_its_system_is_not_odd() {
        for (text, x, y) in [
            ("EPSG:25832", 691_000.0, 5_334_000.0),
            ("EPSG:25832+7837", 691_000.0, 5_334_000.0),
            ("EPSG:7415", 84_000.0, 447_000.0),
            ("EPSG:2180", 637_000.0, 487_000.0),
            ("EPSG:27700", 530_000.0, 180_000.0),
            ("EPSG:2154", 650_000.0, 6_860_000.0),
            // Just beyond the zone's border.
            ("EPSG:25832", 730_000.0, 5_334_000.0),
            ("ENU:48,11", 0.0, 0.0),
        ] {
            assert_eq!(judged(text, x, y), None, "{text} {x} {y}");
        }
        assert!(judge(&Crs::Unknown, DVec3::ZERO).is_none());
    }

    #[test]
    fn local_coordinates_and_those_of_another_system_are_odd() {
        for (text, x, y) in [
            ("EPSG:32632", 60.0, 50.0),
            ("EPSG:25832", 4_321_000.0, 3_210_000.0),
            ("EPSG:7415", 691_000.0, 5_334_000.0),
            ("EPSG:28992+5709", 60.0, 50.0),
            ("EPSG:27700", 60.0, -900_000.0),
        ] {
            let said = judged(text, x, y).unwrap_or_default();
            assert!(said.contains("outside of the area") && said.contains("--origin"), "{text}: {said}");
        }
    }

    #[test]
    fn distortion_is_told() {
        let said = judged("EPSG:3857", 1_492_000.0, 6_800_000.0).unwrap();
        assert!(said.contains("1.63 times") && said.contains("areas 2.6"), "{said}");
        assert_eq!(judged("EPSG:3857", 1_492_000.0, 300_000.0), None, "at the equator it is true");
    }

    #[test]
    fn zeros_of_heights() {
        let of = |text: &str, x, y, given| zero(&text.parse().unwrap(), dvec3(x, y, 0.0), given);
        let nap = of("EPSG:7415", 84_000.0, 447_000.0, None);
        assert!((nap.metres - 43.2).abs() < 1.0 && nap.said.unwrap().1.contains("NAP height"));
        let norway = of("EPSG:25832+5941", 597_000.0, 6_643_000.0, None);
        assert!((norway.metres - 39.5).abs() < 1.5, "{}", norway.metres);
        let untold = of("EPSG:25832", 691_000.0, 5_334_000.0, None);
        assert_eq!(untold.metres, 0.0);
        assert!(untold.said.unwrap().1.contains("output.geoid=4"));
        assert_eq!(of("EPSG:25832", 691_000.0, 5_334_000.0, Some(46.5)).metres, 46.5);
        assert!(of("ENU:48,11,520", 0.0, 0.0, None).said.is_none());
    }
}
