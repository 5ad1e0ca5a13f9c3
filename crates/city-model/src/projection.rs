//! Planar work on faces without rounding: the coordinate along the normal's dominant axis is dropped.
//!
//! Dropping a coordinate is an affine map between the face's plane and a coordinate plane, so crossings, sides and
//! containment are the same in both, and the remaining coordinates are bit for bit those of the corners: exact
//! predicates then decide exactly. (Rotating into the plane would round.)

use gable_geometry::{DVec2, DVec3, dvec2};

/// The coordinate plane onto which a face is projected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AxisProjection {
    axis: u8,
    flipped: bool,
}

impl AxisProjection {
    /// The projection for faces with this normal: counter-clockwise seen against the normal stays counter-clockwise.
    /// `None` if the normal is zero or not finite.
    pub(crate) fn along(normal: DVec3) -> Option<Self> {
        let size = normal.abs();
        if !(size.max_element() > 0.0 && size.max_element().is_finite()) {
            return None;
        }
        let (axis, value) = if size.z >= size.x && size.z >= size.y {
            (2, normal.z)
        } else if size.x >= size.y {
            (0, normal.x)
        } else {
            (1, normal.y)
        };
        Some(Self { axis, flipped: value < 0.0 })
    }

    /// The point without the dropped coordinate.
    pub(crate) fn project(self, p: DVec3) -> DVec2 {
        let (u, v) = match self.axis {
            0 => (p.y, p.z),
            1 => (p.z, p.x),
            _ => (p.x, p.y),
        };
        if self.flipped { dvec2(v, u) } else { dvec2(u, v) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Orientation, dvec3, orientation};

    #[test]
    fn keeps_the_turning_sense() {
        let triangle = [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.2, 0.3), dvec3(0.1, 1.3, 0.9)];
        for order in [[0, 1, 2], [0, 2, 1]] {
            for turn in 0..3 {
                let rotate = |p: DVec3| [p, dvec3(p.y, p.z, p.x), dvec3(p.z, p.x, p.y)][turn];
                let [a, b, c] = order.map(|i| rotate(triangle[i]));
                let projection = AxisProjection::along((b - a).cross(c - a)).unwrap();
                let [a, b, c] = [a, b, c].map(|p| projection.project(p));
                assert_eq!(orientation(a, b, c), Orientation::Left);
            }
        }
        assert!(AxisProjection::along(DVec3::ZERO).is_none());
    }
}
