//! Whether the triangles look like a city in metres with z up.

use crate::counts::Counts;
use crate::error::SceneError;
use crate::placement::Axis;
use gable_geometry::DVec3;
use std::path::Path;

/// Triangles from which on their mean size tells of the scale.
const MANY: u64 = 1000;

/// Sums over a stream of triangles.
#[derive(Clone, Debug)]
pub(crate) struct Survey {
    min: DVec3,
    max: DVec3,
    /// Sum of the area vectors, m².
    vector: DVec3,
    /// Sum of the area vectors' absolute components: area as seen along each axis, m².
    projected: DVec3,
    area: f64,
    triangles: u64,
    heights: Heights,
}

/// Moments of the heights over the plan, from the first height on.
#[derive(Clone, Copy, Debug, Default)]
struct Heights {
    base: f64,
    weight: f64,
    first: f64,
    second: f64,
    third: f64,
}

impl Heights {
    #[inline]
    fn add(&mut self, height: f64, weight: f64) {
        if self.weight == 0.0 {
            self.base = height;
        }
        let z = height - self.base;
        self.weight += weight;
        self.first += weight * z;
        self.second += weight * z * z;
        self.third += weight * z * z * z;
    }

    /// Positive where little stands high above much: houses on ground.
    fn skewness(&self) -> f64 {
        let mean = self.first / self.weight;
        let second = self.second / self.weight;
        let variance = second - mean * mean;
        let third = self.third / self.weight - 3.0 * mean * second + 2.0 * mean.powi(3);
        if variance > 0.0 { third / variance.powf(1.5) } else { 0.0 }
    }
}

impl Survey {
    pub(crate) fn new() -> Self {
        Self {
            min: DVec3::INFINITY,
            max: DVec3::NEG_INFINITY,
            vector: DVec3::ZERO,
            projected: DVec3::ZERO,
            area: 0.0,
            triangles: 0,
            heights: Heights::default(),
        }
    }

    /// Adds a triangle; false, and nothing added, if it has no area.
    #[inline]
    pub(crate) fn add(&mut self, corners: &[DVec3; 3]) -> bool {
        let [a, b, c] = *corners;
        let vector = (b - a).cross(c - a) * 0.5;
        let area = vector.length();
        if area == 0.0 {
            return false;
        }
        self.min = self.min.min(a).min(b).min(c);
        self.max = self.max.max(a).max(b).max(c);
        self.vector += vector;
        self.projected += vector.abs();
        self.area += area;
        self.triangles += 1;
        self.heights.add((a.z + b.z + c.z) / 3.0, vector.z.abs());
        true
    }

    /// Triangles so far.
    pub(crate) fn triangles(&self) -> u64 {
        self.triangles
    }

    /// Writes the sums into the counts.
    pub(crate) fn report(&self, counts: &mut Counts) {
        counts.triangles = self.triangles;
        if self.triangles > 0 {
            (counts.min, counts.max) = (self.min.to_array(), self.max.to_array());
        }
        counts.area = self.area;
    }

    /// Says what is wrong with the whole; `assumed` is the file's axis that was taken to point up, where it was not given.
    pub(crate) fn check(&self, path: &Path, assumed: Option<Axis>) -> Result<(), SceneError> {
        if self.triangles == 0 {
            return Err(SceneError::NoTriangles { path: path.to_owned() });
        }
        if let Some(what) = self.nonsense() {
            let extent = self.max - self.min;
            let path = path.to_owned();
            return Err(SceneError::NonsenseScale { path, extent_x: extent.x, extent_y: extent.y, what });
        }
        let Some(assumed) = assumed else { return Ok(()) };
        if self.lies_on_its_side() {
            let extent = self.max - self.min;
            let side = if self.vector.y < 0.0 { Axis::MinusY } else { Axis::Y };
            return Err(SceneError::OnItsSide {
                path: path.to_owned(),
                assumed: assumed.name(),
                seems: assumed.under(side).name(),
                area_y: self.projected.y,
                area_z: self.projected.z,
                extent: extent.to_array(),
            });
        }
        if self.stands_on_its_head() {
            let seems = assumed.under(Axis::MinusZ).name();
            return Err(SceneError::OnItsHead { path: path.to_owned(), assumed: assumed.name(), seems });
        }
        Ok(())
    }

    /// What is wrong with the scale, if something is.
    fn nonsense(&self) -> Option<&'static str> {
        let extent = self.max - self.min;
        let plan = extent.x.max(extent.y);
        let largest = self.min.abs().max(self.max.abs());
        // Geographic coordinates: plan in degrees, heights in metres, so that it stands up like a needle.
        let in_degrees = largest.x <= 180.0 && largest.y <= 90.0 && plan < 5.0;
        let off_centre = self.min.abs().max_element() > 1.0;
        if in_degrees && off_centre && (plan < 1.0 || extent.z > plan) {
            return Some("these look like degrees: give coordinates in a projected system, in metres");
        }
        if plan < 1.0 {
            return Some("a city measures more than a metre: are the units kilometres, or is it scaled?");
        }
        // The mean triangle of a city mesh is between a hand and a house, whatever the extent.
        let mean = self.area / self.triangles as f64;
        if self.triangles >= MANY && mean < 1.0e-6 {
            return Some("its triangles measure less than a square millimetre on average: are the units kilometres?");
        }
        if self.triangles >= MANY && mean > 2.5e3 {
            return Some("its triangles measure more than 50 m on average: are the units millimetres or centimetres?");
        }
        if plan > 1.0e6 {
            return Some("a city measures less than 1000 km: are the units millimetres, or are there stray vertices?");
        }
        if largest.z > 1.0e5 {
            return Some(
                "heights beyond 100 km: these look like earth-centred coordinates: \
                 give them in a projected or local system, z up",
            );
        }
        None
    }

    /// Whether y, not z, is the axis that most of the surface faces and along which it is flat.
    ///
    /// A mesh of a city from the air is an open sheet: its area vectors sum to its footprint,
    /// upright, whatever stands on it. A model on its side shows its footprint along y instead.
    /// Closed models (their area vectors cancel) are judged by the area seen along the axes.
    fn lies_on_its_side(&self) -> bool {
        let extent = self.max - self.min;
        if extent.y > 0.7 * extent.x.max(extent.z) {
            return false;
        }
        let sheet = self.vector.abs();
        if sheet.max_element() > 0.02 * self.area {
            let footprint = extent.x * extent.z;
            sheet.y > 2.0 * sheet.z && sheet.y > sheet.x && sheet.y > 0.2 * footprint
        } else {
            let seen = self.projected;
            seen.y > 1.5 * seen.z && seen.y > 1.5 * seen.x && extent.y < 0.5 * extent.x.min(extent.z)
        }
    }
}

impl Survey {
    /// Whether the faces look down and most of the plan lies high, with less of it deep below: houses that hang from the ground.
    ///
    /// A mesh whose faces merely run the wrong way around has its ground below.
    fn stands_on_its_head(&self) -> bool {
        self.vector.z < -0.5 * self.projected.z && self.heights.skewness() < -0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    /// A sheet of n × n cells of 10 m with a tower of the height `h(i, j)` on each.
    fn towers(n: i32, h: impl Fn(i32, i32) -> f64) -> Survey {
        let mut survey = Survey::new();
        let mut quad = |p: [DVec3; 4]| {
            survey.add(&[p[0], p[1], p[2]]);
            survey.add(&[p[0], p[2], p[3]]);
        };
        for j in 0..n {
            for i in 0..n {
                let (x, y, z) = (f64::from(i) * 10.0, f64::from(j) * 10.0, h(i, j));
                let at = |dx: f64, dy: f64, z: f64| dvec3(x + dx, y + dy, z);
                quad([at(0.0, 0.0, z), at(10.0, 0.0, z), at(10.0, 10.0, z), at(0.0, 10.0, z)]);
                let east = if i + 1 < n { h(i + 1, j) } else { z };
                quad([at(10.0, 0.0, east), at(10.0, 10.0, east), at(10.0, 10.0, z), at(10.0, 0.0, z)]);
                let north = if j + 1 < n { h(i, j + 1) } else { z };
                quad([at(0.0, 10.0, z), at(10.0, 10.0, z), at(10.0, 10.0, north), at(0.0, 10.0, north)]);
            }
        }
        survey
    }

    fn on_its_side(survey: &Survey) -> Survey {
        let turn = |v: DVec3| dvec3(v.x, v.z, -v.y);
        let (a, b) = (turn(survey.min), turn(survey.max));
        Survey {
            min: a.min(b),
            max: a.max(b),
            vector: turn(survey.vector),
            projected: turn(survey.projected).abs(),
            ..survey.clone()
        }
    }

    #[test]
    fn a_city_on_its_side_is_seen_even_with_towers() {
        for height in [0.0, 8.0, 60.0, 150.0] {
            let city = towers(40, |i, j| if (i / 2 + j / 2) % 2 == 0 { height } else { 0.0 });
            assert!(!city.lies_on_its_side(), "upright, towers of {height} m");
            assert!(on_its_side(&city).lies_on_its_side(), "on its side, towers of {height} m");
        }
    }

    #[test]
    fn a_city_on_its_head_is_seen_and_one_inside_out_is_not() {
        let city = |flip: DVec3, swap: bool| {
            let mut survey = Survey::new();
            let upright = |i: i32, j: i32| if i % 5 == 0 && j % 4 == 0 { 8.0 } else { 0.05 * f64::from(i) };
            let mut quad = |mut p: [DVec3; 4]| {
                if swap {
                    p.reverse();
                }
                survey.add(&[p[0] * flip, p[1] * flip, p[2] * flip]);
                survey.add(&[p[0] * flip, p[2] * flip, p[3] * flip]);
            };
            for j in 0..40 {
                for i in 0..40 {
                    let (x, y, z) = (f64::from(i), f64::from(j), upright(i, j));
                    quad([dvec3(x, y, z), dvec3(x + 1.0, y, z), dvec3(x + 1.0, y + 1.0, z), dvec3(x, y + 1.0, z)]);
                }
            }
            survey.stands_on_its_head()
        };
        assert!(!city(DVec3::ONE, false));
        assert!(!city(DVec3::ONE, true), "faces the wrong way around");
        assert!(!city(dvec3(-1.0, 1.0, 1.0), false), "mirrored");
        assert!(city(dvec3(1.0, -1.0, -1.0), false), "on its head");
    }

    #[test]
    fn nonsense_scales_are_named() {
        let at = |scale: DVec3, shift: DVec3| {
            let mut survey = towers(10, |i, _| f64::from(i));
            (survey.min, survey.max) = (survey.min * scale + shift, survey.max * scale + shift);
            survey.nonsense()
        };
        assert_eq!(at(DVec3::ONE, dvec3(4.0e5, 5.7e6, 0.0)), None);
        assert!(at(DVec3::splat(1e-3), DVec3::ZERO).is_some_and(|w| w.contains("more than a metre")));
        assert!(at(DVec3::splat(1e5), DVec3::ZERO).is_some_and(|w| w.contains("less than 1000 km")));
        assert!(at(dvec3(1e-5, 1e-5, 1.0), dvec3(8.5, 50.1, 100.0)).is_some_and(|w| w.contains("degrees")));
        assert!(at(DVec3::ONE, dvec3(4.0e6, 6.0e5, 4.9e6)).is_some_and(|w| w.contains("earth-centred")));
    }
}
