//! Surfaces high over the ground that are too flat for a crown.
//!
//! Colour alone takes a sedum roof or green sheet metal for a tree, however large and level it is. No crown is a plane
//! over many metres, whatever its colour.

use gable_raster::{Raster, box_mean, box_min, plane_residual};

use crate::patches::patch_areas;

/// One scale on which flatness is looked for.
struct Scale {
    /// Side of the window, metres.
    side: f64,
    /// Largest rms distance to the window's plane, metres. Noise of photogrammetry on a roof is 0.05–0.14 m.
    residual: f32,
    /// Least share of pixels whose normal differs from that of the next one: flatness says something only where the mesh has
    /// facets enough to show a crown.
    facets: f32,
}

/// On a mesh of a face each 2 m² crowns show no plane of 10 m, on one of two faces each m² none of 5 m; on coarser ones a
/// crown may be a few facets wide, and colour has to decide.
const SCALES: [Scale; 2] =
    [Scale { side: 10.0, residual: 0.15, facets: 0.15 }, Scale { side: 5.0, residual: 0.12, facets: 0.3 }];

/// Side of the window in which a pixel itself must be flat, so that a bush on a roof is none, metres.
const OWN_SIDE: f64 = 1.0;

/// Largest residual there, metres.
const OWN_RESIDUAL: f32 = 0.2;

/// Planar patches speak against a crown from this area on, m².
const PATCH_AREA: f32 = 3.0;

/// The odds of a crown go down with this power of a patch's area. On synthetic tuning scenes of 7.5 faces per m² patches of 4
/// to 5 m² are 1.4 times as frequent on roofs as on crowns, such of 5 to 6 m² 3 times, of 6 to 8 m² 9, and larger ones 70 to
/// 400: the top of a smooth crown of 5 m radius has a patch of 5 m². The curve lies above these figures for small patches, since
/// that most of a crown lies in no patch is not counted for it; a start at 3.5 or 4 m² did worse.
const PATCH_POWER: f32 = 4.0;

/// What the largest patches say, as a logarithm of odds.
const PATCH_CERTAINTY: f32 = 6.0;

/// Side of the window in which patches are looked for, metres: between the patches of a roof lie ridges, valleys and
/// dormers.
const PATCH_WINDOW: f64 = 3.0;

/// Least share of what is high in the window that lies in patches. Half is as good as all.
const PATCH_SHARE: f32 = 0.25;

/// A window counts only if its mean height over the ground is at least this, metres.
const HIGH: f32 = 2.0;

/// What the shape of a surface says against its being a crown's.
pub(crate) struct Flatness {
    /// Pixels on a flat surface high over the ground: those that are flat themselves and lie in some window that is, see
    /// [`SCALES`].
    pub(crate) flat: Vec<bool>,
    /// By how much planar patches around a pixel lower the logarithm of the odds of a crown.
    pub(crate) patches: Vec<f32>,
}

/// Looks for flat windows and planar patches.
///
/// `heights` and `above` (over the ground) have no NaN; all rasters lie on one window. Distances to planes may be `noise` times as
/// large as on a mesh of the usual noise. Reach: 10 m. O(pixels).
pub(crate) fn flat_and_high(heights: &Raster<f32>, above: &[f32], normal: &Raster<[f32; 3]>, noise: f64) -> Flatness {
    let (w, h, step) = (heights.width(), heights.height(), heights.window().step);
    let radius = |side: f64| ((side / step - 1.0) / 2.0).round().max(1.0) as usize;
    let bound = |residual: f32| residual * noise as f32;
    let own = plane_residual(heights.values(), w, h, radius(OWN_SIDE));
    let borders = facet_borders(normal);
    let mut flat = vec![false; own.len()];
    for scale in SCALES {
        let r = radius(scale.side);
        let mut residual = plane_residual(heights.values(), w, h, r);
        let mean = box_mean(above, w, h, r);
        residual.iter_mut().zip(&mean).filter(|(_, mean)| **mean < HIGH).for_each(|(r, _)| *r = f32::INFINITY);
        let share = box_mean(&borders, w, h, r);
        let coarse = residual.iter_mut().zip(&share).filter(|(_, share)| **share < scale.facets);
        coarse.for_each(|(r, _)| *r = f32::INFINITY);
        let least = box_min(&residual, w, h, r);
        for ((flat, least), own) in flat.iter_mut().zip(&least).zip(&own) {
            *flat |= *least <= bound(scale.residual) && *own <= bound(OWN_RESIDUAL);
        }
    }
    let high: Vec<bool> = above.iter().map(|&z| z >= HIGH).collect();
    let certainty = |area: f32| (PATCH_POWER * (area / PATCH_AREA).ln()).clamp(0.0, PATCH_CERTAINTY);
    let says: Vec<f32> = patch_areas(heights, &high, &borders, noise).into_iter().map(certainty).collect();
    let mean = |of: &[f32]| box_mean(of, w, h, radius(PATCH_WINDOW));
    let share = |of: &mut dyn Iterator<Item = bool>| mean(&of.map(|is| f32::from(u8::from(is))).collect::<Vec<f32>>());
    let (sum, high) = (mean(&says), share(&mut high.iter().copied()));
    let covered = share(&mut says.iter().map(|&says| says > 0.0));
    let patches = (0..own.len())
        .map(|p| match covered[p] > 0.0 && covered[p] >= PATCH_SHARE * high[p] && own[p] <= bound(OWN_RESIDUAL) {
            true => (2.0 * sum[p] / high[p]).min(PATCH_CERTAINTY),
            false => 0.0,
        })
        .collect();
    Flatness { flat, patches }
}

/// 1 where the normal differs from that of the pixel to the east, else 0.
fn facet_borders(normal: &Raster<[f32; 3]>) -> Vec<f32> {
    let mut out = Vec::with_capacity(normal.values().len());
    for y in 0..normal.height() {
        let row = normal.row(y);
        out.extend(row.windows(2).map(|pair| f32::from(u8::from(pair[0] != pair[1]))));
        out.extend(row.last().map(|_| 0.0));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;
    use gable_raster::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: 0, y0: 0, width: 160, height: 120 };

    // The share of flat pixels within 5 m of the middle; `dense` makes every pixel a facet of its own.
    fn share(dense: bool, height: impl Fn(f64, f64) -> f64) -> f64 {
        let mut random = Counter::new(7);
        let middle = WINDOW.centre(80, 60);
        let at = |p: usize| WINDOW.centre(p % 160, p / 160) - middle;
        let z: Vec<f32> =
            (0..WINDOW.len()).map(|p| (height(at(p).x, at(p).y) + 0.1 * (random.unit() - 0.5)) as f32).collect();
        let normal = (0..WINDOW.len()).map(|p| [if dense { p as f32 } else { 0.0 }, 0.0, 1.0]).collect();
        let above = z.clone();
        let found = flat_and_high(&Raster::new(WINDOW, z), &above, &Raster::new(WINDOW, normal), 1.0);
        let is = |p: usize| found.flat[p] || found.patches[p] > 3.0;
        let near: Vec<usize> = (0..WINDOW.len()).filter(|&p| at(p).abs().max_element() < 3.0).collect();
        near.iter().filter(|&&p| is(p)).count() as f64 / near.len() as f64
    }

    #[test]
    fn halls_are_flat_and_crowns_are_not() {
        let hall = |x: f64, y: f64| if x.abs().max(y.abs()) < 8.0 { 7.0 + 0.3 * x } else { 0.0 };
        assert_eq!(share(true, hall), 1.0);
        let house = |x: f64, y: f64| if x.abs().max(y.abs()) < 3.0 { 7.0 } else { 0.0 };
        assert!(share(true, house) > 0.6);
        // One facet says nothing.
        assert_eq!(share(false, hall), 0.0);
        let crown = |x: f64, y: f64| 4.0 + (25.0 - x * x - y * y).max(0.0).sqrt();
        assert_eq!(share(true, crown), 0.0);
        // A lawn is flat, but not high.
        assert_eq!(share(true, |_, _| 0.3), 0.0);
    }

    #[test]
    fn a_bush_on_a_roof_is_not_flat() {
        let leaves = |x: f64, y: f64| 0.6 * ((9.0 * x).sin() + (11.0 * y).cos());
        let bush = |x: f64, y: f64| 7.0 + if x * x + y * y < 2.0 { leaves(x, y) } else { 0.0 };
        let found = share(true, bush);
        assert!(found > 0.7 && found < 0.95, "{found}");
    }
}
