//! Sets of triangles: exact distances from points, and points spread over them by area.

use crate::tree::{Bounds, Tree};
use gable_geometry::{Counter, DVec3};

/// Closest point of a triangle (Ericson, *Real-Time Collision Detection*, 2005, section 5.1.5: by Voronoi regions).
pub(crate) fn closest_point([a, b, c]: [DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let ap = p - a;
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    let (e, f) = (d4 - d3, d5 - d6);
    if va <= 0.0 && e >= 0.0 && f >= 0.0 && e + f > 0.0 {
        return b + (c - b) * (e / (e + f));
    }
    let sum = va + vb + vc;
    if sum > 0.0 { a + ab * (vb / sum) + ac * (vc / sum) } else { a }
}

/// Triangles that can be asked for their distance.
#[derive(Clone, Debug, Default)]
pub(crate) struct Triangles {
    corners: Vec<[DVec3; 3]>,
    tree: Tree,
}

impl Triangles {
    pub(crate) fn new(corners: Vec<[DVec3; 3]>) -> Self {
        let boxes: Vec<Bounds> = corners.iter().map(|&t| Bounds::of(t)).collect();
        Self { tree: Tree::new(&boxes), corners }
    }

    /// Distance from a point to the nearest triangle, at most `limit`.
    pub(crate) fn distance(&self, p: DVec3, limit: f64) -> f64 {
        let distance = |i: usize| closest_point(self.corners[i], p).distance_squared(p);
        self.tree.nearest_squared(p, limit * limit, distance).sqrt()
    }
}

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) position: DVec3,
    pub(crate) normal: DVec3,
}

/// Points spread uniformly over a triangle, `density` to the square metre on average, always the same for a key.
pub(crate) fn sample([a, b, c]: [DVec3; 3], density: f64, seed: u64, key: &[i64], out: &mut Vec<Sample>) {
    let cross = (b - a).cross(c - a);
    let Some(normal) = cross.try_normalize() else { return };
    let mut random = Counter::keyed(seed, key);
    let count = (0.5 * cross.length() * density + random.unit()).floor() as usize;
    for _ in 0..count {
        let (root, v) = (random.unit().sqrt(), random.unit());
        out.push(Sample { position: a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v), normal });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    const T: [DVec3; 3] = [dvec3(0., 0., 0.), dvec3(4., 0., 0.), dvec3(0., 3., 0.)];

    #[test]
    fn distances_to_face_edges_and_corners() {
        for (p, distance) in [
            (dvec3(1., 1., 5.), 5.0),
            (dvec3(2., -3., 4.), 5.0),
            (dvec3(-3., -4., 0.), 5.0),
            (dvec3(7., 0., 4.), 5.0),
            (dvec3(0., 6., 4.), 5.0),
            // The long side is 3x + 4y = 12; (4, 3) is 12/5 beyond it.
            (dvec3(4., 3., 0.), 2.4),
            (dvec3(1., 1., 0.), 0.0),
        ] {
            assert!((closest_point(T, p).distance(p) - distance).abs() < 1e-12, "{p}");
        }
        let line = [T[0], T[1], dvec3(2., 0., 0.)];
        assert!((closest_point(line, dvec3(1., 2., 0.)).distance(dvec3(1., 2., 0.)) - 2.0).abs() < 1e-12);
        let set = Triangles::new(vec![T, T.map(|p| p + dvec3(0., 0., 10.))]);
        assert_eq!(set.distance(dvec3(1., 1., 7.), 100.0), 3.0);
        assert_eq!(set.distance(dvec3(1., 1., 7.), 2.0), 2.0);
    }

    /// The barycentric minimum over a fine lattice of the triangle is never below the exact distance, and near it.
    #[test]
    fn agrees_with_a_lattice_search() {
        let mut random = Counter::new(9);
        let mut point = || dvec3(random.range(-2., 2.), random.range(-2., 2.), random.range(-2., 2.));
        for _ in 0..200 {
            let (t, p) = ([point(), point(), point()], point());
            let exact = closest_point(t, p).distance(p);
            let mut brute = f64::INFINITY;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                    brute = brute.min((t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v).distance(p));
                }
            }
            assert!(exact <= brute + 1e-12 && brute < exact + 0.12);
        }
    }

    #[test]
    fn samples_by_area_and_inside() {
        let mut out = Vec::new();
        sample(T, 1000.0, 1, &[1], &mut out);
        assert!((out.len() as i64 - 6000).abs() <= 1);
        let mean = out.iter().map(|s| s.position).sum::<DVec3>() / out.len() as f64;
        assert!(mean.distance(dvec3(4. / 3., 1., 0.)) < 0.05);
        assert!(out.iter().all(|s| closest_point(T, s.position).distance(s.position) < 1e-12 && s.normal.z == 1.0));
    }
}
