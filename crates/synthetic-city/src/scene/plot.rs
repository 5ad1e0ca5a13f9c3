//! Convex plots: what lies between streets, and what is already built on it.

use super::primitive::{Oblong, clip};
use gable_geometry::{DVec2, ring_area};

/// A convex plot, counter-clockwise, with the rings that stand on it.
pub(crate) struct Plot {
    pub(crate) ring: Vec<DVec2>,
    placed: Vec<Vec<DVec2>>,
}

/// A side of a plot along a street.
#[derive(Clone, Copy)]
pub(crate) struct Front {
    start: DVec2,
    pub(crate) along: DVec2,
    pub(crate) length: f64,
}

impl Front {
    /// Unit direction into the plot.
    pub(crate) fn inward(&self) -> DVec2 {
        self.along.perp()
    }

    /// The place `s` metres along and `t` metres into the plot.
    pub(crate) fn at(&self, s: f64, t: f64) -> DVec2 {
        self.start + self.along * s + self.inward() * t
    }

    /// Distance from the street, positive inside the plot.
    pub(crate) fn depth(&self, p: DVec2) -> f64 {
        self.inward().dot(p - self.start)
    }

    pub(crate) fn distance_along(&self, p: DVec2) -> f64 {
        self.along.dot(p - self.start)
    }

    /// The rectangle between two places along the side and two distances from it.
    pub(crate) fn rectangle(&self, s0: f64, s1: f64, t0: f64, t1: f64) -> Oblong {
        Oblong {
            centre: self.at(f64::midpoint(s0, s1), f64::midpoint(t0, t1)),
            axis: self.along,
            half_length: (s1 - s0) / 2.0,
            half_width: (t1 - t0) / 2.0,
        }
    }
}

impl Plot {
    pub(crate) fn new(ring: Vec<DVec2>) -> Self {
        Self { ring, placed: Vec::new() }
    }

    pub(crate) fn area(&self) -> f64 {
        ring_area(&self.ring).abs()
    }

    pub(crate) fn fronts(&self) -> Vec<Front> {
        let n = self.ring.len();
        let side = |i: usize| {
            let (start, end) = (self.ring[i], self.ring[(i + 1) % n]);
            let along = (end - start).try_normalize()?;
            Some(Front { start, along, length: start.distance(end) })
        };
        (0..n).filter_map(side).collect()
    }

    pub(crate) fn longest(&self) -> Option<Front> {
        self.fronts().into_iter().max_by(|a, b| a.length.total_cmp(&b.length))
    }

    pub(crate) fn middle(&self) -> DVec2 {
        self.ring.iter().sum::<DVec2>() / self.ring.len().max(1) as f64
    }

    /// Remembers that something stands there.
    pub(crate) fn take(&mut self, ring: Vec<DVec2>) {
        self.placed.push(ring);
    }

    /// Whether a convex ring lies inside the plot, at least `gap` metres from its sides and from what stands on it.
    pub(crate) fn is_free(&self, ring: &[DVec2], border: f64, gap: f64) -> bool {
        ring.iter().all(|p| self.holds(*p, border)) && self.placed.iter().all(|other| apart(ring, other) >= gap)
    }

    /// Whether a place is inside, at least `border` metres from the sides.
    pub(crate) fn holds(&self, p: DVec2, border: f64) -> bool {
        self.fronts().iter().all(|f| f.depth(p) >= border)
    }

    /// A large rectangle inside, along the longest side.
    pub(crate) fn inscribed(&self) -> Option<Oblong> {
        let front = self.longest()?;
        let (axis, centre) = (front.along, self.middle());
        let reach = |d: DVec2| self.ring.iter().map(|p| (*p - centre).dot(d).abs()).fold(0.0, f64::max);
        let mut plan = Oblong { centre, axis, half_length: reach(axis), half_width: reach(axis.perp()) };
        for step in 0..90 {
            if plan.ring().iter().all(|p| self.holds(*p, 0.0)) {
                return Some(plan);
            }
            // Now one side and now the other, so that the shape stays about that of the plot.
            if step % 2 == 0 {
                plan.half_length *= 0.96;
            } else {
                plan.half_width *= 0.96;
            }
        }
        None
    }
}

/// The part of a convex ring that is at least `depth` metres from all of its sides; empty if there is none.
pub(crate) fn inset(ring: &[DVec2], depth: f64) -> Vec<DVec2> {
    let mut out = ring.to_vec();
    for front in Plot::new(ring.to_vec()).fronts() {
        out = clip(&out, |p| front.depth(p) - depth);
        if out.len() < 3 {
            return Vec::new();
        }
    }
    out
}

/// A convex ring with its sides moved outside by `width` metres.
pub(crate) fn widened(ring: &[DVec2], width: f64) -> Vec<DVec2> {
    let fronts = Plot::new(ring.to_vec()).fronts();
    let n = fronts.len();
    let corner = |i: usize| {
        let (a, b) = (fronts[(i + n - 1) % n], fronts[i]);
        let sum = a.inward() + b.inward();
        b.start - sum * (width / (1.0 + a.inward().dot(b.inward())).max(0.3))
    };
    (0..n).map(corner).collect()
}

/// The smallest rectangle along a direction around points.
pub(crate) fn around(points: &[DVec2], axis: DVec2) -> Oblong {
    let span = |d: DVec2| {
        let along = points.iter().map(|p| p.dot(d));
        (along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max))
    };
    let ((s0, s1), (t0, t1)) = (span(axis), span(axis.perp()));
    Oblong {
        centre: axis * f64::midpoint(s0, s1) + axis.perp() * f64::midpoint(t0, t1),
        axis,
        half_length: (s1 - s0) / 2.0,
        half_width: (t1 - t0) / 2.0,
    }
}

/// How far two convex rings are apart along the best of their sides' normals; negative if they overlap.
fn apart(a: &[DVec2], b: &[DVec2]) -> f64 {
    let one = |a: &[DVec2], b: &[DVec2]| {
        Plot::new(a.to_vec())
            .fronts()
            .iter()
            .map(|f| b.iter().map(|p| -f.depth(*p)).fold(f64::INFINITY, f64::min))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    one(a, b).max(one(b, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    fn square(x: f64, y: f64, side: f64) -> Vec<DVec2> {
        vec![dvec2(x, y), dvec2(x + side, y), dvec2(x + side, y + side), dvec2(x, y + side)]
    }

    #[test]
    fn rings_grow_shrink_and_keep_apart() {
        let ring = square(0.0, 0.0, 10.0);
        assert!((ring_area(&widened(&ring, 2.0)) - 196.0).abs() < 1e-9);
        assert!((ring_area(&inset(&ring, 2.0)) - 36.0).abs() < 1e-9);
        assert!(inset(&ring, 5.1).is_empty());
        assert!((apart(&ring, &square(13.0, 4.0, 2.0)) - 3.0).abs() < 1e-12);
        assert!((apart(&ring, &square(9.0, 4.0, 2.0)) + 1.0).abs() < 1e-12);
        let mut plot = Plot::new(ring);
        assert!(plot.is_free(&square(1.0, 1.0, 3.0), 1.0, 0.5) && !plot.is_free(&square(0.5, 1.0, 3.0), 1.0, 0.5));
        plot.take(square(1.0, 1.0, 3.0));
        assert!(plot.is_free(&square(4.6, 1.0, 3.0), 1.0, 0.5) && !plot.is_free(&square(4.4, 1.0, 3.0), 1.0, 0.5));
        assert!((plot.inscribed().expect("a square").half_width - 5.0).abs() < 1e-12);
    }
}
