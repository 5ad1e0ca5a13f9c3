//! The line segment that all sources share.

use gable_geometry::DVec2;

/// A directed line segment on the ground, local metres. The higher (or larger) side lies to its left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSegment {
    /// Start.
    pub a: DVec2,
    /// End.
    pub b: DVec2,
    /// How much evidence stands behind it; the unit depends on the source (metres of supported length, as a rule).
    pub weight: f64,
    /// Where it came from.
    pub source: Source,
}

impl LineSegment {
    /// From start to end.
    #[must_use]
    pub fn vector(&self) -> DVec2 {
        self.b - self.a
    }

    /// Length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.a.distance(self.b)
    }

    /// Unit vector from start to end; zero for a point.
    #[must_use]
    pub fn direction(&self) -> DVec2 {
        self.vector().normalize_or_zero()
    }

    /// The point half way.
    #[must_use]
    pub fn middle(&self) -> DVec2 {
        0.5 * (self.a + self.b)
    }

    /// The smallest distance between points of two segments (Han 2021, Eq. 3).
    #[must_use]
    pub fn distance(&self, other: &Self) -> f64 {
        use gable_geometry::point_segment_distance as far;
        let (p, q) = (self.vector(), other.vector());
        let side = |from: DVec2, along: DVec2, p: DVec2| along.perp_dot(p - from);
        let crosses = side(self.a, p, other.a) * side(self.a, p, other.b) < 0.0
            && side(other.a, q, self.a) * side(other.a, q, self.b) < 0.0;
        if crosses {
            return 0.0;
        }
        let ends = far(self.a, other.a, other.b).min(far(self.b, other.a, other.b));
        ends.min(far(other.a, self.a, self.b)).min(far(other.b, self.a, self.b))
    }
}

/// The source of a segment (Zhu 2018, §5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// The orthophoto.
    Image,
    /// Steps of the height map.
    Height,
    /// Creases of the normal maps.
    Normal,
    /// Steep facets: walls.
    Facade,
    /// The outline of the building mask.
    Outline,
    /// Where two roof planes meet.
    Intersection,
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    #[test]
    fn distance_is_zero_only_where_segments_meet() {
        let s =
            |a: (f64, f64), b: (f64, f64)| LineSegment { a: a.into(), b: b.into(), weight: 1.0, source: Source::Image };
        let base = s((0.0, 0.0), (4.0, 0.0));
        assert_eq!(base.distance(&s((1.0, -1.0), (2.0, 1.0))), 0.0);
        assert_eq!(base.distance(&s((1.0, 2.0), (2.0, 1.0))), 1.0);
        assert_eq!(base.distance(&s((5.0, 0.0), (7.0, 0.0))), 1.0);
        assert_eq!(base.distance(&s((4.0, 0.0), (7.0, 5.0))), 0.0);
        assert_eq!((base.length(), base.middle(), base.direction()), (4.0, dvec2(2.0, 0.0), dvec2(1.0, 0.0)));
    }
}
