//! Roof planes by RANSAC on the height map: the published detector, kept as the baseline.

use crate::local_fit::Field;
use crate::partition::{Partition, residual_sum};
use crate::roof_plane::{Planes, UNASSIGNED};
use crate::{grow, roof_directions::RoofDirection};
use gable_geometry::{Counter, Covariance3, DVec3, dvec3};
use gable_raster::{Connectivity, Raster, flood};

/// Parameters of [`detect`]. Zhu 2018 gives none of them; these are common ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Largest distance of an inlier, metres (ε).
    pub distance: f64,
    /// Largest angle between the normals of an inlier and the plane, degrees (α).
    pub angle: f64,
    /// Smallest plane, m² on the ground (τ).
    pub min_area: f64,
    /// Probability with which a plane of that size may be overlooked.
    pub overlooked: f64,
    /// Seed of the samples.
    pub seed: u64,
}

impl Default for Params {
    fn default() -> Self {
        Self { distance: 0.25, angle: 25.0, min_area: 3.0, overlooked: 0.01, seed: 1 }
    }
}

/// Most samples for one plane: bounds the work where the smallest plane is a tiny part of the building.
const MAX_SAMPLES: usize = 4000;

/// Planes by efficient RANSAC (Schnabel, Wahl & Klein 2007) on the pixels of a height map, each hypothesis
/// snapped to the nearest roof direction (Zhu 2018, §5.3).
///
/// A sample is a pixel and two more within a distance drawn from 1, 2, 4 and 8 m (instead of octree levels). Its
/// plane keeps its centroid and takes the direction (or mate) nearest to its normal, whatever the angle;
/// without directions it stays free. The score is the number of unassigned pixels within `distance` whose local
/// normal agrees, first on a sixteenth of them, for the best few on all. The largest connected part of the best
/// plane is taken, its offset fitted again, and the search goes on until a plane of the smallest size would have
/// been found with the wanted probability. Deterministic for a seed. Planes come in the raster's coordinates.
///
/// # Panics
/// If the rasters differ in size.
#[must_use]
pub fn detect(height: &Raster<f32>, mask: &Raster<bool>, directions: &[RoofDirection], params: &Params) -> Planes {
    let window = height.window();
    assert_eq!(window.len(), mask.window().len(), "height and mask need the same window");
    let field = Field::new(height, mask, 0.6);
    let mut partition = Partition::new(&field, params.distance, 0.0);
    let min_pixels = (params.min_area / (window.step * window.step)).ceil() as usize;
    let mut rng = Counter::new(params.seed);
    let all_directions: Vec<DVec3> = directions.iter().flat_map(|d| [d.normal, d.mate()]).collect();
    let mut free: Vec<u32> = (0..field.z.len() as u32).filter(|&p| !field.z[p as usize].is_nan()).collect();
    while free.len() >= min_pixels && partition.planes.len() + 1 < UNASSIGNED as usize {
        // Schnabel, §4.4: chance of a sample of a plane of n pixels among N on one of four levels.
        let chance = (min_pixels as f64 / free.len() as f64 / 4.0).min(0.999);
        let needed = ((params.overlooked.ln() / (1.0 - chance).ln()).ceil() as usize).clamp(1, MAX_SAMPLES);
        let sparse = free.iter().map(|&p| p as usize).skip(rng.index(16)).step_by(16);
        let sparse: Vec<(usize, (f64, f64))> = sparse.map(|p| (p, field.position(p))).collect();
        let mut candidates: Vec<(usize, [f64; 3])> = Vec::new();
        for _ in 0..needed {
            let Some(plane) = sample(&partition, &free, &all_directions, &mut rng) else { continue };
            let hypothesis = Hypothesis::new(plane, params);
            let score = sparse.iter().filter(|&&(p, at)| hypothesis.holds(&field, p, at)).count();
            candidates.push((score, plane));
        }
        candidates.sort_by_key(|c| std::cmp::Reverse(c.0));
        candidates.truncate(8);
        let mut best: Vec<usize> = Vec::new();
        let mut plane = [0.0; 3];
        for &(_, candidate) in &candidates {
            let part = largest_part(&partition, candidate, params);
            if part.len() > best.len() {
                (best, plane) = (part, candidate);
            }
        }
        if best.len() < min_pixels {
            break;
        }
        let label = partition.planes.len() as u16;
        let mut moments = Covariance3::default();
        for &p in &best {
            partition.labels[p] = label;
            let (x, y) = field.position(p);
            moments.add(dvec3(x, y, f64::from(field.z[p])), 1.0);
        }
        partition.planes.push(fitted(plane, &moments, all_directions.is_empty()));
        free.retain(|&p| partition.labels[p as usize] == UNASSIGNED);
    }
    grow::finish(&partition, height)
}

/// The plane through three pixels near each other, turned to the nearest direction.
fn sample(partition: &Partition<'_>, free: &[u32], directions: &[DVec3], rng: &mut Counter) -> Option<[f64; 3]> {
    let field = partition.field;
    let point = |p: usize| {
        let (x, y) = field.position(p);
        dvec3(x, y, f64::from(field.z[p]))
    };
    let first = free[rng.index(free.len())] as usize;
    let reach = ([1.0, 2.0, 4.0, 8.0][rng.index(4)] / field.step) as i64;
    let mut near = || {
        let i = (first % field.width) as i64 + rng.range(-reach as f64, reach as f64 + 1.0).floor() as i64;
        let j = (first / field.width) as i64 + rng.range(-reach as f64, reach as f64 + 1.0).floor() as i64;
        let inside = i >= 0 && j >= 0 && i < field.width as i64 && j < field.height as i64;
        let p = inside.then(|| j as usize * field.width + i as usize)?;
        (partition.labels[p] == UNASSIGNED && !field.z[p].is_nan()).then_some(p)
    };
    let (a, b, c) = (point(first), point(near()?), point(near()?));
    let mut normal = (b - a).cross(c - a).try_normalize()?;
    normal *= normal.z.signum();
    if let Some(d) = directions.iter().max_by(|p, q| p.dot(normal).total_cmp(&q.dot(normal))) {
        normal = *d;
    }
    let plane = gable_geometry::Plane::from_normal(normal, (a + b + c) / 3.0)?;
    (plane.slope() < 1.4).then_some([plane.a, plane.b, plane.c])
}

/// A plane, ready to be asked for its inliers.
struct Hypothesis {
    plane: [f64; 3],
    /// Squared length of the normal whose z is 1.
    norm2: f64,
    /// Largest squared vertical distance of an inlier.
    reach2: f64,
    /// Least cosine of the angle to the normal of an inlier.
    cosine: f64,
}

impl Hypothesis {
    fn new(plane: [f64; 3], params: &Params) -> Self {
        let norm2 = 1.0 + plane[0] * plane[0] + plane[1] * plane[1];
        Self {
            plane,
            norm2,
            reach2: params.distance * params.distance * norm2,
            cosine: params.angle.to_radians().cos(),
        }
    }

    #[inline]
    fn holds(&self, field: &Field, pixel: usize, (x, y): (f64, f64)) -> bool {
        let [a, b, c] = self.plane;
        let d = f64::from(field.z[pixel]) - (a * x + b * y + c);
        // Most pixels lie elsewhere.
        if d * d > self.reach2 {
            return false;
        }
        let patch = &field.patches[pixel];
        let (pa, pb) = (f64::from(patch.a), f64::from(patch.b));
        (1.0 + a * pa + b * pb) / (self.norm2 * (1.0 + pa * pa + pb * pb)).sqrt() >= self.cosine
    }
}

/// The largest connected set (of four neighbours) of a plane's unassigned inliers.
fn largest_part(partition: &Partition<'_>, plane: [f64; 3], params: &Params) -> Vec<usize> {
    let field = partition.field;
    let n = field.z.len();
    let hypothesis = Hypothesis::new(plane, params);
    let mut open: Vec<bool> = (0..n)
        .map(|p| {
            partition.labels[p] == UNASSIGNED && !field.z[p].is_nan() && hypothesis.holds(field, p, field.position(p))
        })
        .collect();
    let (mut best, mut part) = (Vec::new(), Vec::new());
    for seed in 0..n {
        if !std::mem::take(&mut open[seed]) {
            continue;
        }
        flood(seed, field.width, field.height, Connectivity::Four, &mut part, |pixel| std::mem::take(&mut open[pixel]));
        if part.len() > best.len() {
            std::mem::swap(&mut part, &mut best);
        }
    }
    best
}

/// The offset through the inliers' centroid; free planes are fitted as a whole.
fn fitted([a, b, c]: [f64; 3], moments: &Covariance3, free: bool) -> [f64; 3] {
    match moments.height_plane() {
        Some(p) if free && residual_sum(moments).is_finite() => [p.a, p.b, p.c],
        Some(_) => {
            let m = moments.centroid();
            [a, b, m.z - a * m.x - b * m.y]
        }
        None => [a, b, c],
    }
}
