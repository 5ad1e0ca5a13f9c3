//! Exact orientation (Shewchuk's adaptive predicates, crate `robust`) and small distances.

use crate::DVec2;

/// Where a point lies, seen along a directed line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// To the left: the three points turn counter-clockwise.
    Left,
    /// On the line.
    On,
    /// To the right.
    Right,
}

/// Exact side of `p` with respect to the line from `a` to `b`.
#[must_use]
pub fn orientation(a: DVec2, b: DVec2, p: DVec2) -> Orientation {
    let c = |v: DVec2| robust::Coord { x: v.x, y: v.y };
    let det = robust::orient2d(c(a), c(b), c(p));
    if det > 0.0 {
        Orientation::Left
    } else if det < 0.0 {
        Orientation::Right
    } else {
        Orientation::On
    }
}

/// Distance from `p` to the closed segment from `a` to `b`.
#[must_use]
pub fn point_segment_distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let ab = b - a;
    let length2 = ab.length_squared();
    let t = if length2 > 0.0 { ((p - a).dot(ab) / length2).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + ab * t)
}
