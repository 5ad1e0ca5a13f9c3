//! Rings, polygons with holes and boxes on the ground.

use crate::{DVec2, predicates::point_segment_distance};
use serde::{Deserialize, Serialize};

/// Signed area of a ring (first vertex not repeated): positive if counter-clockwise.
#[must_use]
pub fn ring_area(ring: &[DVec2]) -> f64 {
    let Some(&o) = ring.first() else { return 0.0 };
    let mut twice = 0.0;
    for i in 1..ring.len().saturating_sub(1) {
        twice += (ring[i] - o).perp_dot(ring[i + 1] - o);
    }
    0.5 * twice
}

/// Length of a closed ring.
#[must_use]
pub fn ring_perimeter(ring: &[DVec2]) -> f64 {
    (0..ring.len()).map(|i| ring[i].distance(ring[(i + 1) % ring.len()])).sum()
}

/// Even-odd test; points on the boundary fall on either side.
#[must_use]
pub fn ring_contains(ring: &[DVec2], p: DVec2) -> bool {
    let mut inside = false;
    let mut j = ring.len().wrapping_sub(1);
    for i in 0..ring.len() {
        let (a, b) = (ring[i], ring[j]);
        if (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x {
            inside = !inside;
        }
        j = i;
    }
    inside
}

/// A polygon with holes: outer ring counter-clockwise, holes clockwise, no vertex repeated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// Outer ring, counter-clockwise.
    pub outer: Vec<DVec2>,
    /// Holes, clockwise.
    pub holes: Vec<Vec<DVec2>>,
}

impl Polygon {
    /// Outer ring first, then the holes.
    pub fn rings(&self) -> impl Iterator<Item = &Vec<DVec2>> {
        std::iter::once(&self.outer).chain(&self.holes)
    }

    /// Area without the holes, m².
    #[must_use]
    pub fn area(&self) -> f64 {
        ring_area(&self.outer).abs() - self.holes.iter().map(|h| ring_area(h).abs()).sum::<f64>()
    }

    /// Whether `p` is inside the outer ring and in no hole.
    #[must_use]
    pub fn contains(&self, p: DVec2) -> bool {
        ring_contains(&self.outer, p) && !self.holes.iter().any(|h| ring_contains(h, p))
    }

    /// Distance from `p` to the boundary.
    #[must_use]
    pub fn boundary_distance(&self, p: DVec2) -> f64 {
        let mut best = f64::INFINITY;
        for ring in self.rings() {
            for i in 0..ring.len() {
                best = best.min(point_segment_distance(p, ring[i], ring[(i + 1) % ring.len()]));
            }
        }
        best
    }

    /// Bounding box of the outer ring.
    #[must_use]
    pub fn bounds(&self) -> Box2 {
        Box2::of(self.outer.iter().copied())
    }
}

/// An axis-parallel box on the ground; empty if `min` exceeds `max`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Box2 {
    /// Lower corner.
    pub min: DVec2,
    /// Upper corner.
    pub max: DVec2,
}

impl Default for Box2 {
    fn default() -> Self {
        Self { min: DVec2::INFINITY, max: DVec2::NEG_INFINITY }
    }
}

impl Box2 {
    /// The smallest box around the points.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = DVec2>) -> Self {
        let mut b = Self::default();
        for p in points {
            b.min = b.min.min(p);
            b.max = b.max.max(p);
        }
        b
    }

    /// Whether nothing is inside.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x || self.min.y > self.max.y
    }

    /// Widths along x and y.
    #[must_use]
    pub fn size(&self) -> DVec2 {
        self.max - self.min
    }

    /// The box grown by `margin` on every side.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Whether two boxes share a point.
    #[must_use]
    pub fn intersects(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Whether `p` is inside or on the border.
    #[must_use]
    pub fn contains(&self, p: DVec2) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dvec2;

    #[test]
    fn square_with_hole() {
        let square = |lo: f64, hi: f64| vec![dvec2(lo, lo), dvec2(hi, lo), dvec2(hi, hi), dvec2(lo, hi)];
        let mut hole = square(1.0, 2.0);
        hole.reverse();
        let p = Polygon { outer: square(0.0, 4.0), holes: vec![hole] };
        assert_eq!(p.area(), 15.0);
        assert!(p.contains(dvec2(3.0, 3.0)) && !p.contains(dvec2(1.5, 1.5)) && !p.contains(dvec2(5.0, 1.0)));
        assert_eq!(p.boundary_distance(dvec2(2.5, 1.5)), 0.5);
        assert_eq!(ring_perimeter(&p.outer), 16.0);
    }
}
