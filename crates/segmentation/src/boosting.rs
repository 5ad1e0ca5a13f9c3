//! Boosting of decision stumps: AdaBoost as published (Freund & Schapire 1997), and Gentle AdaBoost (Friedman, Hastie &
//! Tibshirani 2000).

use serde::{Deserialize, Serialize};

use crate::Error;
use crate::stumps::Stump;

/// Bins into which each feature is cut for the search of thresholds.
const BINS: usize = 256;

/// How the stumps are boosted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boosting {
    /// Discrete AdaBoost: a stump says ±1 and is weighted by α (Zhu 2018, Eq. 1).
    Discrete,
    /// Gentle AdaBoost: a stump says the weighted mean of the classes on either side, a Newton step that is less
    /// shaken by wrong labels.
    Gentle,
}

/// Samples with their features, by feature.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// `features[f][i]`: feature f of sample i.
    pub features: Vec<Vec<f32>>,
    /// Whether sample i is a tree.
    pub positive: Vec<bool>,
    /// Weight of sample i, of any sum.
    pub weight: Vec<f32>,
}

impl Samples {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positive.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positive.is_empty()
    }
}

/// One feature cut into bins of about equally many samples.
struct Binned {
    /// Upper end of each bin but the last.
    edges: Vec<f32>,
    bins: Vec<u8>,
}

impl Binned {
    fn new(values: &[f32]) -> Self {
        // Quantiles of every n-th value: the ends of bins need not be exact.
        let stride = (values.len() / 20_000).max(1);
        let mut sorted: Vec<f32> = values.iter().step_by(stride).copied().collect();
        sorted.sort_by(f32::total_cmp);
        let mut edges: Vec<f32> = (1..BINS).map(|b| sorted[b * (sorted.len() - 1) / BINS]).collect();
        edges.dedup();
        let bins = values.iter().map(|v| edges.partition_point(|e| v > e) as u8).collect();
        Self { edges, bins }
    }
}

/// Boosts `rounds` stumps.
///
/// Ties go to the feature and the threshold that come first, sums run in the order of the samples: the same samples give
/// the same stumps. Cost: O(rounds · features · samples) additions.
///
/// # Errors
/// If the samples are of one class only.
pub fn boost(samples: &Samples, rounds: usize, boosting: Boosting) -> Result<Vec<Stump>, Error> {
    let n = samples.len();
    let positives = samples.positive.iter().filter(|p| **p).count();
    if positives == 0 || positives == n {
        return Err(Error::OneClass { samples: n });
    }
    let binned: Vec<Binned> = samples.features.iter().map(|f| Binned::new(f)).collect();
    let total: f64 = samples.weight.iter().map(|w| f64::from(*w)).sum();
    let mut weights: Vec<f64> = samples.weight.iter().map(|w| f64::from(*w) / total).collect();
    let mut stumps = Vec::with_capacity(rounds);
    for _ in 0..rounds {
        let mut best: Option<(f64, Stump)> = None;
        for (feature, binned) in binned.iter().enumerate() {
            let Some((loss, stump)) = best_stump(feature, binned, &samples.positive, &weights, boosting) else {
                continue;
            };
            if best.is_none_or(|(least, _)| loss < least) {
                best = Some((loss, stump));
            }
        }
        // No feature varies: nothing can be learnt.
        let Some((_, stump)) = best else { break };
        let values = &samples.features[stump.feature];
        let mut sum = 0.0;
        for ((weight, value), positive) in weights.iter_mut().zip(values).zip(&samples.positive) {
            let output = f64::from(if *value > stump.threshold { stump.above } else { stump.below });
            *weight *= (if *positive { -output } else { output }).exp();
            sum += *weight;
        }
        weights.iter_mut().for_each(|w| *w /= sum);
        stumps.push(stump);
    }
    Ok(stumps)
}

// The best stump on one feature and its loss: the weighted error, or the weighted square error.
fn best_stump(
    feature: usize,
    binned: &Binned,
    positive: &[bool],
    weights: &[f64],
    boosting: Boosting,
) -> Option<(f64, Stump)> {
    let mut sums = [[0.0_f64; 2]; BINS];
    for ((bin, positive), weight) in binned.bins.iter().zip(positive).zip(weights) {
        sums[usize::from(*bin)][usize::from(*positive)] += weight;
    }
    let all = sums.iter().fold([0.0; 2], |a, s| [a[0] + s[0], a[1] + s[1]]);
    let mut below = [0.0; 2];
    let mut best: Option<(f64, Stump)> = None;
    for (bin, &threshold) in binned.edges.iter().enumerate() {
        below = [below[0] + sums[bin][0], below[1] + sums[bin][1]];
        let above = [all[0] - below[0], all[1] - below[1]];
        let (loss, low, high) = match boosting {
            Boosting::Discrete => {
                // Error if the high side is called tree; the other way round it is one minus that.
                let error = (below[1] + above[0]).clamp(1e-9, 1.0 - 1e-9);
                let alpha = 0.5 * ((1.0 - error) / error).ln();
                (error.min(1.0 - error), -alpha, alpha)
            }
            Boosting::Gentle => {
                let (low_weight, high_weight) = (below[0] + below[1], above[0] + above[1]);
                if low_weight < 1e-6 || high_weight < 1e-6 {
                    continue;
                }
                let low = (below[1] - below[0]) / low_weight;
                let high = (above[1] - above[0]) / high_weight;
                (1.0 - low_weight * low * low - high_weight * high * high, low, high)
            }
        };
        if best.is_none_or(|(least, _)| loss < least) {
            best = Some((loss, Stump { feature, threshold, below: low as f32, above: high as f32 }));
        }
    }
    best
}

/// Platt's scale and offset for scores of samples that the stumps were **not** trained on.
///
/// Newton's method on the weighted log loss, with Platt's (1999) smoothed targets, so that classes that are told apart
/// without error stay finite.
#[must_use]
pub fn calibrate(scores: &[f32], positive: &[bool], weight: &[f32]) -> (f32, f32) {
    let sum = |class: bool| -> f64 {
        positive.iter().zip(weight).filter(|(p, _)| **p == class).map(|(_, w)| f64::from(*w)).sum()
    };
    let (yes, no) = (sum(true), sum(false));
    let targets = [1.0 / (no + 2.0), (yes + 1.0) / (yes + 2.0)];
    let (mut scale, mut offset) = (1.0_f64, 0.0_f64);
    let loss = |scale: f64, offset: f64| -> f64 {
        let each = scores.iter().zip(positive).zip(weight);
        each.map(|((s, p), w)| {
            let x = scale * f64::from(*s) + offset;
            f64::from(*w) * (x.max(0.0) + (-x.abs()).exp().ln_1p() - targets[usize::from(*p)] * x)
        })
        .sum()
    };
    let mut current = loss(scale, offset);
    for _ in 0..50 {
        let (mut ga, mut gb, mut haa, mut hab, mut hbb) = (0.0, 0.0, 1e-9, 0.0, 1e-9);
        for ((s, p), w) in scores.iter().zip(positive).zip(weight) {
            let (s, w) = (f64::from(*s), f64::from(*w));
            let q = 1.0 / (1.0 + (-(scale * s + offset)).exp());
            let g = w * (q - targets[usize::from(*p)]);
            let h = w * q * (1.0 - q);
            ga += g * s;
            gb += g;
            haa += h * s * s;
            hab += h * s;
            hbb += h;
        }
        let det = haa * hbb - hab * hab;
        let (da, db) = ((hbb * ga - hab * gb) / det, (haa * gb - hab * ga) / det);
        // Halve the step until the loss falls.
        let mut step = 1.0;
        let next = loop {
            let next = loss(scale - step * da, offset - step * db);
            if next <= current || step < 1e-6 {
                break next;
            }
            step *= 0.5;
        };
        if !next.is_finite() || current - next < 1e-9 * current {
            break;
        }
        scale -= step * da;
        offset -= step * db;
        current = next;
    }
    (scale as f32, offset as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;

    // Two features decide together, a third is noise.
    fn diagonal(n: usize) -> Samples {
        let mut random = Counter::new(21);
        let mut samples = Samples { features: vec![Vec::new(); 3], ..Samples::default() };
        for _ in 0..n {
            let v = [random.range(0.0, 1.0), random.range(0.0, 1.0), random.range(0.0, 1.0)];
            for (f, v) in samples.features.iter_mut().zip(v) {
                f.push(v as f32);
            }
            samples.positive.push(v[0] + v[1] > 1.0);
            samples.weight.push(1.0);
        }
        samples
    }

    fn score(stumps: &[Stump], samples: &Samples, i: usize) -> f32 {
        stumps.iter().map(|s| if samples.features[s.feature][i] > s.threshold { s.above } else { s.below }).sum()
    }

    #[test]
    fn both_kinds_learn_a_diagonal_that_no_stump_can() {
        let samples = diagonal(4000);
        for boosting in [Boosting::Discrete, Boosting::Gentle] {
            let stumps = boost(&samples, 200, boosting).unwrap();
            assert_eq!(stumps.len(), 200);
            let right =
                (0..samples.len()).filter(|&i| (score(&stumps, &samples, i) > 0.0) == samples.positive[i]).count();
            assert!(right > 3850, "{boosting:?}: {right}");
            assert_eq!(stumps, boost(&samples, 200, boosting).unwrap());
        }
    }

    #[test]
    fn the_first_discrete_stump_is_the_best_one() {
        let samples = diagonal(300);
        let first = boost(&samples, 1, Boosting::Discrete).unwrap()[0];
        let error = |f: usize, t: f32| {
            let wrong = (0..300).filter(|&i| (samples.features[f][i] > t) != samples.positive[i]).count();
            wrong.min(300 - wrong)
        };
        let least =
            (0..3).flat_map(|f| samples.features[f].iter().map(move |&t| (f, t))).map(|(f, t)| error(f, t)).min();
        // 256 quantile bins over 300 samples may miss the best threshold by one sample.
        assert!(error(first.feature, first.threshold) <= least.unwrap() + 2);
    }

    #[test]
    fn one_class_is_an_error() {
        let mut samples = diagonal(20);
        samples.positive.fill(true);
        assert!(matches!(boost(&samples, 5, Boosting::Gentle), Err(Error::OneClass { samples: 20 })));
    }

    #[test]
    fn calibration_finds_the_sigmoid_that_made_the_classes() {
        let mut random = Counter::new(4);
        let scores: Vec<f32> = (0..40_000).map(|_| random.range(-4.0, 4.0) as f32).collect();
        let positive: Vec<bool> =
            scores.iter().map(|s| random.unit() < 1.0 / (1.0 + (-(0.7 * f64::from(*s) - 0.5)).exp())).collect();
        let (scale, offset) = calibrate(&scores, &positive, &vec![1.0; scores.len()]);
        assert!((scale - 0.7).abs() < 0.03 && (offset + 0.5).abs() < 0.05, "{scale} {offset}");
    }
}
