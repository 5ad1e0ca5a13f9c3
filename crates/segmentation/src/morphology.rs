//! Morphology of masks with discs, radii in pixels of any size.

use crate::distance::squared_distance;

/// Pixels within `radius` pixels of the mask. O(pixels), whatever the radius.
pub(crate) fn dilate(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
    squared_distance(mask, width, height, false).iter().map(|d| *d <= radius * radius).collect()
}

/// Pixels of the mask farther than `radius` pixels from everything else; the mask is thought to go on beyond the border.
pub(crate) fn erode(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
    let other: Vec<bool> = mask.iter().map(|m| !m).collect();
    squared_distance(&other, width, height, false).iter().map(|d| *d > radius * radius).collect()
}

/// Opening: breaks bridges and drops what is thinner than the disc.
pub(crate) fn open(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
    if radius <= 0.0 { mask.to_vec() } else { dilate(&erode(mask, width, height, radius), width, height, radius) }
}

/// Closing: fills holes and gaps that are thinner than the disc.
pub(crate) fn close(mask: &[bool], width: usize, height: usize, radius: f32) -> Vec<bool> {
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
