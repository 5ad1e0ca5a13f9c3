//! Bilinear interpolation.

/// The value between pixel centres, continued flat beyond the border.
///
/// `values` are rows of `width` pixels; pixel `(i, j)` has its centre at `(i, j)`, so `x` and `y` are in pixels from the centre of
/// the first one. There has to be a pixel. O(1).
///
/// ```
/// let values = [0.0, 1.0, 2.0, 3.0];
/// assert_eq!(gable_raster::bilinear(&values, 2, 2, 0.5, 0.25), 1.0);
/// assert_eq!(gable_raster::bilinear(&values, 2, 2, -4.0, 9.0), 2.0);
/// ```
#[must_use]
pub fn bilinear(values: &[f32], width: usize, height: usize, x: f32, y: f32) -> f32 {
    let x = x.clamp(0.0, (width - 1) as f32);
    let y = y.clamp(0.0, (height - 1) as f32);
    let (i, j) = ((x as usize).min(width.saturating_sub(2)), (y as usize).min(height.saturating_sub(2)));
    let (fx, fy) = (x - i as f32, y - j as f32);
    let (i1, j1) = ((i + 1).min(width - 1), (j + 1).min(height - 1));
    let south = values[j * width + i] * (1.0 - fx) + values[j * width + i1] * fx;
    let north = values[j1 * width + i] * (1.0 - fx) + values[j1 * width + i1] * fx;
    south * (1.0 - fy) + north * fy
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_comes_back_between_centres_and_the_border_goes_on() {
        let plane = |x: f32, y: f32| 2.0 * x - 0.5 * y + 7.0;
        let values: Vec<f32> = (0..5 * 4).map(|i| plane((i % 5) as f32, (i / 5) as f32)).collect();
        for (x, y) in [(0.0, 0.0), (1.25, 2.5), (3.75, 0.5), (4.0, 3.0)] {
            assert_eq!(bilinear(&values, 5, 4, x, y), plane(x, y));
        }
        assert_eq!(bilinear(&values, 5, 4, 9.0, -2.0), plane(4.0, 0.0));
        assert_eq!(bilinear(&[3.0], 1, 1, 0.4, 0.7), 3.0);
    }
}
