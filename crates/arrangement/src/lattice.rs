//! Exact arithmetic on lattice points.
//!
//! Coordinates stay below 2^29 in absolute value ([`LIMIT`]), so a cross product of two differences fits an
//! `i64`, and a product of one with a difference fits an `i128`.

use std::cmp::Ordering;

/// Largest absolute coordinate of a [`Node`].
pub(crate) const LIMIT: i64 = 1 << 29;

/// A point of the lattice. Nodes are ordered by x, then y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Node {
    pub(crate) x: i64,
    pub(crate) y: i64,
}

/// Cross product of (a − o) and (b − o): positive if o, a, b turn counter-clockwise.
pub(crate) fn cross(o: Node, a: Node, b: Node) -> i64 {
    (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x)
}

/// Whether the open segments ab and cd cross in one point.
pub(crate) fn properly_cross(a: Node, b: Node, c: Node, d: Node) -> bool {
    let sides = |s: i64, t: i64| (s > 0 && t < 0) || (s < 0 && t > 0);
    sides(cross(a, b, c), cross(a, b, d)) && sides(cross(c, d, a), cross(c, d, b))
}

/// The lattice point whose pixel holds the crossing of ab and cd; ab and cd must cross properly.
pub(crate) fn rounded_crossing(a: Node, b: Node, c: Node, d: Node) -> Node {
    let at_c = i128::from(cross(a, b, c));
    let at_d = i128::from(cross(a, b, d));
    let (num, den) = if at_c > at_d { (at_c, at_c - at_d) } else { (-at_c, at_d - at_c) };
    // The crossing is c + (d − c)·num/den; halves round up, as the pixels are closed below and open above.
    let along = |from: i64, to: i64| from + ((2 * i128::from(to - from) * num + den).div_euclid(2 * den)) as i64;
    Node { x: along(c.x, d.x), y: along(c.y, d.y) }
}

/// Whether the closed segment ab meets the pixel of `p`: the unit square around it, closed to the west and
/// south, open to the east and north.
pub(crate) fn meets_pixel(a: Node, b: Node, p: Node) -> bool {
    // In doubled coordinates relative to p, the pixel is [−1, 1) × [−1, 1).
    let (mut low, mut high) = (Bound { num: 0, den: 1, open: false }, Bound { num: 1, den: 1, open: false });
    for (start, step) in [(2 * (a.x - p.x), 2 * (b.x - a.x)), (2 * (a.y - p.y), 2 * (b.y - a.y))] {
        if step == 0 {
            if !(-1..1).contains(&start) {
                return false;
            }
            continue;
        }
        // −1 ≤ start + t·step < 1
        let closed = Bound { num: (-1 - start) * step.signum(), den: step.abs(), open: false };
        let open = Bound { num: (1 - start) * step.signum(), den: step.abs(), open: true };
        let (from, to) = if step > 0 { (closed, open) } else { (open, closed) };
        match from.compare(&low) {
            Ordering::Greater => low = from,
            Ordering::Equal => low.open |= from.open,
            Ordering::Less => {}
        }
        match to.compare(&high) {
            Ordering::Less => high = to,
            Ordering::Equal => high.open |= to.open,
            Ordering::Greater => {}
        }
    }
    match low.compare(&high) {
        Ordering::Less => true,
        Ordering::Equal => !low.open && !high.open,
        Ordering::Greater => false,
    }
}

/// An end of an interval of a segment's parameter: num / den, with den > 0.
struct Bound {
    num: i64,
    den: i64,
    open: bool,
}

impl Bound {
    fn compare(&self, other: &Self) -> Ordering {
        (i128::from(self.num) * i128::from(other.den)).cmp(&(i128::from(other.num) * i128::from(self.den)))
    }
}

/// Order of the directions o→a and o→b, counter-clockwise from the positive x axis (inclusive).
pub(crate) fn compare_angle(o: Node, a: Node, b: Node) -> Ordering {
    let lower = |p: Node| p.y < o.y || (p.y == o.y && p.x < o.x);
    lower(a).cmp(&lower(b)).then_with(|| 0.cmp(&cross(o, a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn node() -> impl Strategy<Value = Node> {
        (-6i64..6, -6i64..6).prop_map(|(x, y)| Node { x, y })
    }

    #[test]
    fn rounding_goes_up_at_halves() {
        let n = |x, y| Node { x, y };
        assert_eq!(rounded_crossing(n(0, 0), n(1, 1), n(0, 1), n(1, 0)), n(1, 1));
        assert_eq!(rounded_crossing(n(0, 0), n(-1, -1), n(0, -1), n(-1, 0)), n(0, 0));
        assert!(meets_pixel(n(0, 0), n(1, 1), n(1, 1)) && !meets_pixel(n(0, 1), n(1, 0), n(0, 0)));
        assert!(meets_pixel(n(0, 1), n(1, 0), n(1, 1)));
    }

    proptest! {
        /// The crossing of two segments lies in the pixel it is rounded to, so both of them meet that pixel.
        #[test]
        fn both_segments_meet_the_pixel_of_their_crossing(a in node(), b in node(), c in node(), d in node()) {
            if properly_cross(a, b, c, d) {
                let p = rounded_crossing(a, b, c, d);
                prop_assert!(meets_pixel(a, b, p) && meets_pixel(c, d, p));
            }
        }

        /// Against dense sampling of the segment at rational parameters that include all corners' ones.
        #[test]
        fn pixel_test_agrees_with_sampling(a in node(), b in node(), p in node()) {
            let den = 2 * 27720; // divisible by 2·(1..=12)
            let sampled = (0..=den).step_by(1).any(|t| {
                let at = |from: i64, to: i64, centre: i64| 2 * den * (from - centre) + 2 * t * (to - from);
                let inside = |v: i64| -den <= v && v < den;
                inside(at(a.x, b.x, p.x)) && inside(at(a.y, b.y, p.y))
            });
            prop_assert_eq!(sampled, meets_pixel(a, b, p));
        }
    }
}
