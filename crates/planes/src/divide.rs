//! Splitting regions that hold more than one plane.
//!
//! That and [merging](crate::merge) ask the same question: by how much does a second plane lower the sum of squared distances? Noise that is
//! correlated over a few metres lets any two planes fit better than one, by a few times σ² per patch of correlated
//! noise; a second plane must lower the sum by clearly more than that.

use crate::partition::{Partition, residual_sum};
use crate::roof_plane::UNASSIGNED;
use gable_geometry::{Covariance3, dvec3};

/// What is known about the noise, and what a region must have.
pub(crate) struct Evidence {
    /// Area over which the noise of the heights is correlated, m².
    pub(crate) noise_area: f64,
    /// Standard deviations that it can have, metres.
    pub(crate) noise: std::ops::RangeInclusive<f64>,
    /// How many times σ² · `noise_area` the sum of squares (m⁴) must fall for a second plane.
    pub(crate) significance: f64,
    /// Least root mean square by which one plane must miss the smaller of two parts, metres.
    pub(crate) min_effect: f64,
    /// Least area of a region, m².
    pub(crate) min_area: f64,
    /// Least width of a region, metres.
    pub(crate) min_width: f64,
}

impl Evidence {
    /// How much two planes gain over one, as a part of what they must gain to be believed and to matter. `joint`
    /// and `apart` are sums of squares, `weights` those of the two parts, all counted in pixels.
    pub(crate) fn ratio(&self, joint: f64, apart: f64, weights: [f64; 2], pixel_area: f64) -> f64 {
        let weight = weights[0] + weights[1];
        // Bounded above, so that planes that fit badly do not vouch for each other.
        let sigma = (apart / weight.max(1.0)).sqrt().clamp(*self.noise.start(), *self.noise.end());
        let variance = sigma * sigma;
        let believed = (joint - apart) * pixel_area / (self.significance * variance * self.noise_area);
        let smaller = weights[0].min(weights[1]).max(1.0);
        believed.min((joint - apart) / (smaller * self.min_effect * self.min_effect))
    }
}

/// Directions that are tried for a cut.
const DIRECTIONS: usize = 12;

/// Splits each region by the straight line that best divides it into two planes, if that is significant. Pixels
/// at borders do not vote. Returns how many regions were split. O(directions · pixels).
pub(crate) fn split(partition: &mut Partition<'_>, evidence: &Evidence) -> usize {
    let field = partition.field;
    let step = field.step;
    let reach = partition.rounding_reach();
    let mut pixels: Vec<Vec<u32>> = vec![Vec::new(); partition.planes.len()];
    let mut borders: Vec<Vec<u32>> = pixels.clone();
    for &p in &field.inside {
        let label = partition.labels[p as usize];
        if label != UNASSIGNED {
            let list = if partition.is_interior(p as usize, reach) { &mut pixels } else { &mut borders };
            list[label as usize].push(p);
        }
    }
    let mut splits = 0;
    for (label, (pixels, borders)) in pixels.iter().zip(&borders).enumerate() {
        // Interior pixels only: the region itself is larger.
        if (pixels.len() as f64) * step * step < evidence.min_area || partition.planes.len() + 1 >= UNASSIGNED as usize
        {
            continue;
        }
        // The noise is correlated over metres: one pixel in four of a large region says as much as all.
        let stride = if pixels.len() > 20000 {
            7
        } else if pixels.len() > 500 {
            3
        } else {
            1
        };
        let Some(cut) = best_cut(partition, pixels, stride, evidence) else { continue };
        let new = partition.planes.len() as u16;
        for &p in pixels.iter().chain(borders) {
            let (x, y) = field.position(p as usize);
            if x * cut.normal.0 + y * cut.normal.1 > cut.offset {
                partition.labels[p as usize] = new;
            }
        }
        partition.planes[label] = cut.planes[0];
        partition.planes.push(cut.planes[1]);
        splits += 1;
    }
    splits
}

struct Cut {
    normal: (f64, f64),
    offset: f64,
    planes: [[f64; 3]; 2],
}

fn best_cut(partition: &Partition<'_>, pixels: &[u32], stride: usize, evidence: &Evidence) -> Option<Cut> {
    let field = partition.field;
    let points: Vec<_> = pixels
        .iter()
        .step_by(stride)
        .map(|&p| {
            let (x, y) = field.position(p as usize);
            dvec3(x, y, f64::from(field.z[p as usize]))
        })
        .collect();
    let pixel_area = field.step * field.step * pixels.len() as f64 / points.len() as f64;
    let mut whole = Covariance3::default();
    for &p in &points {
        whole.add(p, 1.0);
    }
    let joint = residual_sum(&whole);
    let bin = 0.5f64.max(2.0 * field.step);
    let margin = (0.5 * evidence.min_width / bin).ceil() as usize;
    let mut best: Option<(f64, Cut)> = None;
    for k in 0..DIRECTIONS {
        let angle = std::f64::consts::PI * k as f64 / DIRECTIONS as f64;
        let normal = (angle.cos(), angle.sin());
        let along = |p: gable_geometry::DVec3| p.x * normal.0 + p.y * normal.1;
        let low = points.iter().map(|&p| along(p)).fold(f64::INFINITY, f64::min);
        let mut bins: Vec<Covariance3> = Vec::new();
        for &p in &points {
            let at = ((along(p) - low) / bin) as usize;
            if at >= bins.len() {
                bins.resize(at + 1, Covariance3::default());
            }
            bins[at].add(p, 1.0);
        }
        let n = bins.len();
        let mut above = vec![Covariance3::default(); n + 1];
        for i in (0..n).rev() {
            above[i] = bins[i];
            let rest = above[i + 1];
            above[i].merge(&rest);
        }
        let mut below = Covariance3::default();
        for i in 0..n.saturating_sub(margin) {
            below.merge(&bins[i]);
            let rest = &above[i + 1];
            let least = below.weight().min(rest.weight()) * pixel_area;
            // Half the area is enough here: borders are not counted, and the planes compete afterwards.
            if i + 1 < margin || least < 0.5 * evidence.min_area {
                continue;
            }
            let apart = residual_sum(&below) + residual_sum(rest);
            let ratio = evidence.ratio(joint, apart, [below.weight(), rest.weight()], pixel_area);
            if ratio > 1.2
                && best.as_ref().is_none_or(|b| ratio > b.0)
                && let (Some(p), Some(q)) = (below.height_plane(), rest.height_plane())
            {
                let offset = low + (i + 1) as f64 * bin;
                best = Some((ratio, Cut { normal, offset, planes: [[p.a, p.b, p.c], [q.a, q.b, q.c]] }));
            }
        }
    }
    best.map(|b| b.1)
}
