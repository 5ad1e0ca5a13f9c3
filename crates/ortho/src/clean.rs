//! Cleaning an orthograph: spikes out, small holes closed.

use crate::{DespikeParams, Orthograph, despike, fill_holes, quantised_normal};
use gable_geometry::DVec3;
use gable_raster::Raster;

/// Heights that differ by more from one pixel to the next are not one surface, metres.
const STEP: f32 = 1.0;

/// Parameters of [`clean`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CleanParams {
    /// What counts as a spike.
    pub despike: DespikeParams,
    /// Larger holes stay open, m² (default 4).
    pub max_hole: f64,
}

impl Default for CleanParams {
    fn default() -> Self {
        Self { despike: DespikeParams::default(), max_hole: 4.0 }
    }
}

impl CleanParams {
    /// How far away, in pixels, something can decide about a pixel: the margin that a window needs.
    #[must_use]
    pub fn reach(&self, step: f64) -> usize {
        self.despike.reach(step) + (self.max_hole / (step * step)).round() as usize + 2
    }
}

/// Removes spikes and pits ([`despike`]) and closes small holes ([`fill_holes`]). Pixels that get a new height get the
/// normal of the new surface, too, and no longer count as photographed; their colour stays what was seen. Wall evidence
/// is left as it is. Returns which pixels changed. Pixels nearer to the window's border than [`CleanParams::reach`] may
/// come out differently in a larger window.
pub fn clean(orthograph: &mut Orthograph, params: &CleanParams) -> Raster<bool> {
    let without = despike(&orthograph.height, &params.despike);
    let (filled, _) = fill_holes(&without, params.max_hole);
    let mut changed = Raster::filled(filled.window(), false);
    for (i, (new, old)) in filled.values().iter().zip(orthograph.height.values()).enumerate() {
        changed.values_mut()[i] = new.to_bits() != old.to_bits() && !(new.is_nan() && old.is_nan());
    }
    orthograph.height = filled;
    for y in 0..changed.height() {
        for x in 0..changed.width() {
            if changed[(x, y)] {
                orthograph.normal[(x, y)] = normal(&orthograph.height, x, y);
                orthograph.photographed[(x, y)] = false;
            }
        }
    }
    changed
}

/// Normal by differences to the neighbours on the same surface.
fn normal(height: &Raster<f32>, x: usize, y: usize) -> [f32; 3] {
    let h = height[(x, y)];
    if h.is_nan() {
        return [0.0; 3];
    }
    let slope = |before: Option<(usize, usize)>, after: Option<(usize, usize)>| {
        let near = |at: Option<(usize, usize)>| at.map(|at| height[at]).filter(|n| (n - h).abs() <= STEP);
        let rise = match (near(before), near(after)) {
            (Some(a), Some(b)) => 0.5 * (b - a),
            (Some(a), None) => h - a,
            (None, Some(b)) => b - h,
            (None, None) => 0.0,
        };
        f64::from(rise) / height.window().step
    };
    let up = |v: usize, count: usize| (v + 1 < count).then_some(v + 1);
    let east = slope(x.checked_sub(1).map(|x| (x, y)), up(x, height.width()).map(|x| (x, y)));
    let north = slope(y.checked_sub(1).map(|y| (x, y)), up(y, height.height()).map(|y| (x, y)));
    quantised_normal(DVec3::new(-east, -north, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;

    #[test]
    fn a_pole_on_a_slope_becomes_the_slope() {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 40, height: 40 };
        let mut o = Orthograph::empty(window);
        let slope = DVec3::new(-0.5, 0.0, 1.0);
        for i in 0..window.len() {
            o.height.values_mut()[i] = 0.5 * window.centre(i % 40, i / 40).x as f32;
            o.normal.values_mut()[i] = quantised_normal(slope);
            o.photographed.values_mut()[i] = true;
        }
        let before = o.clone();
        for at in [(20, 20), (21, 20), (20, 21)] {
            o.height[at] += 7.0;
            o.normal[at] = [1.0, 0.0, 0.0];
        }
        o.height[(5, 5)] = f32::NAN;
        let changed = clean(&mut o, &CleanParams::default());
        assert_eq!(changed.values().iter().filter(|&&c| c).count(), 4);
        for i in 0..window.len() {
            assert!((o.height.values()[i] - before.height.values()[i]).abs() < 0.1);
            let [n, m] = [&o, &before].map(|o| DVec3::from_array(o.normal.values()[i].map(f64::from)));
            assert!(n.angle_between(m) < 0.2);
            assert_eq!(o.photographed.values()[i], !changed.values()[i]);
        }
    }
}
