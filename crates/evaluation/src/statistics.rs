//! Summaries of many numbers.

use serde::{Deserialize, Serialize};

/// A summary of absolute distances or errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// How many.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// The value that 95 % do not exceed (nearest rank).
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// Of values ≥ 0; all zero if there are none.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Self {
        let count = values.len();
        if count == 0 {
            return Self::default();
        }
        let n = count as f64;
        let mean = values.iter().sum::<f64>() / n;
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
        let rank = (0.95 * n).ceil() as usize - 1;
        let (_, p95, _) = values.select_nth_unstable_by(rank, f64::total_cmp);
        let p95 = *p95;
        Self { count, mean, rms, p95, max: values.iter().copied().fold(0.0, f64::max) }
    }
}

/// The middle value, the mean of the middle two; 0 if there is none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { 0.0 } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

/// The mean; 0 if there is none.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for v in values {
        sum += v;
        count += 1;
    }
    ratio(sum, f64::from(count))
}

/// A quotient; 0 if there is nothing to divide by.
pub(crate) fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries() {
        let s = Spread::of((1..=100).rev().map(f64::from).collect());
        assert_eq!((s.count, s.mean, s.p95, s.max), (100, 50.5, 95.0, 100.0));
        assert!((s.rms - (338_350.0_f64 / 100.0).sqrt()).abs() < 1e-12);
        assert_eq!(Spread::of(vec![]), Spread::default());
        assert_eq!((median(vec![3.0, 1.0]), median(vec![5.0, 1.0, 2.0]), median(vec![])), (2.0, 2.0, 0.0));
    }
}
