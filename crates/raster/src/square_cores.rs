//! Erosion by a square, for masks and for labels.

/// What remains of each label if its pixels are eroded by a square of `2·radius + 1` pixels a side: a pixel keeps its value if all pixels
/// of the square around it have the same value, and gets `none` otherwise. The square has to lie in the raster.
///
/// `values` are rows of `width` pixels. First along rows, then along columns, by the length of the run of equal values: O(pixels),
/// whatever the radius.
///
/// ```
/// // 1 1 1 2
/// // 1 1 1 2
/// // 1 1 1 2
/// let labels = [1, 1, 1, 2, 1, 1, 1, 2, 1, 1, 1, 2];
/// assert_eq!(gable_raster::square_cores(&labels, 4, 3, 1, 0), [0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]);
/// ```
#[must_use]
pub fn square_cores<T: Copy + PartialEq>(values: &[T], width: usize, height: usize, radius: usize, none: T) -> Vec<T> {
    let mut along = vec![none; values.len()];
    for (row, out) in values.chunks_exact(width.max(1)).zip(along.chunks_exact_mut(width.max(1))) {
        let mut run = 0;
        for column in 0..width {
            run = if column > 0 && row[column] == row[column - 1] { run + 1 } else { 1 };
            if run > 2 * radius {
                out[column - radius] = row[column];
            }
        }
    }
    let mut out = vec![none; values.len()];
    let mut runs = vec![0; width];
    for row in 0..height {
        for (column, run) in runs.iter_mut().enumerate() {
            let pixel = row * width + column;
            *run = if row > 0 && along[pixel] == along[pixel - width] { *run + 1 } else { 1 };
            if *run > 2 * radius {
                out[pixel - radius * width] = along[pixel];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbours::square;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn equals_the_test_of_each_square(
            bits in prop::collection::vec(0_usize..12, 1..160), width in 1_usize..14, radius in 0_usize..4
        ) {
            let height = bits.len() / width;
            // Large areas of few labels, so that squares hold.
            let label = |pixel: usize| u8::from(bits[pixel] == 0) + 2 * u8::from(pixel / width > height / 2);
            let labels: Vec<u8> = (0..width * height).map(label).collect();
            let cores = square_cores(&labels, width, height, radius, 9);
            for (pixel, core) in cores.into_iter().enumerate() {
                let (column, row) = (pixel % width, pixel / width);
                let lies_inside = column >= radius && row >= radius && column + radius < width && row + radius < height;
                let holds = lies_inside && square(pixel, width, height, radius).all(|q| labels[q] == labels[pixel]);
                prop_assert_eq!(core, if holds { labels[pixel] } else { 9 });
            }
        }
    }
}
