//! Planes that are graphs over the ground: z = a·x + b·y + c.

use crate::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A non-vertical plane, z = a·x + b·y + c.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Slope along x.
    pub a: f64,
    /// Slope along y.
    pub b: f64,
    /// Height at the origin, metres.
    pub c: f64,
}

impl Plane {
    /// A horizontal plane.
    #[must_use]
    pub fn horizontal(z: f64) -> Self {
        Self { a: 0.0, b: 0.0, c: z }
    }

    /// The plane through `point` with the given normal; `None` if the normal is (almost) horizontal.
    #[must_use]
    pub fn from_normal(normal: DVec3, point: DVec3) -> Option<Self> {
        if normal.z.abs() < 1e-9 * normal.length() || !normal.is_finite() {
            return None;
        }
        let (a, b) = (-normal.x / normal.z, -normal.y / normal.z);
        Some(Self { a, b, c: point.z - a * point.x - b * point.y })
    }

    /// Height at a point of the ground.
    #[must_use]
    pub fn height(&self, p: DVec2) -> f64 {
        self.a * p.x + self.b * p.y + self.c
    }

    /// The point of the plane above `p`.
    #[must_use]
    pub fn lift(&self, p: DVec2) -> DVec3 {
        p.extend(self.height(p))
    }

    /// Unit normal, pointing up.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        DVec3::new(-self.a, -self.b, 1.0).normalize()
    }

    /// Angle to the horizontal, radians in [0, π/2).
    #[must_use]
    pub fn slope(&self) -> f64 {
        self.a.hypot(self.b).atan()
    }

    /// Orthogonal distance of a point, positive above the plane.
    #[must_use]
    pub fn distance(&self, p: DVec3) -> f64 {
        (p.z - self.height(p.truncate())) / (1.0 + self.a * self.a + self.b * self.b).sqrt()
    }

    /// The line (point, unit direction) on the ground where two planes have the same height;
    /// `None` if they are parallel to within `1e-9`.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Option<(DVec2, DVec2)> {
        let n = DVec2::new(self.a - other.a, self.b - other.b);
        let length = n.length();
        if length < 1e-9 {
            return None;
        }
        let unit = n / length;
        Some((unit * ((other.c - self.c) / length), unit.perp()))
    }

    /// The same plane seen from a frame whose origin is at `shift` in this one.
    #[must_use]
    pub fn shifted(&self, shift: DVec3) -> Self {
        Self { c: self.height(shift.truncate()) - shift.z, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intersection_has_equal_heights() {
        let p = Plane { a: 0.5, b: -0.1, c: 3.0 };
        let q = Plane { a: -0.5, b: 0.2, c: 8.0 };
        let (at, dir) = p.intersection(&q).unwrap();
        for t in [-10.0, 0.0, 25.0] {
            let x = at + dir * t;
            assert!((p.height(x) - q.height(x)).abs() < 1e-9);
        }
        assert!(p.intersection(&Plane { c: 9.0, ..p }).is_none());
    }

    #[test]
    fn shifting_keeps_the_plane() {
        let p = Plane { a: 0.5, b: -0.1, c: 3.0 };
        let shift = DVec3::new(10.0, -4.0, 2.0);
        let x = DVec2::new(3.0, 7.0);
        assert!((p.shifted(shift).height(x) + shift.z - p.height(x + shift.truncate())).abs() < 1e-12);
    }
}
