//! Randomness from seeded counters, so that a result never depends on the order of the work.

/// A counter-based generator: the n-th number is a hash of (seed, n) (SplitMix64, Steele et al. 2014).
#[derive(Clone, Debug)]
pub struct Counter {
    seed: u64,
    next: u64,
}

impl Counter {
    /// A stream for a seed; derive one per building, block or cell with [`Counter::keyed`].
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { seed: mix(seed ^ 0x9e37_79b9_7f4a_7c15), next: 0 }
    }

    /// An independent stream for a key, such as a pixel lattice index.
    #[must_use]
    pub fn keyed(seed: u64, key: &[i64]) -> Self {
        let mut state = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
        for &k in key {
            state = mix(state ^ mix(k as u64));
        }
        Self { seed: state, next: 0 }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.next = self.next.wrapping_add(1);
        mix(self.seed.wrapping_add(self.next.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..n; `n` must not be 0.
    pub fn index(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// Normal with mean 0 and variance 1 (Box–Muller).
    pub fn normal(&mut self) -> f64 {
        let u = 1.0 - self.unit();
        let v = self.unit();
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_distributions() {
        let mut c = Counter::new(7);
        let n = 100_000;
        let (mut u, mut g, mut g2) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            u += c.unit();
            let x = c.normal();
            g += x;
            g2 += x * x;
        }
        let n = f64::from(n);
        assert!((u / n - 0.5).abs() < 0.005 && (g / n).abs() < 0.02 && (g2 / n - 1.0).abs() < 0.02);
        assert!((0..1000).all(|_| c.index(7) < 7));
        assert_ne!(Counter::keyed(1, &[2, 3]).bits(), Counter::keyed(1, &[3, 2]).bits());
    }
}
