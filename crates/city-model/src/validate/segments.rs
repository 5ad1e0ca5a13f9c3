//! How segments in the plane meet, decided exactly; and the pairs of segments that may.

use gable_geometry::{DVec2, Orientation, orientation};

/// What two closed segments share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meeting {
    /// Nothing.
    Apart,
    /// One point, which is an end of at least one of them.
    Touch(DVec2),
    /// One point inside both.
    Cross,
    /// A piece of line.
    Overlap,
}

/// What the segments ab and cd share. Exact for coordinates whose differences do not underflow.
pub(super) fn meeting(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> Meeting {
    let apart = a.max(b).cmplt(c.min(d)).any() || c.max(d).cmplt(a.min(b)).any();
    if apart {
        return Meeting::Apart;
    }
    let (sc, sd) = (orientation(a, b, c), orientation(a, b, d));
    let (sa, sb) = (orientation(c, d, a), orientation(c, d, b));
    use Orientation::On;
    if sc == On && sd == On {
        return collinear(a, b, c, d);
    }
    if sc == sd || sa == sb {
        return Meeting::Apart;
    }
    match (sa, sb, sc, sd) {
        (On, ..) => Meeting::Touch(a),
        (_, On, ..) => Meeting::Touch(b),
        (_, _, On, _) => Meeting::Touch(c),
        (_, _, _, On) => Meeting::Touch(d),
        _ => Meeting::Cross,
    }
}

/// Segments on one line: compared along the axis on which ab is longer.
fn collinear(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> Meeting {
    let along_x = (b - a).x.abs() >= (b - a).y.abs();
    let key = |p: DVec2| if along_x { p.x } else { p.y };
    let order = |p: DVec2, q: DVec2| if key(p) <= key(q) { (p, q) } else { (q, p) };
    let ((a, b), (c, d)) = (order(a, b), order(c, d));
    let low = if key(a) >= key(c) { a } else { c };
    let high = if key(b) <= key(d) { b } else { d };
    if key(low) > key(high) {
        Meeting::Apart
    } else if key(low) == key(high) {
        Meeting::Touch(low)
    } else {
        Meeting::Overlap
    }
}

/// Calls `visit` for all pairs of segments (by index, `i < j`) whose extents along x meet, until it breaks off.
/// All pairs up to 24 segments, a sweep along x beyond: O(n log n + pairs).
pub(super) fn candidate_pairs<B>(
    segments: &[(DVec2, DVec2)],
    mut visit: impl FnMut(usize, usize) -> Option<B>,
) -> Option<B> {
    let n = segments.len();
    if n <= 24 {
        return (0..n).find_map(|i| (i + 1..n).find_map(|j| visit(i, j)));
    }
    let low = |i: usize| segments[i].0.x.min(segments[i].1.x);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| low(i).total_cmp(&low(j)).then(i.cmp(&j)));
    for (k, &i) in order.iter().enumerate() {
        let high = segments[i].0.x.max(segments[i].1.x);
        for &j in order[k + 1..].iter().take_while(|&&j| low(j) <= high) {
            if let Some(b) = visit(i.min(j), i.max(j)) {
                return Some(b);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;
    use proptest::prelude::*;

    /// Rational oracle on small integers.
    fn oracle(p: [(i64, i64); 4]) -> (bool, bool) {
        let cross = |a: (i64, i64), b: (i64, i64), c: (i64, i64)| {
            ((b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)).signum()
        };
        let on = |a: (i64, i64), b: (i64, i64), c: (i64, i64)| {
            cross(a, b, c) == 0
                && (a.0.min(b.0)..=a.0.max(b.0)).contains(&c.0)
                && (a.1.min(b.1)..=a.1.max(b.1)).contains(&c.1)
        };
        let [a, b, c, d] = p;
        let proper = cross(a, b, c) * cross(a, b, d) < 0 && cross(c, d, a) * cross(c, d, b) < 0;
        let any = proper || on(a, b, c) || on(a, b, d) || on(c, d, a) || on(c, d, b);
        (any, proper)
    }

    proptest! {
        #[test]
        fn equals_the_oracle(raw in prop::array::uniform4((0..6i64, 0..6i64))) {
            prop_assume!(raw[0] != raw[1] && raw[2] != raw[3]);
            let (any, proper) = oracle(raw);
            let [a, b, c, d] = raw.map(|(x, y)| dvec2(x as f64, y as f64));
            let found = meeting(a, b, c, d);
            prop_assert_eq!(found != Meeting::Apart, any);
            prop_assert_eq!(found == Meeting::Cross, proper);
            prop_assert_eq!(found, meeting(c, d, a, b));
        }

        #[test]
        fn the_sweep_finds_all_pairs(raw in prop::collection::vec(((0..50i32, 0..50i32), (0..50i32, 0..50i32)), 25..60)) {
            let at = |(x, y): (i32, i32)| dvec2(x.into(), y.into());
            let segments: Vec<_> = raw.iter().map(|&(p, q)| (at(p), at(q))).collect();
            let mut found = Vec::new();
            candidate_pairs(&segments, |i, j| { found.push((i, j)); None::<()> });
            found.sort_unstable();
            let reach = |i: usize| (segments[i].0.x.min(segments[i].1.x), segments[i].0.x.max(segments[i].1.x));
            let mut expected = Vec::new();
            for i in 0..segments.len() {
                for j in i + 1..segments.len() {
                    if reach(i).0 <= reach(j).1 && reach(j).0 <= reach(i).1 {
                        expected.push((i, j));
                    }
                }
            }
            prop_assert_eq!(found, expected);
        }
    }
}
