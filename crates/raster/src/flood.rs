//! Growing a connected set of pixels from a seed.

use crate::neighbours::{Connectivity, around, sides};

/// The connected set of pixels that a seed lies in, in the order of a breadth-first search, in `found` (what was there goes).
///
/// `take` is asked of pixels beside those already found. It has to say `true` once at most for each pixel, so it keeps the
/// account of what was taken before, from seed to seed too. The seed belongs to the set, unasked. Where the whole raster is to be divided,
/// [`components`](crate::components()) is the faster way. O(pixels found).
///
/// ```
/// use gable_raster::{Connectivity, flood};
///
/// // 1 1 0
/// // 0 0 1
/// let mut free = [true, true, false, false, false, true];
/// let mut found = Vec::new();
/// free[0] = false;
/// flood(0, 3, 2, Connectivity::Four, &mut found, |pixel| std::mem::take(&mut free[pixel]));
/// assert_eq!(found, [0, 1]);
/// ```
pub fn flood(
    seed: usize,
    width: usize,
    height: usize,
    connectivity: Connectivity,
    found: &mut Vec<usize>,
    mut take: impl FnMut(usize) -> bool,
) {
    found.clear();
    found.push(seed);
    let mut next = 0;
    while let Some(&pixel) = found.get(next) {
        next += 1;
        match connectivity {
            Connectivity::Four => {
                found.extend(sides(pixel, width, height).into_iter().flatten().filter(|&other| take(other)));
            }
            Connectivity::Eight => found.extend(around(pixel, width, height).filter(|&other| take(other))),
        }
    }
}
