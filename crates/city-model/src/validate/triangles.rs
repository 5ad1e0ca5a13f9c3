//! Intersections between triangles of a mesh with shared vertices, decided exactly.

use super::segments::{Meeting, meeting};
use crate::projection::AxisProjection;
use gable_geometry::{DVec2, DVec3, Orientation, orientation};

/// The first pair (in sweep order) of triangles of different faces that share a point beyond their common corners and
/// edges. Triangles without area are passed over. A sweep along x finds the pairs whose boxes meet:
/// O(n log n + pairs).
pub(super) fn first_intersection(points: &[DVec3], triangles: &[(usize, [u32; 3])]) -> Option<(usize, usize)> {
    let sorted = boxes(points, triangles);
    for (k, (i, low, high)) in sorted.iter().enumerate() {
        for (j, other_low, other_high) in sorted[k + 1..].iter().take_while(|(_, other, _)| other.x <= high.x) {
            let ((f, s), (g, t)) = (&triangles[*i], &triangles[*j]);
            let meet = f != g && low.cmple(*other_high).all() && other_low.cmple(*high).all();
            if meet && intersect(points, *s, *t) {
                return Some((*i, *j));
            }
        }
    }
    None
}

/// Pairs (i of the first mesh, j of the second) whose boxes meet, until `hit` says so.
pub(super) fn sweep(
    points: &[DVec3],
    first: &[(usize, [u32; 3])],
    others: &[DVec3],
    second: &[(usize, [u32; 3])],
    mut hit: impl FnMut(usize, usize) -> bool,
) -> Option<(usize, usize)> {
    let a = boxes(points, first);
    let b = boxes(others, second);
    let longest = b.iter().map(|(_, low, high)| high.x - low.x).fold(0.0, f64::max);
    for (i, low, high) in &a {
        let start = b.partition_point(|(_, other, _)| other.x < low.x - longest);
        for (j, other_low, other_high) in b[start..].iter().take_while(|(_, other, _)| other.x <= high.x) {
            let meet = low.cmple(*other_high).all() && other_low.cmple(*high).all();
            if meet && hit(*i, *j) {
                return Some((*i, *j));
            }
        }
    }
    None
}

/// Boxes sorted by their lower x.
fn boxes(points: &[DVec3], triangles: &[(usize, [u32; 3])]) -> Vec<(usize, DVec3, DVec3)> {
    let corners = |t: &[u32; 3]| t.map(|i| points[i as usize]);
    let mut boxes: Vec<_> = triangles
        .iter()
        .enumerate()
        .map(|(i, (_, t))| {
            let [a, b, c] = corners(t);
            (i, a.min(b).min(c), a.max(b).max(c))
        })
        .collect();
    boxes.sort_by(|p, q| p.1.x.total_cmp(&q.1.x).then(p.0.cmp(&q.0)));
    boxes
}

/// Whether two triangles of one mesh share a point that is not of a common corner or edge.
pub(super) fn intersect(points: &[DVec3], s: [u32; 3], t: [u32; 3]) -> bool {
    let at = |i: u32| points[i as usize];
    let degenerate = |t: [u32; 3]| {
        let [a, b, c] = t.map(at);
        (b - a).cross(c - a) == DVec3::ZERO
    };
    if degenerate(s) || degenerate(t) {
        return false;
    }
    let shared: Vec<u32> = s.iter().copied().filter(|i| t.contains(i)).collect();
    let opposite = |t: [u32; 3]| t.iter().copied().find(|i| !shared.contains(i));
    match shared.as_slice() {
        [] => meet(s.map(at), t.map(at)),
        [v] => {
            // What they share is convex and holds v: if it is more, it reaches one of the edges opposite to v.
            let far = |t: [u32; 3]| {
                let k = t.iter().position(|i| i == v).unwrap_or(0);
                (at(t[(k + 1) % 3]), at(t[(k + 2) % 3]))
            };
            let ((a, b), (c, d)) = (far(s), far(t));
            segment_meets_triangle(a, b, t.map(at)) || segment_meets_triangle(c, d, s.map(at))
        }
        [u, v] => {
            let (Some(p), Some(q)) = (opposite(s), opposite(t)) else { return true };
            let (u, v, p, q) = (at(*u), at(*v), at(p), at(q));
            if side(u, v, p, q) != 0 {
                return false;
            }
            let Some(projection) = AxisProjection::along((v - u).cross(p - u)) else { return false };
            let [u, v, p, q] = [u, v, p, q].map(|x| projection.project(x));
            orientation(u, v, p) == orientation(u, v, q)
        }
        _ => true,
    }
}

/// Whether two triangles without common corners share a point.
pub(super) fn meet(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
    let sides = |t: [DVec3; 3], s: [DVec3; 3]| s.map(|p| side(t[0], t[1], t[2], p));
    let apart = |s: [i8; 3]| s == [1; 3] || s == [-1; 3];
    if apart(sides(t, s)) || apart(sides(s, t)) {
        return false;
    }
    let edges = |t: [DVec3; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    edges(s).into_iter().any(|(a, b)| segment_meets_triangle(a, b, t))
        || edges(t).into_iter().any(|(a, b)| segment_meets_triangle(a, b, s))
}

/// Whether the closed segment pq and the closed triangle share a point. Exact.
pub(super) fn segment_meets_triangle(p: DVec3, q: DVec3, t: [DVec3; 3]) -> bool {
    let [a, b, c] = t;
    let (sp, sq) = (side(a, b, c, p), side(a, b, c, q));
    if sp != 0 && sp == sq {
        return false;
    }
    if sp == 0 || sq == 0 {
        let Some(projection) = AxisProjection::along((b - a).cross(c - a)) else { return false };
        let flat = t.map(|x| projection.project(x));
        let (fp, fq) = (projection.project(p), projection.project(q));
        let within = |s: i8, f: DVec2| s == 0 && in_triangle(f, flat);
        if within(sp, fp) || within(sq, fq) {
            return true;
        }
        let crosses = |k: usize| meeting(fp, fq, flat[k], flat[(k + 1) % 3]) != Meeting::Apart;
        return sp == 0 && sq == 0 && (0..3).any(crosses);
    }
    let turns = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    !(turns.contains(&1) && turns.contains(&-1))
}

/// Whether p is inside the counter-clockwise triangle or on its border.
fn in_triangle(p: DVec2, t: [DVec2; 3]) -> bool {
    (0..3).all(|k| orientation(t[k], t[(k + 1) % 3], p) != Orientation::Right)
}

/// Exact side of p with respect to the plane through a, b and c: 1, 0 or -1.
pub(super) fn side(a: DVec3, b: DVec3, c: DVec3, p: DVec3) -> i8 {
    let coordinate = |v: DVec3| robust::Coord3D { x: v.x, y: v.y, z: v.z };
    let det = robust::orient3d(coordinate(a), coordinate(b), coordinate(c), coordinate(p));
    if det > 0.0 {
        1
    } else if det < 0.0 {
        -1
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Whole = [i64; 3];

    fn minus(a: Whole, b: Whole) -> Whole {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    fn cross(a: Whole, b: Whole) -> Whole {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    fn dot(a: Whole, b: Whole) -> i64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    fn normal(t: [Whole; 3]) -> Whole {
        cross(minus(t[1], t[0]), minus(t[2], t[0]))
    }

    /// Convex bodies are apart exactly if one of these axes separates them: the normals, the cross products of the
    /// edges, and for triangles in one plane the edges' normals in it.
    fn separated(s: [Whole; 3], t: [Whole; 3]) -> bool {
        let edges = |t: [Whole; 3]| [0, 1, 2].map(|k| minus(t[(k + 1) % 3], t[k]));
        let mut axes = vec![normal(s), normal(t)];
        for e in edges(s) {
            axes.push(cross(normal(s), e));
            axes.extend(edges(t).map(|f| cross(e, f)));
        }
        axes.extend(edges(t).map(|f| cross(normal(t), f)));
        axes.iter().any(|&axis| {
            let range = |t: [Whole; 3]| {
                let heights = t.map(|p| dot(p, axis));
                (heights.into_iter().min().unwrap(), heights.into_iter().max().unwrap())
            };
            let ((a, b), (c, d)) = (range(s), range(t));
            b < c || d < a
        })
    }

    fn triangle() -> impl Strategy<Value = [Whole; 3]> {
        let coordinate = || prop_oneof![3 => 0..4i64, 1 => 0..30i64];
        let corner = move || (coordinate(), coordinate(), coordinate()).prop_map(|(x, y, z)| [x, y, z]);
        prop::array::uniform3(corner()).prop_filter("area", |t| normal(*t) != [0; 3])
    }

    fn real(t: [Whole; 3]) -> [DVec3; 3] {
        t.map(|p| DVec3::from_array(p.map(|v| v as f64)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn equals_separating_axes(s in triangle(), t in triangle()) {
            prop_assert_eq!(meet(real(s), real(t)), !separated(s, t));
        }

        /// With a common corner: they share more exactly if one of them without a hundredth at that corner still
        /// meets the other (the far end of what they share lies on the far edge of one).
        #[test]
        fn one_common_corner(s in triangle(), t in triangle()) {
            let shift = minus(s[0], t[0]);
            let t = t.map(|p| [p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]]);
            prop_assume!(!t[1..].iter().any(|p| s[1..].contains(p)));
            let points: Vec<DVec3> = real(s).into_iter().chain(real(t)).collect();
            // In hundredths.
            let large = |p: Whole| p.map(|v| v * 100);
            let near = |p: Whole| [0, 1, 2].map(|k| 99 * s[0][k] + p[k]);
            let rest_meets = |s: [Whole; 3], t: [Whole; 3]| {
                let (a, b, c, d) = (near(s[1]), large(s[1]), large(s[2]), near(s[2]));
                !separated([a, b, c], t.map(large)) || !separated([a, c, d], t.map(large))
            };
            let expected = rest_meets(s, t) || rest_meets(t, s);
            prop_assert_eq!(intersect(&points, [0, 1, 2], [0, 4, 5]), expected);
            prop_assert_eq!(intersect(&points, [4, 5, 0], [2, 0, 1]), expected);
        }
    }

    #[test]
    fn a_common_edge() {
        let points = [(0., 0., 0.), (4., 0., 0.), (1., 3., 0.), (2., 1., 0.), (2., -1., 0.), (2., 1., 1e-9)]
            .map(|(x, y, z)| DVec3::new(x, y, z));
        assert!(intersect(&points, [0, 1, 2], [1, 0, 3]), "folded onto each other");
        assert!(!intersect(&points, [0, 1, 2], [1, 0, 4]), "side by side");
        assert!(!intersect(&points, [0, 1, 2], [1, 0, 5]), "an edge, however sharp");
        assert!(intersect(&points, [0, 1, 2], [2, 1, 0]), "the same");
    }
}
