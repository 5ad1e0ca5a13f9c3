//! Webs: what a mesh spans from a wall down to the ground, or between two walls, where no camera looked.
//!
//! In a corner between high walls photogrammetry finds nothing and closes the surface with a slope. It stands as high as a
//! building and is taken for one, but nothing of it is a roof: it lies far below the plane that would be continued over it, and it
//! falls by more than it is wide.

use crate::input::BuildingInput;
use crate::surface::NONE;
use gable_geometry::Plane;
use gable_raster::{Connectivity, Raster, components_where, sides, square_cores};

/// How far below its plane a web lies, metres: more than any gutter, roof terrace or light well that is worth a plane.
const BELOW: f32 = 2.5;

/// Least fall of a web against its size (the root of its area): a steep roof of which no plane was found falls less.
const FALL: f64 = 1.0;

/// Share of a web's pixels at either end of its heights that do not count: the rounded edge above, the ground below.
const ENDS: usize = 10;

/// A narrower strip is the rounded edge of a wall, metres.
const WIDE: f64 = 0.6;

/// Takes webs off the mask and the pixel labelling. A web lies at the border of the mask. Returns the input without them;
/// `None` if there are none. O(pixels).
pub(crate) fn without(input: &BuildingInput, surface: &mut Raster<u16>, planes: &[Plane]) -> Option<BuildingInput> {
    let window = input.window();
    let (w, h) = (window.width, window.height);
    let labels = surface.values();
    let hangs = |p: usize| {
        let (label, z) = (labels[p], input.height.values()[p]);
        // Without height, under a crown, there is nothing that could hang.
        label != NONE && planes[label as usize].height(window.centre(p % w, p / w)) as f32 - z > BELOW
    };
    let low: Vec<bool> = (0..w * h).map(hangs).collect();
    if !low.contains(&true) {
        return None;
    }
    let wide = square_cores(&low, w, h, ((0.5 * WIDE / window.step) as usize).max(1), false);
    let parts = components_where(window, Connectivity::Four, |p| low[p], |_, _| true);
    let is_open = |beside: Option<usize>| beside.is_none_or(|q| labels[q] == NONE);
    let mut gone = Vec::new();
    for mut part in parts.members() {
        let is_wide = part.iter().any(|&p| wide[p]);
        let lies_open = || part.iter().any(|&p| sides(p, w, h).into_iter().any(is_open));
        if is_wide && lies_open() && fall(&part, &input.height) >= FALL * (part.len() as f64).sqrt() * window.step {
            gone.append(&mut part);
        }
    }
    if gone.is_empty() {
        return None;
    }
    let mut left = input.clone();
    for p in gone {
        left.mask.values_mut()[p] = false;
        surface.values_mut()[p] = NONE;
    }
    Some(left)
}

/// From which height to which most of some pixels reach, metres.
fn fall(part: &[usize], height: &Raster<f32>) -> f64 {
    let mut heights: Vec<f32> = part.iter().map(|&p| height.values()[p]).collect();
    let end = heights.len() / ENDS;
    let last = heights.len() - 1 - end;
    let high = *heights.select_nth_unstable_by(last, f32::total_cmp).1;
    let low = *heights.select_nth_unstable_by(end, f32::total_cmp).1;
    f64::from(high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_ortho::WallEvidence;
    use gable_raster::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: 0, y0: 0, width: 60, height: 50 };

    /// Pixels that are left of a level roof 20 m high of 8 × 6 m, beside which `beside` columns of the mask have other heights.
    fn left(beside: usize, height: impl Fn(usize, usize) -> f32) -> Option<usize> {
        let inside = |x: usize, y: usize| (5..45 + beside).contains(&x) && (10..40).contains(&y);
        let at = |f: &dyn Fn(usize, usize) -> f32| {
            Raster::new(WINDOW, (0..WINDOW.len()).map(|p| f(p % WINDOW.width, p / WINDOW.width)).collect())
        };
        let mask = at(&|x, y| if inside(x, y) { 1.0 } else { 0.0 }).map(|&m| m > 0.5);
        let input = BuildingInput {
            height: at(&|x, y| match (inside(x, y), x < 45) {
                (false, _) => 0.0,
                (true, true) => 20.0,
                (true, false) => height(x - 45, y),
            }),
            crowns: mask.map(|_| false),
            terrain: mask.map(|_| 0.0),
            normal: mask.map(|_| [0.0, 0.0, 1.0]),
            colour: None,
            walls: mask.map(|_| WallEvidence::default()),
            roof: None,
            facets: Vec::new(),
            mask,
        };
        let mut surface = input.mask.map(|&m| if m { 0 } else { NONE });
        let found = without(&input, &mut surface, &[Plane::horizontal(20.0)])?;
        assert!(found.mask.values().iter().zip(surface.values()).all(|(&m, &l)| m == (l != NONE)));
        Some(found.mask.values().iter().filter(|&&m| m).count())
    }

    #[test]
    fn what_falls_steeply_to_the_ground_goes() {
        // Over 2 m to the ground, in shelves. Its uppermost shelf is near enough to the roof to be its edge.
        assert_eq!(left(10, |x, _| 18.0 - 3.0 * (x / 2) as f32), Some((40 + 2) * 30));
    }

    #[test]
    fn low_roofs_gaps_in_the_data_and_rounded_edges_stay() {
        assert_eq!(left(10, |_, _| 8.0), None, "a level annexe without a plane");
        assert_eq!(left(10, |x, _| 9.0 - 0.2 * x as f32), None, "one at 45°");
        assert_eq!(left(10, |_, _| f32::NAN), None, "hidden by a crown");
        assert_eq!(left(2, |x, _| 12.0 - 8.0 * x as f32), None, "the edge of a wall");
        assert_eq!(left(0, |_, _| 0.0), None, "nothing");
    }

    #[test]
    fn a_light_well_stays() {
        // 2 × 2 m inside of the roof.
        assert_eq!(left(12, |x, y| if x < 10 && (20..30).contains(&y) { 2.0 * x as f32 } else { 20.0 }), None);
    }
}
