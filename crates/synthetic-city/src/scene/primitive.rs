//! Roof primitives: convex plans under the lower envelope of a few planes.
//!
//! Every usual roof is one of them or the upper envelope of some: a plane rises from an edge of the
//! plan at an eave height with a slope, and the roof is the lowest of those planes.

use gable_geometry::{DVec2, Plane};

/// A convex plan (counter-clockwise) and the planes whose minimum is its roof.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// Plan, convex, counter-clockwise.
    pub ring: Vec<DVec2>,
    /// Roof planes, the lowest holds.
    pub planes: Vec<Plane>,
}

/// A roof plane that rises inward from an edge.
#[derive(Clone, Copy, Debug)]
pub struct Rise {
    /// Index of the edge (from vertex i to i + 1).
    pub edge: usize,
    /// Height over the edge, metres.
    pub eave: f64,
    /// Rise per metre of distance from the edge.
    pub slope: f64,
}

/// Corners of cells that are nearer to each other are one, metres; less than what the envelope holds for one node.
const SHORTEST_SIDE: f64 = 1e-7;

/// A rectangle with an axis.
#[derive(Clone, Copy, Debug)]
pub struct Oblong {
    /// Centre.
    pub centre: DVec2,
    /// Unit direction of the length.
    pub axis: DVec2,
    /// Half the length, metres.
    pub half_length: f64,
    /// Half the width, metres.
    pub half_width: f64,
}

impl Oblong {
    /// Corners, counter-clockwise: edges 0 and 2 run along the axis, 1 and 3 are the ends.
    #[must_use]
    pub fn ring(&self) -> Vec<DVec2> {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].iter().map(|&(s, t)| self.at(s, t)).collect()
    }

    /// Whether a place is inside or on its border.
    #[must_use]
    pub fn contains(&self, p: DVec2) -> bool {
        let d = p - self.centre;
        d.dot(self.axis).abs() <= self.half_length && d.dot(self.axis.perp()).abs() <= self.half_width
    }

    /// The place at `s` half lengths along and `t` half widths across.
    #[must_use]
    pub fn at(&self, s: f64, t: f64) -> DVec2 {
        self.centre + self.axis * (s * self.half_length) + self.axis.perp() * (t * self.half_width)
    }
}

impl Primitive {
    /// The lower envelope of planes that rise from edges of a convex ring.
    #[must_use]
    pub fn rising(ring: Vec<DVec2>, rises: &[Rise]) -> Self {
        let planes = rises
            .iter()
            .map(|r| {
                let (a, b) = (ring[r.edge], ring[(r.edge + 1) % ring.len()]);
                let inward = (b - a).normalize().perp() * r.slope;
                Plane { a: inward.x, b: inward.y, c: r.eave - inward.dot(a) }
            })
            .collect();
        Self { ring, planes }
    }

    /// A flat roof.
    #[must_use]
    pub fn flat(ring: Vec<DVec2>, height: f64) -> Self {
        Self { ring, planes: vec![Plane::horizontal(height)] }
    }

    /// Two planes that rise from the long edges.
    #[must_use]
    pub fn gable(plan: &Oblong, eave: f64, slope: f64) -> Self {
        Self::rising(plan.ring(), &[Rise { edge: 0, eave, slope }, Rise { edge: 2, eave, slope }])
    }

    /// Four planes; those of the ends rise from `end_eave` (equal to `eave`: a hip; higher: a half-hip).
    #[must_use]
    pub fn hip(plan: &Oblong, eave: f64, slope: f64, end_eave: f64, end_slope: f64) -> Self {
        let rises = [
            Rise { edge: 0, eave, slope },
            Rise { edge: 1, eave: end_eave, slope: end_slope },
            Rise { edge: 2, eave, slope },
            Rise { edge: 3, eave: end_eave, slope: end_slope },
        ];
        Self::rising(plan.ring(), &rises)
    }

    /// Steep planes up to `rise` metres over the eave, then shallow ones, on all four sides.
    #[must_use]
    pub fn mansard(plan: &Oblong, eave: f64, steep: f64, rise: f64, shallow: f64) -> Self {
        let rises: Vec<Rise> = (0..4)
            .flat_map(|edge| {
                let knee = eave + rise - shallow * rise / steep;
                [Rise { edge, eave, slope: steep }, Rise { edge, eave: knee, slope: shallow }]
            })
            .collect();
        Self::rising(plan.ring(), &rises)
    }

    /// One plane that rises from the first long edge.
    #[must_use]
    pub fn shed(plan: &Oblong, eave: f64, slope: f64) -> Self {
        Self::rising(plan.ring(), &[Rise { edge: 0, eave, slope }])
    }

    /// A tower with `n` sides and a roof with as many planes.
    #[must_use]
    pub fn cone(centre: DVec2, radius: f64, n: usize, eave: f64, slope: f64) -> Self {
        let ring = (0..n)
            .map(|i| centre + DVec2::from_angle((i as f64 + 0.37) / n as f64 * std::f64::consts::TAU) * radius)
            .collect();
        let rises: Vec<Rise> = (0..n).map(|edge| Rise { edge, eave, slope }).collect();
        Self::rising(ring, &rises)
    }

    /// Height and plane of the roof over `p`, whether or not the plan covers it.
    #[must_use]
    pub fn lowest(&self, p: DVec2) -> Option<(f64, usize)> {
        self.planes
            .iter()
            .enumerate()
            .map(|(i, plane)| (plane.height(p), i))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    /// Whether the plan covers `p` (its border included).
    #[must_use]
    pub fn covers(&self, p: DVec2) -> bool {
        (0..self.ring.len()).all(|i| {
            let (a, b) = (self.ring[i], self.ring[(i + 1) % self.ring.len()]);
            (b - a).perp_dot(p - a) >= 0.0
        })
    }

    /// The part of the plan where plane `index` is the lowest: a convex ring without sides under 0.1 µm, empty if nowhere.
    pub(crate) fn cell(&self, index: usize) -> Vec<DVec2> {
        let mut ring = self.ring.clone();
        for (k, other) in self.planes.iter().enumerate() {
            if k != index {
                let own = self.planes[index];
                ring = clip(&ring, |p| other.height(p) - own.height(p));
            }
        }
        // Where three planes meet, two cuts leave the same corner twice, to rounding. The side between the two has any
        // direction, and whoever cuts along it cuts through the middle of something.
        ring.dedup_by(|b, a| a.distance(*b) < SHORTEST_SIDE);
        while ring.len() > 1 && ring[0].distance(ring[ring.len() - 1]) < SHORTEST_SIDE {
            ring.pop();
        }
        ring
    }
}

/// The part of a convex ring where a linear function is not negative (Sutherland–Hodgman, one line).
pub(crate) fn clip(ring: &[DVec2], side: impl Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut out = Vec::with_capacity(ring.len() + 1);
    for i in 0..ring.len() {
        let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
        let (fa, fb) = (side(a), side(b));
        if fa >= 0.0 {
            out.push(a);
        }
        if (fa > 0.0 && fb < 0.0) || (fa < 0.0 && fb > 0.0) {
            out.push(a.lerp(b, fa / (fa - fb)));
        }
    }
    out
}

/// The part of one convex ring inside another, whose sides must be long enough to have a direction.
pub(crate) fn intersect_convex(ring: &[DVec2], other: &[DVec2]) -> Vec<DVec2> {
    let mut out = ring.to_vec();
    for i in 0..other.len() {
        let (a, b) = (other[i], other[(i + 1) % other.len()]);
        out = clip(&out, |p| (b - a).perp_dot(p - a));
        if out.len() < 3 {
            return Vec::new();
        }
    }
    out
}

/// The upper envelope: the highest roof over `p` as (height, primitive, plane), `None` where no plan covers `p`.
#[must_use]
pub(crate) fn highest(primitives: &[Primitive], p: DVec2) -> Option<(f64, usize, usize)> {
    let mut best: Option<(f64, usize, usize)> = None;
    for (i, primitive) in primitives.iter().enumerate() {
        if primitive.covers(p)
            && let Some((z, plane)) = primitive.lowest(p)
            && best.is_none_or(|b| z > b.0)
        {
            best = Some((z, i, plane));
        }
    }
    best
}
