//! Directions of the facades: frames of two orthogonal axes.
//!
//! Input are the horizontal normals of steep facets. Angles are those of a normal from the x axis, and since walls
//! come in orthogonal pairs, they count modulo 90°.

use gable_geometry::{Counter, DVec2};
use std::f64::consts::FRAC_PI_2;

/// Two orthogonal facade directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Angle of one axis, radians in [0, π/2).
    pub angle: f64,
    /// Part of the weight that follows this frame.
    pub share: f64,
}

impl Frame {
    /// The two axes as unit vectors.
    #[must_use]
    pub fn axes(&self) -> [DVec2; 2] {
        let x = DVec2::from_angle(self.angle);
        [x, x.perp()]
    }
}

/// Parameters of [`histogram`].
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Angle within which a normal follows a frame, degrees.
    pub tolerance: f64,
    /// Least share of the weight that a frame must have, after the ones before it took theirs.
    pub min_share: f64,
    /// Most frames.
    pub max_frames: usize,
}

impl Default for Params {
    fn default() -> Self {
        Self { tolerance: 8.0, min_share: 0.15, max_frames: 3 }
    }
}

const BINS: usize = 180;

/// Angles this near to a frame refine it at last, radians (2°).
const NEAR: f64 = 0.035;

/// Frames from an area-weighted histogram of angles (radians, weight), the strongest first.
///
/// The histogram has bins of half a degree and is smoothed by a kernel of 2°; at its maximum a frame is refined by
/// averaging within half the tolerance, and then over the angles themselves within 2°, where weights count squared: along a hall of
/// 200 m a quarter of a degree is a metre, and its own walls know their direction best. What follows the frame is removed, and the
/// search repeated. One frame for a rectangular house, two or three where wings are skew. Empty if there is no weight.
#[must_use]
pub fn histogram(normals: impl IntoIterator<Item = (f64, f64)>, params: &Params) -> Vec<Frame> {
    let mut fine = vec![0.0; BINS];
    let width = FRAC_PI_2 / BINS as f64;
    let normals: Vec<(f64, f64)> =
        normals.into_iter().filter(|(angle, weight)| angle.is_finite() && *weight > 0.0).collect();
    for (angle, weight) in &normals {
        fine[((angle.rem_euclid(FRAC_PI_2) / width) as usize).min(BINS - 1)] += weight;
    }
    let total: f64 = fine.iter().sum();
    let mut frames: Vec<Frame> = Vec::new();
    if total <= 0.0 {
        return frames;
    }
    let kernel: Vec<f64> = (-12i32..=12).map(|k| (-0.5 * (0.25 * f64::from(k)).powi(2)).exp()).collect();
    let centre = |bin: usize| (bin as f64 + 0.5) * width;
    let tolerance = params.tolerance.to_radians();
    while frames.len() < params.max_frames {
        let smooth = |bin: usize| -> f64 {
            kernel.iter().enumerate().map(|(k, v)| v * fine[(bin + BINS + k - 12) % BINS]).sum()
        };
        let peak =
            (0..BINS).map(smooth).enumerate().fold((0, 0.0), |best, (b, v)| if v > best.1 { (b, v) } else { best });
        if peak.1 <= 0.0 {
            break;
        }
        let mut angle = centre(peak.0);
        for _ in 0..5 {
            let (mut sum, mut weight) = (0.0, 0.0);
            for bin in 0..BINS {
                let off = difference(centre(bin), angle);
                if off.abs() <= 0.5 * tolerance {
                    sum += off * fine[bin];
                    weight += fine[bin];
                }
            }
            if weight > 0.0 {
                angle = (angle + sum / weight).rem_euclid(FRAC_PI_2);
            }
        }
        for _ in 0..3 {
            let near = normals.iter().map(|&(a, w)| (difference(a, angle), w * w)).filter(|(off, _)| off.abs() <= NEAR);
            let (sum, weight) = near.fold((0.0, 0.0), |(s, t), (off, w)| (s + off * w, t + w));
            if weight > 0.0 {
                angle = (angle + sum / weight).rem_euclid(FRAC_PI_2);
            }
        }
        let mut taken = 0.0;
        for bin in 0..BINS {
            if difference(centre(bin), angle).abs() <= tolerance {
                taken += std::mem::take(&mut fine[bin]);
            }
        }
        let share = taken / total;
        if share < params.min_share && !frames.is_empty() || taken <= 0.0 {
            break;
        }
        frames.push(Frame { angle: angle.rem_euclid(FRAC_PI_2), share });
    }
    frames
}

/// The frame with the largest consensus among unit normals: RANSAC of Zhu 2018, §5.1, Eq. 7, where each normal
/// counts once. `threshold` is ang_thre in degrees (the paper gives no value; 15 is usual). The hypothesis is
/// replaced by the mean of its inliers, which the paper leaves open. `None` without normals.
#[must_use]
pub fn ransac(normals: &[DVec2], threshold: f64, iterations: usize, seed: u64) -> Option<Frame> {
    if normals.is_empty() {
        return None;
    }
    let mut rng = Counter::new(seed);
    let threshold = threshold.to_radians();
    let angles: Vec<f64> = normals.iter().map(|n| n.to_angle().rem_euclid(FRAC_PI_2)).collect();
    let mut best = (0, 0.0);
    for _ in 0..iterations {
        let hypothesis = angles[rng.index(angles.len())];
        let inliers = angles.iter().filter(|&&a| difference(a, hypothesis).abs() < threshold).count();
        if inliers > best.0 {
            best = (inliers, hypothesis);
        }
    }
    let within = angles.iter().map(|&a| difference(a, best.1)).filter(|d| d.abs() < threshold);
    let mean = within.sum::<f64>() / best.0.max(1) as f64;
    Some(Frame { angle: (best.1 + mean).rem_euclid(FRAC_PI_2), share: best.0 as f64 / angles.len() as f64 })
}

/// Difference of two angles modulo 90°, in [−45°, 45°).
pub(crate) fn difference(a: f64, b: f64) -> f64 {
    (a - b + 0.5 * FRAC_PI_2).rem_euclid(FRAC_PI_2) - 0.5 * FRAC_PI_2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walls of a house at 31.2° with a skew wing at 58° that has a third of the area, and clutter.
    fn walls() -> Vec<(f64, f64)> {
        let mut rng = Counter::new(4);
        let mut out = Vec::new();
        for k in 0..900 {
            let base = if k % 3 == 0 { 58f64 } else { 31.2 }.to_radians();
            out.push((base + FRAC_PI_2 * rng.index(4) as f64 + 0.05 * rng.normal(), 1.0));
        }
        out.extend((0..200).map(|_| (rng.range(-3.0, 3.0), 1.0)));
        out
    }

    #[test]
    fn skew_wings_get_their_own_frame() {
        let frames = histogram(walls(), &Params::default());
        assert_eq!(frames.len(), 2, "{frames:?}");
        assert!((frames[0].angle.to_degrees() - 31.2).abs() < 0.5 && (frames[1].angle.to_degrees() - 58.0).abs() < 0.7);
        assert!(frames[0].share > 0.5 && frames[1].share > 0.2);
        assert!(histogram([], &Params::default()).is_empty());
        // Angles next to 0 and 90° are the same.
        let f = histogram([(0.01, 1.0), (-0.01, 1.0), (FRAC_PI_2 - 0.005, 1.0)], &Params::default());
        assert_eq!(f.len(), 1);
        assert!(difference(f[0].angle, 0.0).abs() < 0.01);
    }

    #[test]
    fn long_walls_decide_to_a_hundredth_of_a_degree() {
        let walls = [(0.0163, 196.0), (0.0161 + FRAC_PI_2, 17.0), (0.0162, 194.0), (0.03, 3.0), (-0.01, 2.0)];
        let frames = histogram(walls, &Params::default());
        assert!((frames[0].angle - 0.0162).abs() < 1e-4, "{frames:?}");
    }

    #[test]
    fn ransac_finds_the_main_frame() {
        let normals: Vec<DVec2> = walls().iter().map(|w| DVec2::from_angle(w.0)).collect();
        let frame = ransac(&normals, 10.0, 200, 1).unwrap();
        assert!((frame.angle.to_degrees() - 31.2).abs() < 1.5, "{frame:?}");
        assert_eq!(ransac(&normals, 10.0, 200, 1), Some(frame));
        assert_eq!(ransac(&[], 10.0, 200, 1), None);
    }
}
