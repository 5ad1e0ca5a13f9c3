//! Exact Euclidean distance transform.

/// Squared distance in pixels from each pixel to the nearest pixel of `mask`; `f32::INFINITY` if the mask is empty.
///
/// Felzenszwalb & Huttenlocher 2012: lower envelope of parabolas, along columns, then along rows. O(pixels). With
/// `border`, the outside of the raster counts as part of the mask.
///
/// ```
/// let mask = [true, false, false, false];
/// assert_eq!(gable_raster::squared_distance(&mask, 4, 1, false), [0.0, 1.0, 4.0, 9.0]);
/// assert_eq!(gable_raster::squared_distance(&mask, 4, 1, true), [0.0, 1.0, 1.0, 1.0]);
/// ```
#[must_use]
pub fn squared_distance(mask: &[bool], width: usize, height: usize, border: bool) -> Vec<f32> {
    // Distance along the column first: two runs suffice, as the mask is binary.
    let far = (width + height) as u32 * 2;
    let mut along = vec![far; mask.len()];
    let mut run = vec![if border { 0 } else { far }; width];
    for (mask, out) in mask.chunks_exact(width).zip(along.chunks_exact_mut(width)) {
        for ((m, run), out) in mask.iter().zip(&mut run).zip(out) {
            *run = if *m { 0 } else { (*run + 1).min(far) };
            *out = *run;
        }
    }
    run.fill(if border { 0 } else { far });
    for (mask, out) in mask.chunks_exact(width).zip(along.chunks_exact_mut(width)).rev() {
        for ((m, run), out) in mask.iter().zip(&mut run).zip(out) {
            *run = if *m { 0 } else { (*run + 1).min(far) };
            *out = (*out).min(*run);
        }
    }
    let mut out = vec![f32::INFINITY; mask.len()];
    let mut hull = Vec::new();
    for (along, out) in along.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        row_envelope(along, far, border, &mut hull, out);
    }
    out
}

// Parabolas (x, height) and the place from which each is the lowest.
fn row_envelope(along: &[u32], far: u32, border: bool, hull: &mut Vec<(i64, i64, f64)>, out: &mut [f32]) {
    let width = along.len() as i64;
    hull.clear();
    let outside = [(-1, 0), (width, 0)];
    let inside =
        along.iter().enumerate().filter(|(_, d)| **d < far).map(|(x, d)| (x as i64, i64::from(*d) * i64::from(*d)));
    let first = border.then_some(outside[0]);
    let last = border.then_some(outside[1]);
    for (x, height) in first.into_iter().chain(inside).chain(last) {
        let mut from = f64::NEG_INFINITY;
        while let Some(&(u, other, start)) = hull.last() {
            from = ((height + x * x) - (other + u * u)) as f64 / (2 * (x - u)) as f64;
            if from > start {
                break;
            }
            hull.pop();
            from = f64::NEG_INFINITY;
        }
        hull.push((x, height, from));
    }
    let mut k = 0;
    for (x, out) in out.iter_mut().enumerate() {
        while k + 1 < hull.len() && hull[k + 1].2 <= x as f64 {
            k += 1;
        }
        if let Some(&(u, height, _)) = hull.get(k) {
            let d = x as i64 - u;
            *out = (height + d * d) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;

    #[test]
    fn equals_brute_force() {
        let mut random = Counter::new(2);
        for (w, h, density) in [(17, 11, 0.05), (9, 20, 0.3), (12, 12, 0.0), (1, 7, 0.2), (8, 1, 0.9)] {
            for border in [false, true] {
                let mask: Vec<bool> = (0..w * h).map(|_| random.unit() < density).collect();
                let found = squared_distance(&mask, w, h, border);
                for y in 0..h as i64 {
                    for x in 0..w as i64 {
                        let mut least = f32::INFINITY;
                        for v in -1..=h as i64 {
                            for u in -1..=w as i64 {
                                let inside = u >= 0 && v >= 0 && u < w as i64 && v < h as i64;
                                if if inside { mask[v as usize * w + u as usize] } else { border } {
                                    least = least.min(((x - u).pow(2) + (y - v).pow(2)) as f32);
                                }
                            }
                        }
                        assert_eq!(found[y as usize * w + x as usize], least);
                    }
                }
            }
        }
    }
}
