//! Moves contour points to where the height steps down.

use gable_geometry::DVec2;
use gable_raster::Raster;

/// Parameters of [`refine_ring`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineParams {
    /// A point moves at most this far, metres (default 1.0).
    pub reach: f64,
    /// Height is averaged over this length on either side of a step, metres (default 0.6).
    pub side: f64,
    /// Smaller steps do not move a point, metres (default 1.5).
    pub min_step: f64,
}

impl Default for RefineParams {
    fn default() -> Self {
        Self { reach: 1.0, side: 0.6, min_step: 1.5 }
    }
}

/// Moves each point of a closed contour (the mask to its left) across the contour to the place where the height
/// falls most from inside to outside: at half the height of the step, between the pixels.
///
/// The direction across is that of the contour smoothed over ±0.8 m. Nearer steps win over farther ones that are
/// only a little higher. Shifts are smoothed by a running median over seven points, so that single points do not
/// jump; a point whose profile has no step, or too few heights, stays. Cost: O(points · reach / pixel).
#[must_use]
pub fn refine_ring(contour: &[DVec2], height: &Raster<f32>, params: &RefineParams) -> Vec<DVec2> {
    let n = contour.len();
    if n < 3 {
        return contour.to_vec();
    }
    let step = height.window().step;
    let span = ((0.8 / step).round() as usize).clamp(1, (n - 1) / 2);
    let across: Vec<_> = (0..n)
        .map(|i| {
            let along = contour[(i + span) % n] - contour[(i + n - span) % n];
            -along.perp().normalize_or_zero()
        })
        .collect();
    let shifts: Vec<_> = (0..n).map(|i| shift(contour[i], across[i], height, params)).collect();
    (0..n)
        .map(|i| {
            let mut near: Vec<f64> = (n + i - 3.min(n)..=n + i + 3).filter_map(|k| shifts[k % n]).collect();
            near.sort_unstable_by(f64::total_cmp);
            if near.len() < 2 { contour[i] } else { contour[i] + across[i] * near[near.len() / 2] }
        })
        .collect()
}

/// How far outward (negative: inward) the step lies from `p`.
fn shift(p: DVec2, outward: DVec2, height: &Raster<f32>, params: &RefineParams) -> Option<f64> {
    let spacing = 0.5 * height.window().step;
    let side = (params.side / spacing).round().max(1.0) as i64;
    let reach = (params.reach / spacing).round() as i64;
    let at = |k: i64| {
        let h = height.at(p + outward * (k as f64 * spacing)).copied().unwrap_or(f32::NAN);
        (!h.is_nan()).then(|| f64::from(h))
    };
    let profile: Vec<_> = (-reach - side..=reach + side).map(at).collect();
    let value = |k: i64| profile[(k + reach + side) as usize];
    let mean = |range: std::ops::RangeInclusive<i64>| {
        let (mut sum, mut count) = (0.0, 0);
        for h in range.filter_map(value) {
            sum += h;
            count += 1;
        }
        (count > 0).then(|| sum / f64::from(count))
    };
    let mut best: Option<(f64, i64, f64)> = None;
    for k in -reach..=reach {
        let (Some(inside), Some(outside)) = (mean(k - side..=k - 1), mean(k + 1..=k + side)) else { continue };
        let t = k as f64 / (reach + 1) as f64;
        let score = (inside - outside) * (1.0 - 0.4 * t * t);
        if inside - outside >= params.min_step && best.is_none_or(|b| score > b.0) {
            best = Some((score, k, 0.5 * (inside + outside)));
        }
    }
    let (_, k, level) = best?;
    // The crossing of the middle height nearest to the best split.
    let crossing = |i: i64| {
        let (a, b) = (value(i)?, value(i + 1)?);
        (a >= level && b < level).then(|| i as f64 + (a - level) / (a - b))
    };
    let near = |c: &f64| (c - k as f64).abs();
    let found = (k - side..k + side).filter_map(crossing).min_by(|a, b| near(a).total_cmp(&near(b)));
    Some(found.unwrap_or(k as f64) * spacing)
}
