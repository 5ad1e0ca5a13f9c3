//! Lengthening segments before they slice the plane.

use gable_geometry::{Box2, BoxTree, DVec2, point_segment_distance};

/// How [`extend`] lengthens segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extension {
    /// Each end moves out by `factor` times the segment's length (the usual reading of Zhu 2018, §5.2, which
    /// says "extended" only).
    Factor(f64),
    /// Each end moves out until it hits another segment or another end's trace, but no further than
    /// `ratio · length + limit` metres; an end that hits nothing stays where it was.
    ///
    /// The ends grow at the same speed, and of two that meet, the one that arrives later stops (the rule of
    /// kinetic partitions, Bauchet & Lafarge 2018, with all speeds 1 and one collision). An end that already
    /// touches another segment, to within `touch` metres, does not move.
    UntilHit {
        /// Largest extension as a part of the segment's length.
        ratio: f64,
        /// Largest extension that is added to it, metres.
        limit: f64,
        /// Distance at which an end counts as touching, metres.
        touch: f64,
    },
}

/// The segments, lengthened by a rule, in the same order and direction. Segments of no length stay as they are.
///
/// `UntilHit` takes O(n log n + p log p) for p pairs whose boxes meet.
#[must_use]
pub fn extend(segments: &[(DVec2, DVec2)], rule: Extension) -> Vec<(DVec2, DVec2)> {
    match rule {
        Extension::Factor(factor) => {
            segments.iter().map(|&(a, b)| (a - (b - a) * factor, b + (b - a) * factor)).collect()
        }
        Extension::UntilHit { ratio, limit, touch } => until_hit(segments, ratio, limit, touch),
    }
}

/// A growing end.
struct Ray {
    origin: DVec2,
    direction: DVec2,
    /// How far it may grow, shortened when it hits an original segment.
    reach: f64,
    /// Whether `reach` is a hit.
    hit: bool,
    bounds: Box2,
}

fn until_hit(segments: &[(DVec2, DVec2)], ratio: f64, limit: f64, touch: f64) -> Vec<(DVec2, DVec2)> {
    let boxes: Vec<Box2> = segments.iter().map(|&(a, b)| Box2::of([a, b]).grown(touch)).collect();
    let tree = BoxTree::new(&boxes);
    let mut rays: Vec<Ray> = Vec::with_capacity(2 * segments.len());
    for &(a, b) in segments {
        let length = a.distance(b);
        let d = (b - a).normalize_or_zero();
        let reach = if length > 0.0 { ratio * length + limit } else { 0.0 };
        for (origin, direction) in [(a, -d), (b, d)] {
            let bounds = Box2::of([origin, origin + direction * reach]);
            rays.push(Ray { origin, direction, reach, hit: false, bounds });
        }
    }
    for (i, ray) in rays.iter_mut().enumerate() {
        for j in tree.near(&ray.bounds).into_iter().filter(|&j| j != i / 2) {
            let (a, b) = segments[j];
            if point_segment_distance(ray.origin, a, b) <= touch {
                (ray.reach, ray.hit) = (0.0, true);
                break;
            }
            let length = a.distance(b);
            let Some((t, u)) = meeting(ray.origin, ray.direction, a, (b - a) / length) else { continue };
            if (0.0..=ray.reach).contains(&t) && (-touch..=length + touch).contains(&u) {
                (ray.reach, ray.hit) = (t, true);
            }
        }
        ray.bounds = Box2::of([ray.origin, ray.origin + ray.direction * ray.reach]);
    }
    // Meetings of two rays, in the order in which the later one arrives.
    let mut events: Vec<(f64, f64, usize, usize)> = Vec::new();
    let tree = BoxTree::new(&rays.iter().map(|ray| ray.bounds).collect::<Vec<_>>());
    for i in 0..rays.len() {
        for j in tree.near(&rays[i].bounds).into_iter().filter(|&j| j > i && j / 2 != i / 2) {
            let (r, s) = (&rays[i], &rays[j]);
            let Some((t, u)) = meeting(r.origin, r.direction, s.origin, s.direction) else { continue };
            if (0.0..=r.reach).contains(&t) && (0.0..=s.reach).contains(&u) {
                let (first, later) = if (t, i) < (u, j) { (i, j) } else { (j, i) };
                events.push((t.max(u), t.min(u), later, first));
            }
        }
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then((a.2, a.3).cmp(&(b.2, b.3))));
    // How far a ray must grow so that the ends that stopped at it have something to stop at.
    let mut needed = vec![0.0f64; rays.len()];
    for (late, early, later, first) in events {
        if late <= rays[later].reach && early <= rays[first].reach {
            (rays[later].reach, rays[later].hit) = (late, true);
            needed[first] = needed[first].max(early);
        }
    }
    let end = |i: usize| {
        let r = &rays[i];
        r.origin + r.direction * if r.hit { r.reach } else { needed[i] }
    };
    (0..segments.len()).map(|i| (end(2 * i), end(2 * i + 1))).collect()
}

/// Parameters at which two lines, given by point and unit direction, meet; `None` if they are nearly parallel.
fn meeting(p: DVec2, d: DVec2, q: DVec2, e: DVec2) -> Option<(f64, f64)> {
    let den = d.perp_dot(e);
    // Rays within a quarter of a degree of each other meet at a point that means nothing.
    (den.abs() > 0.004).then(|| ((q - p).perp_dot(e) / den, (q - p).perp_dot(d) / den))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    fn until(limit: f64) -> Extension {
        Extension::UntilHit { ratio: 0.0, limit, touch: 0.01 }
    }

    #[test]
    fn open_corner_closes_and_a_free_end_stays() {
        let s = [(dvec2(1.0, 0.0), dvec2(9.0, 0.0)), (dvec2(10.0, 2.0), dvec2(10.0, 8.0))];
        let e = extend(&s, until(3.0));
        assert_eq!(e[0], (dvec2(1.0, 0.0), dvec2(10.0, 0.0)));
        assert_eq!(e[1], (dvec2(10.0, 0.0), dvec2(10.0, 8.0)));
        assert_eq!(extend(&s, until(0.5)), s);
    }

    #[test]
    fn the_later_ray_stops_at_the_earlier_one() {
        // The first ray reaches (10, 0) after 1 m and goes on to the wall at x = 12; the second arrives after 2 m.
        let wall = (dvec2(12.0, -1.0), dvec2(12.0, 1.0));
        let s = [(dvec2(0.0, 0.0), dvec2(9.0, 0.0)), (dvec2(10.0, 9.0), dvec2(10.0, 2.0)), wall];
        let e = extend(&s, until(5.0));
        assert_eq!(e[0].1, dvec2(12.0, 0.0));
        assert_eq!(e[1].1, dvec2(10.0, 0.0));
        assert_eq!(e[2], wall);
    }

    #[test]
    fn both_ends_move_by_a_part_of_the_length() {
        let e = extend(&[(dvec2(0.0, 0.0), dvec2(2.0, 0.0))], Extension::Factor(0.5));
        assert_eq!(e, [(dvec2(-1.0, 0.0), dvec2(3.0, 0.0))]);
    }
}
