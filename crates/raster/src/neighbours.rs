//! The pixels beside and around a pixel.
//!
//! Pixels are numbered row by row from the south, as the values of a [`Raster`](crate::Raster) are.

/// Which pixels hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connectivity {
    /// Those that share a side.
    Four,
    /// Those that share a side or a corner.
    Eight,
}

/// The four pixels that share a side with a pixel: to the west, the east, the south and the north; `None` beyond the border
/// of the raster. O(1).
///
/// ```
/// // 0 1 2
/// // 3 4 5, the northern row
/// assert_eq!(gable_raster::sides(5, 3, 2), [Some(4), None, Some(2), None]);
/// ```
#[inline]
#[must_use]
pub fn sides(pixel: usize, width: usize, height: usize) -> [Option<usize>; 4] {
    let (column, row) = (pixel % width, pixel / width);
    [
        (column > 0).then(|| pixel - 1),
        (column + 1 < width).then(|| pixel + 1),
        (row > 0).then(|| pixel - width),
        (row + 1 < height).then(|| pixel + width),
    ]
}

/// The up to eight pixels that share a side or a corner with a pixel, in the order of their numbers. O(1).
///
/// ```
/// let around: Vec<usize> = gable_raster::around(5, 3, 2).collect();
/// assert_eq!(around, [1, 2, 4]);
/// ```
#[inline]
pub fn around(pixel: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    around_place(pixel % width, pixel / width, width, height)
}

/// The same as [`around`], for a pixel by its column and row, which saves a division.
///
/// ```
/// let around: Vec<usize> = gable_raster::around_place(2, 1, 3, 2).collect();
/// assert_eq!(around, [1, 2, 4]);
/// ```
#[inline]
pub fn around_place(column: usize, row: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let pixel = row * width + column;
    if column > 0 && row > 0 && column + 1 < width && row + 1 < height {
        let (south, north) = (pixel - width, pixel + width);
        let all = [south - 1, south, south + 1, pixel - 1, pixel + 1, north - 1, north, north + 1];
        return all.into_iter().take(8);
    }
    let mut found = [0; 8];
    let mut count = 0;
    for other in square(pixel, width, height, 1) {
        found[count] = other;
        count += 1;
    }
    found.into_iter().take(count)
}

/// The eight pixels around a pixel that does not lie at the border of the raster: those of [`sides`] first, in that order, then
/// those across corners. O(1), without a branch.
///
/// ```
/// assert_eq!(gable_raster::around_inner(4, 3), [3, 5, 1, 7, 0, 2, 6, 8]);
/// ```
#[inline]
#[must_use]
pub fn around_inner(pixel: usize, width: usize) -> [usize; 8] {
    let (south, north) = (pixel - width, pixel + width);
    [pixel - 1, pixel + 1, south, north, south - 1, south + 1, north - 1, north + 1]
}

/// The pixels of a square of `2·radius + 1` pixels a side around a pixel, cut to the raster and without the pixel itself, in the
/// order of their numbers. O(radius²).
///
/// ```
/// let square: Vec<usize> = gable_raster::square(0, 4, 4, 2).collect();
/// assert_eq!(square, [1, 2, 4, 5, 6, 8, 9, 10]);
/// ```
pub fn square(pixel: usize, width: usize, height: usize, radius: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (pixel % width, pixel / width);
    let columns = column.saturating_sub(radius)..(column + radius + 1).min(width);
    (row.saturating_sub(radius)..(row + radius + 1).min(height))
        .flat_map(move |other_row| columns.clone().map(move |other_column| other_row * width + other_column))
        .filter(move |&other| other != pixel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_their_definition() {
        for (width, height) in [(1_usize, 1_usize), (1, 5), (4, 1), (5, 4)] {
            for pixel in 0..width * height {
                let steps =
                    |other: usize| [(pixel % width).abs_diff(other % width), (pixel / width).abs_diff(other / width)];
                let pixels = || 0..width * height;
                let expected: Vec<usize> = pixels().filter(|&q| steps(q).iter().sum::<usize>() == 1).collect();
                let mut found: Vec<usize> = sides(pixel, width, height).into_iter().flatten().collect();
                found.sort_unstable();
                assert_eq!(found, expected);
                for radius in 1..3 {
                    let within = |q: &usize| *q != pixel && steps(*q).into_iter().all(|step| step <= radius);
                    let expected: Vec<usize> = pixels().filter(within).collect();
                    assert_eq!(square(pixel, width, height, radius).collect::<Vec<_>>(), expected);
                    if radius == 1 {
                        assert_eq!(around(pixel, width, height).collect::<Vec<_>>(), expected);
                    }
                    if radius == 1 && expected.len() == 8 {
                        let mut inner = around_inner(pixel, width);
                        assert_eq!(inner[..4], sides(pixel, width, height).map(Option::unwrap));
                        inner.sort_unstable();
                        assert_eq!(inner[..], expected);
                    }
                }
            }
        }
    }
}
