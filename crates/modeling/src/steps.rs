//! Where exactly a wall stands: the place at which the surface passes the middle of its step.
//!
//! Multi-view stereo rounds corners by some decimetres and lets walls lean, alike on both sides of the wall. The middle
//! of the step is where the wall is; the border of a label mask lies wherever a threshold was passed.

use gable_geometry::DVec2;
use gable_lines::LineSegment;
use gable_raster::Raster;

/// How steps are looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Profile {
    /// Reach of a profile to either side of the segment, metres.
    pub(crate) reach: f64,
    /// Smallest height of a step, metres.
    pub(crate) step: f64,
}

/// Signed offset (metres, positive to the left, which is the higher side) at which the surface passes the middle
/// of its step: the median over profiles across the segment, and the share of profiles that have a step. `None`
/// if fewer than a third of them have one.
pub(crate) fn offset(segment: &LineSegment, height: &Raster<f32>, profile: Profile) -> Option<(f64, f64)> {
    let pixel = height.window().step;
    let along = segment.b - segment.a;
    let length = along.length();
    let unit = along.try_normalize()?;
    let left = unit.perp();
    let count = ((length / pixel) as usize).clamp(3, 400);
    let mut offsets = Vec::with_capacity(count);
    for i in 0..count {
        // The ends are rounded corners: leave out a tenth on either side.
        let t = 0.1 + 0.8 * (i as f64 + 0.5) / count as f64;
        if let Some(o) = crossing(segment.a + along * t, left, height, profile) {
            offsets.push(o);
        }
    }
    if offsets.len() * 3 < count {
        return None;
    }
    offsets.sort_by(f64::total_cmp);
    Some((offsets[offsets.len() / 2], offsets.len() as f64 / count as f64))
}

/// The place on a profile where the surface passes the middle between its lower right and its upper left end.
fn crossing(at: DVec2, left: DVec2, height: &Raster<f32>, profile: Profile) -> Option<f64> {
    let spacing = 0.5 * height.window().step;
    let half = (profile.reach / spacing).round() as i64;
    let sample = |i: i64| interpolate(height, at + left * (i as f64 * spacing));
    let mut values = Vec::with_capacity(2 * half as usize + 1);
    for i in -half..=half {
        values.push(sample(i)?);
    }
    let third = values.len() / 4;
    let low = median(&values[..third]);
    let high = median(&values[values.len() - third..]);
    if high - low < profile.step {
        return None;
    }
    let middle = 0.5 * (low + high);
    // The crossing nearest to the segment, upwards to the left.
    let mut best: Option<f64> = None;
    for i in 0..values.len() - 1 {
        let (a, b) = (values[i], values[i + 1]);
        if a < middle && b >= middle {
            let place = (i as f64 + (middle - a) / (b - a) - half as f64) * spacing;
            if best.is_none_or(|o| place.abs() < o.abs()) {
                best = Some(place);
            }
        }
    }
    best
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// Bilinear height; `None` outside the raster or beside a pixel without height.
fn interpolate(height: &Raster<f32>, at: DVec2) -> Option<f64> {
    let window = height.window();
    let u = at / window.step - DVec2::new(window.x0 as f64 + 0.5, window.y0 as f64 + 0.5);
    let (x, y) = (u.x.floor(), u.y.floor());
    if x < 0.0 || y < 0.0 || x + 1.0 >= window.width as f64 || y + 1.0 >= window.height as f64 {
        return None;
    }
    let (fx, fy) = (u.x - x, u.y - y);
    let (x, y) = (x as usize, y as usize);
    let z = |dx: usize, dy: usize| f64::from(height[(x + dx, y + dy)]);
    let value = (z(0, 0) * (1.0 - fx) + z(1, 0) * fx) * (1.0 - fy) + (z(0, 1) * (1.0 - fx) + z(1, 1) * fx) * fy;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;
    use gable_lines::Source;
    use gable_raster::GridWindow;

    #[test]
    fn finds_the_middle_of_a_leaning_wall() {
        // The wall leans from x = 4.7 (roof) to x = 5.3 (ground): it stands at 5.0.
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 50, height: 50 };
        let z = |p: usize| 6.0 * (1.0 - (window.centre(p % 50, p / 50).x - 4.7) / 0.6).clamp(0.0, 1.0);
        let height = Raster::new(window, (0..2500).map(|p| z(p) as f32).collect());
        // Drawn at 5.4 from south to north: the roof is to its left.
        let segment = LineSegment { a: dvec2(5.4, 2.0), b: dvec2(5.4, 8.0), weight: 6.0, source: Source::Outline };
        let (o, share) = offset(&segment, &height, Profile { reach: 1.2, step: 1.0 }).unwrap();
        assert!((o - 0.4).abs() < 0.02, "{o}");
        assert_eq!(share, 1.0);
        let flat = Raster::filled(window, 3.0);
        assert!(offset(&segment, &flat, Profile { reach: 1.2, step: 1.0 }).is_none());
    }
}
