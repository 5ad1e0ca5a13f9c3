//! Narrow gaps between buildings, whose floor no camera has seen.
//!
//! In an alley or a light well that is much deeper than wide, multi-view stereo sees walls at best, and meshing spans a
//! ragged surface somewhere between eaves and ground. Taken by its height, that is a low roof that ties two buildings
//! together.

use gable_raster::{Raster, box_max, box_min};

/// Widest gap that is looked for, metres.
const WIDTH: f64 = 1.8;

/// Least depth under the lower of both sides, metres.
const DEPTH: f32 = 2.0;

/// And as a part of that side's height over the ground: the notch between two dormers is shallower.
const DEPTH_SHARE: f32 = 0.33;

/// The pixels in narrow, deep gaps: where closing the heights, with a square of [`WIDTH`], raises them by [`DEPTH`] and
/// by [`DEPTH_SHARE`] of the height over the ground. `heights` and `above` have no NaN. Reach: 2 m. O(pixels).
pub(crate) fn slots(heights: &Raster<f32>, above: &[f32]) -> Vec<bool> {
    let (w, h) = (heights.width(), heights.height());
    let radius = ((WIDTH / heights.window().step - 1.0) / 2.0).round().max(1.0) as usize;
    let closed = box_min(&box_max(heights.values(), w, h, radius), w, h, radius);
    let each = closed.iter().zip(heights.values()).zip(above);
    each.map(|((closed, z), above)| {
        let depth = closed - z;
        depth > DEPTH && depth > DEPTH_SHARE * (above + depth)
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;

    // Whether the middle of a gap of some width (metres) and depth between roofs at 10 m is a slot.
    fn is_slot(width: f64, floor: f32) -> bool {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 80, height: 60 };
        let z = |p: usize| if (window.centre(p % 80, 0).x - 8.1).abs() < 0.5 * width { floor } else { 10.0 };
        let heights = Raster::new(window, (0..window.len()).map(z).collect::<Vec<f32>>());
        slots(&heights, heights.values())[30 * 80 + 40]
    }

    #[test]
    fn an_alley_is_a_slot_and_a_notch_or_a_street_is_none() {
        assert!(is_slot(1.4, 5.0), "an alley that is half filled");
        assert!(is_slot(0.6, 0.2));
        assert!(!is_slot(1.4, 7.5), "between two dormers");
        assert!(!is_slot(3.0, 0.0), "a street");
    }
}
