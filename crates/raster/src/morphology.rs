//! Morphology of masks with discs, whose radii are in pixels and need not be whole.
//!
//! Masks are rows of `width` pixels from the south. Each operation costs O(pixels), whatever the radius.

use crate::distance::squared_distance;

/// Dilation: the pixels within `radius` pixels of the mask.
///
/// ```
/// let mask = [false, false, true, false, false];
/// assert_eq!(gable_raster::dilate(&mask, 5, 1, 1.0), [false, true, true, true, false]);
/// ```
#[must_use]
pub fn dilate(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
    squared_distance(mask, width, height, false).iter().map(|d| *d <= radius * radius).collect()
}

/// Erosion: the pixels of the mask farther than `radius` pixels from everything else; the mask is thought to go on beyond
/// the border.
///
/// ```
/// let mask = [true, true, true, false, true];
/// assert_eq!(gable_raster::erode(&mask, 5, 1, 1.0), [true, true, false, false, false]);
/// ```
#[must_use]
pub fn erode(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
    let other: Vec<bool> = mask.iter().map(|m| !m).collect();
    squared_distance(&other, width, height, false).iter().map(|d| *d > radius * radius).collect()
}

/// Opening: breaks bridges and drops what is thinner than the disc. A radius of 0 changes nothing.
///
/// ```
/// let mask = [true, false, true, true, true, false];
/// assert_eq!(gable_raster::open(&mask, 6, 1, 1.0), [false, false, true, true, true, false]);
/// ```
#[must_use]
pub fn open(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
    if radius <= 0.0 { mask.to_vec() } else { dilate(&erode(mask, width, height, radius), width, height, radius) }
}

/// Closing: fills holes and gaps that are thinner than the disc. A radius of 0 changes nothing.
///
/// ```
/// let mask = [true, false, true, false, false, false];
/// assert_eq!(gable_raster::close(&mask, 6, 1, 1.0), [true, true, true, false, false, false]);
/// ```
#[must_use]
pub fn close(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
    if radius <= 0.0 {
        return mask.to_vec();
    }
    let mut closed = erode(&dilate(mask, width, height, radius), width, height, radius);
    // Near the border the erosion knows less than the dilation: never lose what was there.
    closed.iter_mut().zip(mask).for_each(|(c, m)| *c |= m);
    closed
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn opening_cuts_a_bridge_and_keeps_the_houses() {
        let (w, h) = (40, 20);
        let inside = |x: usize, y: usize| (4..18).contains(&y) && ((3..15).contains(&x) || (24..37).contains(&x));
        let bridge = |x: usize, y: usize| (10..12).contains(&y) && (15..24).contains(&x);
        let mask: Vec<bool> = (0..w * h).map(|i| inside(i % w, i / w) || bridge(i % w, i / w)).collect();
        let opened = open(&mask, w, h, 2.0);
        assert!(!opened[11 * w + 19]);
        assert!(opened[10 * w + 5] && opened[5 * w + 25]);
        // The other way round the gap is closed.
        let gap: Vec<bool> =
            (0..w * h).map(|i| (4..18).contains(&(i / w)) && i % w != 20 && i % w > 3 && i % w < 37).collect();
        assert!(close(&gap, w, h, 1.0)[11 * w + 20]);
    }

    proptest! {
        #[test]
        fn opening_shrinks_closing_grows_and_both_are_idempotent(
            bits in prop::collection::vec(any::<bool>(), 12 * 14), radius in 0.0_f32..3.0
        ) {
            let opened = open(&bits, 12, 14, radius);
            prop_assert!(opened.iter().zip(&bits).all(|(o, b)| !o || *b));
            prop_assert_eq!(&open(&opened, 12, 14, radius), &opened);
            let closed = close(&bits, 12, 14, radius);
            prop_assert!(closed.iter().zip(&bits).all(|(c, b)| *c || !b));
        }
    }
}
