//! Soft regularities between roof planes: level, along the facades, of equal slope, of equal height.
//!
//! Zhu 2018, §5.3, forces every plane into a roof direction before it is fitted, which flattens low slopes and
//! turns skew ones. Here planes are fitted freely first, and a regularity is imposed only if the heights do
//! not speak against it: the sum of squared distances may rise by what correlated noise would explain.

use crate::equalise::{equal_heights, equal_slopes};
use crate::facade_directions::{self, difference};
use crate::partition::interior_moments;
use crate::plane_fit::PlaneFit;
use crate::{Planes, UNASSIGNED};
use gable_geometry::{Covariance3, DVec2, Plane, dvec3};
use gable_raster::Raster;
use std::f64::consts::FRAC_PI_2;

/// Parameters of [`regularise()`].
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Planes flatter than this may become level, degrees; small planes whose slope is less certain, up to twice
    /// its standard deviation, but never over 8°.
    pub level: f64,
    /// Largest change of azimuth towards a facade direction, degrees.
    pub turn: f64,
    /// Largest difference of slopes that become equal, and largest change of one, degrees.
    pub slope: f64,
    /// Largest difference of level planes that become equally high, metres; 0 turns this off.
    pub height: f64,
    /// Area over which the noise of the heights is correlated, m².
    pub noise_area: f64,
    /// The increase of the sum of squares that is allowed, in units of σ² · `noise_area` (χ² with three degrees of
    /// freedom is below 6.25 in 90 % of cases).
    pub tolerance: f64,
    /// Largest growth of a plane's rms, metres, whatever the noise.
    pub max_growth: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { level: 3.0, turn: 10.0, slope: 5.0, height: 0.12, noise_area: 14.0, tolerance: 6.0, max_growth: 0.06 }
    }
}

/// How many planes each regularity changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Became level.
    pub levelled: usize,
    /// Turned to a facade direction, or to one that roof planes share.
    pub turned: usize,
    /// Share their slope with another plane.
    pub equal_slopes: usize,
    /// Level planes that share their height with another.
    pub equal_heights: usize,
}

/// Imposes regularities on planes, each only where the pixels tolerate it, and fits the offsets again.
///
/// 1. nearly level planes become level;
/// 2. azimuths near a facade direction (modulo 90°) turn to it, then those that remain to a direction that several
///    planes share;
/// 3. slopes become equal: of opposite planes first (z-symmetry: their ridge becomes level), then of parallel ones,
///    then of those at right angles (hips); a common slope is the least-squares one of all its planes;
/// 4. level planes of nearly equal height become equally high.
///
/// `facade_angles` in radians. `height` is the raster that the planes were detected on; the figures of the planes
/// (rms) follow. O(pixels), and O(pairs · log) for pairs of planes, of more than 2,000 those within 100 m of each other.
///
/// # Panics
/// If height and labels differ in size.
pub fn regularise(planes: &mut Planes, height: &Raster<f32>, facade_angles: &[f64], params: &Params) -> Changes {
    assert_eq!(height.window().len(), planes.labels.window().len(), "height and labels need the same window");
    let mut changes = Changes::default();
    let mut items = items(planes, height, params);
    for item in &mut items {
        let steepest = 2.0 * item.uncertainty(item.direction, params.noise_area);
        let bound = params.level.to_radians().tan().max(steepest.min(8f64.to_radians().tan()));
        if item.slope <= bound && item.tolerates(DVec2::ZERO) {
            changes.levelled += usize::from(item.slope > 0.0);
            (item.slope, item.direction) = (0.0, DVec2::ZERO);
        }
    }
    changes.turned += turn(&mut items, facade_angles, params);
    let shared: Vec<f64> = {
        let free = items.iter().filter(|i| i.slope > 0.0 && !i.turned);
        let votes = free.map(|i| (i.direction.to_angle(), i.area * i.slope));
        let tolerance = 0.5 * params.turn;
        let find = facade_directions::Params { tolerance, min_share: 0.0, max_frames: 4 };
        facade_directions::histogram(votes, &find).iter().map(|f| f.angle).collect()
    };
    changes.turned += turn(&mut items, &shared, params);
    changes.equal_slopes = equal_slopes(&mut items, params.slope.to_radians());
    for (plane, item) in planes.planes.iter_mut().zip(&items) {
        plane.plane = through(item.gradient(), &item.moments);
    }
    changes.equal_heights = equal_heights(planes, &items, params.height);
    measure(planes, height);
    changes
}

fn items(planes: &Planes, height: &Raster<f32>, params: &Params) -> Vec<PlaneFit> {
    let window = height.window();
    let reach = ((0.4 / window.step).round() as usize).max(1);
    let position = |p: usize| {
        let at = window.centre(p % window.width, p / window.width);
        dvec3(at.x, at.y, f64::from(height.values()[p]))
    };
    let labels = planes.labels.values();
    let moments = interior_moments(labels, window.width, window.height, planes.planes.len(), reach, position);
    let build = |(plane, moments): (&crate::RoofPlane, Covariance3)| {
        let fit = moments.height_plane().unwrap_or(plane.plane);
        let gradient = DVec2::new(fit.a, fit.b);
        let mut item = PlaneFit {
            moments,
            area: plane.area,
            direction: gradient.normalize_or_zero(),
            slope: gradient.length(),
            free_slope: gradient.length(),
            turned: false,
            limit: 0.0,
            noise: 0.0,
        };
        let free = item.misfit(gradient);
        item.noise = free.clamp(0.04 * 0.04, 0.16 * 0.16);
        let explained = params.tolerance * item.noise * params.noise_area / plane.area.max(1.0);
        let growth = free.sqrt() + params.max_growth;
        item.limit = (free + explained + 1e-6).min(growth * growth);
        item
    };
    planes.planes.iter().zip(moments).map(build).collect()
}

fn turn(items: &mut [PlaneFit], angles: &[f64], params: &Params) -> usize {
    let mut turned = 0;
    for item in items.iter_mut().filter(|i| i.slope > 0.0 && !i.turned) {
        let azimuth = item.direction.to_angle();
        let offs = angles.iter().map(|&f| difference(azimuth, f));
        let Some(off) = offs.min_by(|a, b| a.abs().total_cmp(&b.abs())) else { continue };
        // The azimuth of a gentle slope is uncertain.
        let sigma = item.uncertainty(item.direction.perp(), params.noise_area) / item.slope;
        if off.abs() > params.turn.to_radians().max((2.0 * sigma).min(0.5 * FRAC_PI_2)) {
            continue;
        }
        let direction = DVec2::from_angle(azimuth - off);
        let (num, den) = item.along(direction);
        let slope = num / den.max(1e-12);
        if slope > 0.0 && item.tolerates(direction * slope) {
            (item.direction, item.slope, item.turned) = (direction, slope, true);
            turned += 1;
        }
    }
    turned
}

fn through(gradient: DVec2, moments: &Covariance3) -> Plane {
    let m = moments.centroid();
    Plane { a: gradient.x, b: gradient.y, c: m.z - gradient.dot(m.truncate()) }
}

fn measure(planes: &mut Planes, height: &Raster<f32>) {
    let window = height.window();
    let mut sums = vec![0.0; planes.planes.len()];
    for (p, &label) in planes.labels.values().iter().enumerate() {
        if label != UNASSIGNED {
            let at = window.centre(p % window.width, p / window.width);
            let d = planes.planes[label as usize].plane.distance(at.extend(f64::from(height.values()[p])));
            sums[label as usize] += d * d;
        }
    }
    for (plane, sum) in planes.planes.iter_mut().zip(sums) {
        plane.rms = (sum / plane.inliers.max(1) as f64).sqrt();
    }
}
