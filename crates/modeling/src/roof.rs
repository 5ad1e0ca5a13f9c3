//! What kind of roof a building has, and what is said of each of its surfaces.

use gable_city_model::{Attributes, Value};
use gable_geometry::Plane;

/// Slope under which a roof plane counts as flat, radians (5°).
const FLAT: f64 = 0.087;

/// Kinds of roof, in the words of the CityGML code list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoofType {
    /// All of it level.
    Flat,
    /// One slope.
    Monopitch,
    /// Two slopes that face away from each other.
    Gabled,
    /// Four slopes, the shorter sides too.
    Hipped,
    /// Four slopes that meet in a point.
    Pavilion,
    /// Slopes with a steeper lower part.
    Mansard,
    /// Anything else.
    Combination,
}

impl RoofType {
    /// The word that is written.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Monopitch => "monopitch",
            Self::Gabled => "gabled",
            Self::Hipped => "hipped",
            Self::Pavilion => "pavilion",
            Self::Mansard => "mansard",
            Self::Combination => "combination",
        }
    }

    /// The kind of roof that planes with these ground areas (m²) make. Planes under 5 % of the area do not count.
    #[must_use]
    pub fn of(planes: &[(Plane, f64)]) -> Self {
        let total: f64 = planes.iter().map(|p| p.1).sum();
        let main: Vec<&(Plane, f64)> = planes.iter().filter(|p| p.1 > 0.05 * total).collect();
        let sloped: Vec<&(Plane, f64)> = main.iter().copied().filter(|p| p.0.slope() >= FLAT).collect();
        let flat: f64 = main.iter().filter(|p| p.0.slope() < FLAT).map(|p| p.1).sum();
        if sloped.is_empty() {
            return Self::Flat;
        }
        if flat > 0.15 * total {
            return Self::Combination;
        }
        // Distinct azimuths, to within 25°, each with its area and range of slopes.
        let mut sides: Vec<(f64, f64, f64, f64)> = Vec::new();
        for (plane, area) in &sloped {
            let azimuth = (-plane.b).atan2(-plane.a);
            let near = |other: f64| turn(azimuth - other).abs() < 25f64.to_radians();
            if let Some(side) = sides.iter_mut().find(|s| near(s.0)) {
                side.1 += area;
                side.2 = side.2.min(plane.slope());
                side.3 = side.3.max(plane.slope());
            } else {
                sides.push((azimuth, *area, plane.slope(), plane.slope()));
            }
        }
        if sides.iter().filter(|s| s.3 - s.2 > 15f64.to_radians()).count() * 2 >= sides.len() && sloped.len() >= 4 {
            return Self::Mansard;
        }
        let opposite = |i: usize, j: usize| (turn(sides[i].0 - sides[j].0).abs() - std::f64::consts::PI).abs() < 0.44;
        match sides.len() {
            1 => Self::Monopitch,
            2 if opposite(0, 1) => Self::Gabled,
            4 => {
                let areas = sides.iter().map(|s| s.1);
                let (low, high) = (areas.clone().fold(f64::INFINITY, f64::min), areas.fold(0.0, f64::max));
                let paired = (1..4).any(|j| opposite(0, j));
                match (paired && sloped.len() == 4, low > 0.8 * high) {
                    (true, true) => Self::Pavilion,
                    (true, false) => Self::Hipped,
                    _ => Self::Combination,
                }
            }
            _ => Self::Combination,
        }
    }
}

fn turn(angle: f64) -> f64 {
    let t = angle.rem_euclid(std::f64::consts::TAU);
    if t > std::f64::consts::PI { t - std::f64::consts::TAU } else { t }
}

/// Slope and azimuth of a roof surface, in degrees; the azimuth is that of the downhill direction, clockwise from
/// north, and absent where the roof is level.
pub(crate) fn surface_attributes(plane: &Plane) -> Attributes {
    let mut out = Attributes::new();
    let slope = plane.slope().to_degrees();
    out.insert("slope_deg".to_owned(), Value::Number(round(slope, 2)));
    if slope > 0.05 {
        let azimuth = (-plane.a).atan2(-plane.b).to_degrees().rem_euclid(360.0);
        out.insert("azimuth_deg".to_owned(), Value::Number(round(azimuth, 2)));
    }
    out
}

/// Rounded to `digits` decimals.
pub(crate) fn round(value: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    let rounded = (value * scale).round() / scale;
    if rounded == 0.0 { 0.0 } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope(azimuth_deg: f64, slope_deg: f64, area: f64) -> (Plane, f64) {
        let t = slope_deg.to_radians().tan();
        let azimuth = azimuth_deg.to_radians();
        // The plane falls towards the azimuth (clockwise from north).
        (Plane { a: -t * azimuth.sin(), b: -t * azimuth.cos(), c: 0.0 }, area)
    }

    #[test]
    fn kinds() {
        assert_eq!(RoofType::of(&[slope(0.0, 1.0, 100.0)]), RoofType::Flat);
        assert_eq!(RoofType::of(&[slope(40.0, 20.0, 100.0)]), RoofType::Monopitch);
        assert_eq!(RoofType::of(&[slope(10.0, 35.0, 50.0), slope(190.0, 35.0, 50.0)]), RoofType::Gabled);
        let hip = [slope(0.0, 35.0, 60.0), slope(180.0, 35.0, 60.0), slope(90.0, 35.0, 20.0), slope(270.0, 35.0, 20.0)];
        assert_eq!(RoofType::of(&hip), RoofType::Hipped);
        let tent = [0.0, 90.0, 180.0, 270.0].map(|a| slope(a, 30.0, 25.0));
        assert_eq!(RoofType::of(&tent), RoofType::Pavilion);
        let mansard =
            [slope(0.0, 60.0, 30.0), slope(0.0, 20.0, 30.0), slope(180.0, 60.0, 30.0), slope(180.0, 20.0, 30.0)];
        assert_eq!(RoofType::of(&mansard), RoofType::Mansard);
        assert_eq!(RoofType::of(&[slope(0.0, 1.0, 50.0), slope(90.0, 30.0, 50.0)]), RoofType::Combination);
    }

    #[test]
    fn azimuth_is_downhill() {
        let a = surface_attributes(&slope(90.0, 30.0, 1.0).0);
        assert_eq!(a["slope_deg"], Value::Number(30.0));
        assert_eq!(a["azimuth_deg"], Value::Number(90.0));
        assert!(!surface_attributes(&Plane::horizontal(3.0)).contains_key("azimuth_deg"));
    }
}
