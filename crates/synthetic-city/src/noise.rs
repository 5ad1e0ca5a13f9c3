//! Value noise on absolute lattices: the same at a place whoever asks, in whatever order.

use gable_geometry::DVec3;

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A 64-bit hash of a seed and a lattice point.
pub(crate) fn hash(seed: u64, i: i64, j: i64, k: i64) -> u64 {
    let a = seed ^ (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let b = (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f).rotate_left(21);
    let c = (k as u64).wrapping_mul(0x1656_67b1_9e37_79f9).rotate_left(42);
    mix(mix(a ^ b) ^ c)
}

/// Uniform in [0, 1) from a hash.
pub(crate) fn unit(h: u64) -> f64 {
    (h >> 11) as f64 / (1u64 << 53) as f64
}

/// Uniform in [0, 1) at a lattice point.
pub(crate) fn lattice_unit(seed: u64, i: i64, j: i64, k: i64) -> f64 {
    unit(hash(seed, i, j, k))
}

/// Weight of the far lattice point: the quintic with vanishing first and second derivatives at both ends.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Noise over the plane with the given lattice pitch: mean 0, values within [−1, 1].
pub(crate) fn noise2(seed: u64, pitch: f64, x: f64, y: f64) -> f64 {
    let (x, y) = (x / pitch, y / pitch);
    let (i, j) = (x.floor(), y.floor());
    let (u, v) = (fade(x - i), fade(y - j));
    let (i, j) = (i as i64, j as i64);
    let at = |di, dj| 2.0 * lattice_unit(seed, i + di, j + dj, 0) - 1.0;
    let low = at(0, 0) * (1.0 - u) + at(1, 0) * u;
    let high = at(0, 1) * (1.0 - u) + at(1, 1) * u;
    low * (1.0 - v) + high * v
}

/// Noise in space with the given lattice pitch: mean 0, values within [−1, 1].
pub(crate) fn noise3(seed: u64, pitch: f64, p: DVec3) -> f64 {
    let p = p / pitch;
    let base = p.floor();
    let f = p - base;
    let (u, v, w) = (fade(f.x), fade(f.y), fade(f.z));
    let (i, j, k) = (base.x as i64, base.y as i64, base.z as i64);
    let at = |di, dj, dk| 2.0 * lattice_unit(seed, i + di, j + dj, k + dk) - 1.0;
    let row = |dj, dk| at(0, dj, dk) * (1.0 - u) + at(1, dj, dk) * u;
    let sheet = |dk| row(0, dk) * (1.0 - v) + row(1, dk) * v;
    sheet(0) * (1.0 - w) + sheet(1) * w
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    #[test]
    fn noise_is_continuous_bounded_and_centred() {
        let mut sum = 0.0;
        let mut last = noise2(3, 1.7, 0.0, 0.3);
        for i in 1..20_000 {
            let x = f64::from(i) * 0.01;
            let v = noise2(3, 1.7, x, 0.3);
            assert!(v.abs() <= 1.0 && (v - last).abs() < 0.05);
            let s = noise3(3, 1.7, dvec3(x, 0.3, 7.0));
            assert!(s.abs() <= 1.0);
            sum += v;
            last = v;
        }
        assert!((sum / 20_000.0).abs() < 0.15);
    }
}
