//! The number of false alarms: how often chance alone would give a rectangle as well aligned.

use std::sync::LazyLock;

/// Factorials up to here are tabulated.
const TABLE: usize = 1024;

/// ln n! for small n.
static LN_FACTORIAL: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let mut table = vec![0.0; TABLE];
    for n in 1..TABLE {
        table[n] = table[n - 1] + (n as f64).ln();
    }
    table
});

fn ln_factorial(n: usize) -> f64 {
    if n < TABLE {
        return LN_FACTORIAL[n];
    }
    // Stirling's series; the next term is below 10⁻¹² here.
    let x = n as f64;
    (x + 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + 1.0 / (12.0 * x) - 1.0 / (360.0 * x * x * x)
}

/// −log₁₀ of the expected number of rectangles, out of 10^`log_tests`, in which at least `aligned` of `count` pixels
/// agree with the direction if each does so with probability `p` by chance. The binomial tail is summed until what is
/// left is under a tenth of a per cent.
pub(super) fn significance(count: usize, aligned: usize, p: f64, log_tests: f64) -> f64 {
    if count == 0 || aligned == 0 {
        return -log_tests;
    }
    debug_assert!(aligned <= count && 0.0 < p && p < 1.0);
    let (n, k) = (count as f64, aligned as f64);
    let ln_choose = ln_factorial(count) - ln_factorial(aligned) - ln_factorial(count - aligned);
    let ln_first = ln_choose + k * p.ln() + (n - k) * (1.0 - p).ln();
    let mut tail = 1.0;
    let mut term = 1.0;
    for i in aligned + 1..=count {
        let ratio = (count - i + 1) as f64 / i as f64 * p / (1.0 - p);
        term *= ratio;
        tail += term;
        // Ratios fall: the rest is less than a geometric series.
        if ratio < 1.0 && term * ratio / (1.0 - ratio) < 1e-3 * tail {
            break;
        }
    }
    let ln_tail = (ln_first + f64::ln(tail)).min(0.0);
    -ln_tail / std::f64::consts::LN_10 - log_tests
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_the_binomial_tail() {
        for (n, k, p) in [(10usize, 3usize, 0.125), (40, 38, 0.125), (60, 1, 0.3), (25, 25, 0.06)] {
            let choose = |i: usize| (0..i).map(|j| (n - j) as f64 / (i - j) as f64).product::<f64>();
            let tail: f64 =
                (k..=n).map(|i| choose(i) * f64::powi(p, i as i32) * f64::powi(1.0 - p, (n - i) as i32)).sum();
            assert!((significance(n, k, p, 2.0) + tail.log10() + 2.0).abs() < 1e-3, "{n} {k} {p}");
        }
        assert_eq!(significance(0, 0, 0.1, 5.0), -5.0);
        assert!((ln_factorial(TABLE) - LN_FACTORIAL[TABLE - 1] - (TABLE as f64).ln()).abs() < 1e-9);
    }
}
