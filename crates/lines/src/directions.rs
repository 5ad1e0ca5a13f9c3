//! Snapping segments to the directions of a building.

use crate::LineSegment;
use gable_geometry::DVec2;
use std::f64::consts::FRAC_PI_2;

/// Turns each segment that runs within `max_angle` (radians) of an axis of one of the `frames` onto that axis, about
/// its middle and without changing its length: the first step of Zhu's regularisation (2018, §5.2). A frame is the angle
/// of one of two orthogonal axes, radians, known up to quarter turns; the nearest axis wins, among equals that of the
/// first frame. The segment keeps its sense.
pub fn snap_directions(segments: &mut [LineSegment], frames: &[f64], max_angle: f64) {
    for segment in segments {
        let vector = segment.vector();
        if vector == DVec2::ZERO {
            continue;
        }
        let angle = vector.to_angle();
        // The turn that is missing to the nearest axis of a frame.
        let missing = |frame: f64| {
            let turn = frame - angle;
            turn - (turn / FRAC_PI_2).round() * FRAC_PI_2
        };
        let turns = frames.iter().map(|&f| missing(f));
        let Some(turn) = turns.min_by(|a, b| a.abs().total_cmp(&b.abs())).filter(|t| t.abs() <= max_angle) else {
            continue;
        };
        let (middle, half) = (segment.middle(), 0.5 * DVec2::from_angle(turn).rotate(vector));
        segment.a = middle - half;
        segment.b = middle + half;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;
    use gable_geometry::dvec2;

    #[test]
    fn turns_onto_the_nearest_axis_about_the_middle() {
        let line = |degrees: f64| {
            let half = 3.0 * DVec2::from_angle(degrees.to_radians());
            LineSegment { a: dvec2(5.0, 1.0) - half, b: dvec2(5.0, 1.0) + half, weight: 1.0, source: Source::Image }
        };
        for (from, to) in [(12.0, 10.0), (97.0, 100.0), (-172.0, -170.0), (-78.0, -80.0), (33.0, 30.0), (20.0, 20.0)] {
            let mut segments = [line(from)];
            snap_directions(&mut segments, &[10f64.to_radians(), 120f64.to_radians()], 5f64.to_radians());
            let wanted = line(to);
            assert!(segments[0].a.distance(wanted.a) < 1e-9 && segments[0].b.distance(wanted.b) < 1e-9, "{from}");
        }
    }
}
