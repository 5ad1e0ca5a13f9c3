//! The plane of the samples of one coarse cell.

use gable_raster::WindowSums;

use crate::coarse_heights::SIDE;

/// The least-squares plane of a cell's samples.
pub(crate) struct CellPlane {
    /// Mean of the samples, metres.
    pub(crate) mean: f64,
    /// Metres for each sample.
    pub(crate) slope: f64,
    /// Rms distance in z, of the degrees of freedom that a plane leaves.
    pub(crate) residual: f64,
}

impl CellPlane {
    /// `None` if a sample is missing.
    pub(crate) fn of(samples: &[f32; SIDE * SIDE]) -> Option<Self> {
        let mean = samples.iter().map(|z| f64::from(*z)).sum::<f64>() / 16.0;
        if mean.is_nan() {
            return None;
        }
        let (mut xz, mut yz, mut zz) = (0.0, 0.0, 0.0);
        for (k, z) in samples.iter().enumerate() {
            let (x, y, z) = ((k % 4) as f64 - 1.5, (k / 4) as f64 - 1.5, f64::from(*z) - mean);
            (xz, yz, zz) = (xz + x * z, yz + y * z, zz + z * z);
        }
        let sums = WindowSums { side: 4.0, z: 0.0, zz, xz, yz };
        let [east, north] = sums.slope();
        Some(Self { mean, slope: (east * east + north * north).sqrt(), residual: (sums.squares() / 13.0).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fit_is_a_plane() {
        let samples: [f32; 16] = std::array::from_fn(|k| 7.0 + 0.5 * (k % 4) as f32 - (k / 4) as f32);
        let CellPlane { mean, slope, residual } = CellPlane::of(&samples).unwrap();
        assert!((mean - 6.25).abs() < 1e-6 && (slope - 1.25_f64.sqrt()).abs() < 1e-6 && residual < 1e-6);
        let board = std::array::from_fn(|k| if (k + k / 4) % 2 == 0 { 0.1 } else { -0.1 });
        let residual = CellPlane::of(&board).unwrap().residual;
        assert!((residual - 0.1 * (16.0_f64 / 13.0).sqrt()).abs() < 1e-3, "{residual}");
        assert!(CellPlane::of(&[f32::NAN; 16]).is_none());
    }
}
