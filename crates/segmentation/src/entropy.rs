//! Entropy of the lightness in a square window (Zhu 2018, §4.1).

/// Levels of the histogram: 3 units of L\* each.
const LEVELS: usize = 32;

/// Entropy in bits of `lightness` (L\*, 0–100) over the square window of `2·radius + 1` pixels around each pixel.
///
/// At the border the window is cut to the image. A histogram per column slides down, the window's histogram slides
/// along the row by adding one column and taking another away: the cost does not depend on the radius.
pub(crate) fn local_entropy(lightness: &[f32], width: usize, height: usize, radius: usize) -> Vec<f32> {
    let side = 2 * radius + 1;
    let levels: Vec<u8> =
        lightness.iter().map(|&l| (l * (LEVELS as f32 / 100.0)).clamp(0.0, LEVELS as f32 - 1.0) as u8).collect();
    // n·log2(n) for every possible count.
    let table: Vec<f32> = (0..=side * side).map(|n| if n == 0 { 0.0 } else { n as f32 * (n as f32).log2() }).collect();
    let mut columns = vec![[0_u16; LEVELS]; width];
    let mut out = vec![0.0; levels.len()];
    for y in 0..radius.min(height) {
        count(&mut columns, &levels[y * width..][..width], true);
    }
    for y in 0..height {
        if y + radius < height {
            count(&mut columns, &levels[(y + radius) * width..][..width], true);
        }
        if y > radius {
            count(&mut columns, &levels[(y - radius - 1) * width..][..width], false);
        }
        let rows = (y + radius).min(height - 1) + 1 - y.saturating_sub(radius);
        let mut window = [0_u16; LEVELS];
        for column in &columns[..radius.min(width)] {
            add(&mut window, column);
        }
        for (x, out) in out[y * width..][..width].iter_mut().enumerate() {
            if x + radius < width {
                add(&mut window, &columns[x + radius]);
            }
            if x > radius {
                subtract(&mut window, &columns[x - radius - 1]);
            }
            let n = rows * ((x + radius).min(width - 1) + 1 - x.saturating_sub(radius));
            let sum: f32 = window.iter().map(|&c| table[usize::from(c)]).sum();
            *out = (table[n] - sum) / n as f32;
        }
    }
    out
}

fn count(columns: &mut [[u16; LEVELS]], row: &[u8], enters: bool) {
    for (column, &level) in columns.iter_mut().zip(row) {
        let bin = &mut column[usize::from(level)];
        *bin = if enters { *bin + 1 } else { *bin - 1 };
    }
}

fn add(window: &mut [u16; LEVELS], column: &[u16; LEVELS]) {
    for (w, c) in window.iter_mut().zip(column) {
        *w += c;
    }
}

fn subtract(window: &mut [u16; LEVELS], column: &[u16; LEVELS]) {
    for (w, c) in window.iter_mut().zip(column) {
        *w -= c;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;

    #[test]
    fn equals_the_definition() {
        let (w, h) = (23, 17);
        let mut random = Counter::new(3);
        let image: Vec<f32> =
            (0..w * h).map(|i| if i % 5 == 0 { 50.0 } else { random.range(0.0, 100.0) as f32 }).collect();
        for radius in [1, 3, 9, 30] {
            let found = local_entropy(&image, w, h, radius);
            for y in 0..h {
                for x in 0..w {
                    let mut counts = [0.0_f64; LEVELS];
                    let mut n = 0.0;
                    for v in y.saturating_sub(radius)..=(y + radius).min(h - 1) {
                        for u in x.saturating_sub(radius)..=(x + radius).min(w - 1) {
                            counts[(image[v * w + u] * 0.32) as usize] += 1.0;
                            n += 1.0;
                        }
                    }
                    let expected: f64 = counts.iter().filter(|&&c| c > 0.0).map(|c| -(c / n) * (c / n).log2()).sum();
                    assert!((f64::from(found[y * w + x]) - expected).abs() < 1e-4);
                }
            }
        }
    }
}
