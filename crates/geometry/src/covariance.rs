//! Covariance of points and the eigensystems of small symmetric matrices.

use crate::{DVec2, DVec3, Plane};

/// Running sums from which centroid, covariance and the best plane of a set of points come.
/// Sums are taken about the first point, so that large coordinates lose nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Covariance3 {
    origin: DVec3,
    weight: f64,
    sum: DVec3,
    squares: [f64; 6],
}

impl Covariance3 {
    /// Adds a point.
    pub fn add(&mut self, p: DVec3, weight: f64) {
        if self.weight == 0.0 {
            self.origin = p;
        }
        let d = p - self.origin;
        self.weight += weight;
        self.sum += d * weight;
        let s = &mut self.squares;
        s[0] += weight * d.x * d.x;
        s[1] += weight * d.x * d.y;
        s[2] += weight * d.x * d.z;
        s[3] += weight * d.y * d.y;
        s[4] += weight * d.y * d.z;
        s[5] += weight * d.z * d.z;
    }

    /// Adds all points of another set.
    pub fn merge(&mut self, other: &Self) {
        if other.weight == 0.0 {
            return;
        }
        if self.weight == 0.0 {
            *self = *other;
            return;
        }
        let d = other.origin - self.origin;
        let (w, s) = (other.weight, other.sum);
        let o = &other.squares;
        let q = &mut self.squares;
        q[0] += o[0] + 2.0 * d.x * s.x + w * d.x * d.x;
        q[1] += o[1] + d.x * s.y + d.y * s.x + w * d.x * d.y;
        q[2] += o[2] + d.x * s.z + d.z * s.x + w * d.x * d.z;
        q[3] += o[3] + 2.0 * d.y * s.y + w * d.y * d.y;
        q[4] += o[4] + d.y * s.z + d.z * s.y + w * d.y * d.z;
        q[5] += o[5] + 2.0 * d.z * s.z + w * d.z * d.z;
        self.sum += s + d * w;
        self.weight += w;
    }

    /// Total weight.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Centroid; the zero vector for the empty set.
    #[must_use]
    pub fn centroid(&self) -> DVec3 {
        if self.weight > 0.0 { self.origin + self.sum / self.weight } else { DVec3::ZERO }
    }

    /// Covariance as (xx, xy, xz, yy, yz, zz).
    #[must_use]
    pub fn matrix(&self) -> [f64; 6] {
        if self.weight <= 0.0 {
            return [0.0; 6];
        }
        let m = self.sum / self.weight;
        let s = self.squares.map(|v| v / self.weight);
        [s[0] - m.x * m.x, s[1] - m.x * m.y, s[2] - m.x * m.z, s[3] - m.y * m.y, s[4] - m.y * m.z, s[5] - m.z * m.z]
    }

    /// Eigenvalues, ascending and not negative, with their unit vectors. The first vector is the normal of the
    /// plane that fits best orthogonally.
    #[must_use]
    pub fn eigen(&self) -> ([f64; 3], [DVec3; 3]) {
        let (values, vectors) = symmetric_eigen_3(self.matrix());
        (values.map(|v| v.max(0.0)), vectors)
    }

    /// The least-squares plane of vertical distances, with the normal equations damped by a ridge of
    /// `1e-9` m² so that points on a line give the flattest plane through them; `None` for the empty set.
    #[must_use]
    pub fn height_plane(&self) -> Option<Plane> {
        let [xx, xy, xz, yy, yz, _] = self.matrix();
        self.plane_of([xx + 1e-9, xy, yy + 1e-9], [xz, yz])
    }

    /// The least-squares plane of vertical distances, undamped; `None` if the points lie on a line or in one place: the
    /// determinant of their covariance in plan is not above `1e-9` m⁴.
    #[must_use]
    pub fn undamped_height_plane(&self) -> Option<Plane> {
        let [xx, xy, xz, yy, yz, _] = self.matrix();
        if xx * yy - xy * xy > 1e-9 { self.plane_of([xx, xy, yy], [xz, yz]) } else { None }
    }

    /// The plane through the centroid with the slopes of [`least_squares_slopes`].
    fn plane_of(&self, plan: [f64; 3], heights: [f64; 2]) -> Option<Plane> {
        if self.weight <= 0.0 {
            return None;
        }
        let [a, b] = least_squares_slopes(plan, heights);
        let c = self.centroid();
        (a.is_finite() && b.is_finite()).then_some(Plane { a, b, c: c.z - a * c.x - b * c.y })
    }
}

/// The slopes along x and y of the plane z = a·x + b·y + c that fits best by vertical distances, from second moments about
/// the centroid: (xx, xy, yy) of the places, (xz, yz) of the heights with them, all in one unit. Not finite if the places lie on a
/// line; add a ridge to xx and yy where they may.
///
/// ```
/// // z = 2x − y at the corners of a square from −1 to 1.
/// assert_eq!(gable_geometry::least_squares_slopes([1.0, 0.0, 1.0], [2.0, -1.0]), [2.0, -1.0]);
/// ```
#[inline]
#[must_use]
pub fn least_squares_slopes([xx, xy, yy]: [f64; 3], [xz, yz]: [f64; 2]) -> [f64; 2] {
    let determinant = xx * yy - xy * xy;
    [(xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant]
}

/// Eigenvalues (ascending) and unit vectors of the symmetric matrix (xx, xy, yy).
#[must_use]
pub fn symmetric_eigen_2([xx, xy, yy]: [f64; 3]) -> ([f64; 2], [DVec2; 2]) {
    let half = 0.5 * (xx - yy);
    let root = half.hypot(xy);
    let mean = 0.5 * (xx + yy);
    let angle = 0.5 * xy.atan2(half);
    let major = DVec2::from_angle(angle);
    ([mean - root, mean + root], [major.perp(), major])
}

/// Eigenvalues (ascending) and unit vectors of the symmetric matrix (xx, xy, xz, yy, yz, zz), by cyclic
/// Jacobi rotations: slower than the closed form, and right when values coincide.
#[must_use]
pub fn symmetric_eigen_3([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> ([f64; 3], [DVec3; 3]) {
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let scale: f64 = a.iter().flatten().map(|x| x * x).sum();
    for _ in 0..24 {
        let off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
        if off <= 1e-30 * scale {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let t = if theta == 0.0 { 1.0 } else { t };
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            for k in 0..3 {
                let (x, y) = (a[k][p], a[k][q]);
                a[k][p] = c * x - s * y;
                a[k][q] = s * x + c * y;
            }
            for k in 0..3 {
                let (x, y) = (a[p][k], a[q][k]);
                a[p][k] = c * x - s * y;
                a[q][k] = s * x + c * y;
            }
            for row in &mut v {
                let (x, y) = (row[p], row[q]);
                row[p] = c * x - s * y;
                row[q] = s * x + c * y;
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    (order.map(|i| a[i][i]), order.map(|i| DVec3::new(v[0][i], v[1][i], v[2][i]).normalize()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Counter;

    #[test]
    fn finds_the_plane_under_noise_far_from_the_origin() {
        let truth = Plane { a: 0.3, b: -0.7, c: 12.0 };
        let mut rng = Counter::new(1);
        let (mut whole, mut halves) = (Covariance3::default(), [Covariance3::default(); 2]);
        for i in 0..2000 {
            let p = DVec2::new(5.4e5 + rng.range(0.0, 10.0), 5.9e6 + rng.range(0.0, 10.0));
            let q = p.extend(truth.height(p) + 0.05 * rng.normal());
            whole.add(q, 1.0);
            halves[i % 2].add(q, 1.0);
        }
        let (mut merged, rest) = (halves[0], halves[1]);
        merged.merge(&rest);
        for cov in [whole, merged] {
            let fit = cov.height_plane().unwrap();
            assert!((fit.a - truth.a).abs() < 2e-3 && (fit.b - truth.b).abs() < 2e-3);
            let undamped = cov.undamped_height_plane().unwrap();
            assert!((fit.a - undamped.a).abs() < 1e-8 && (fit.b - undamped.b).abs() < 1e-8);
            let (values, vectors) = cov.eigen();
            assert!(values[0] < 0.01 && vectors[0].dot(truth.normal()).abs() > 0.9999);
        }
    }

    #[test]
    fn points_on_a_line_have_a_damped_plane_only() {
        let mut line = Covariance3::default();
        assert!(line.height_plane().is_none() && line.undamped_height_plane().is_none());
        for i in 0..5 {
            line.add(DVec3::new(f64::from(i), 0.0, 0.5 * f64::from(i)), 1.0);
        }
        let plane = line.height_plane().unwrap();
        assert!((plane.a - 0.5).abs() < 1e-6 && plane.b == 0.0);
        assert!(line.undamped_height_plane().is_none());
    }

    #[test]
    fn eigenvectors_reproduce_the_matrix() {
        let mut rng = Counter::new(3);
        for _ in 0..200 {
            let m: [f64; 6] = std::array::from_fn(|_| rng.range(-3.0, 3.0));
            let (l, v) = symmetric_eigen_3(m);
            assert!(l[0] <= l[1] && l[1] <= l[2]);
            let full = [[m[0], m[1], m[2]], [m[1], m[3], m[4]], [m[2], m[4], m[5]]];
            for i in 0..3 {
                for j in 0..3 {
                    let sum: f64 = (0..3).map(|k| l[k] * v[k][i] * v[k][j]).sum();
                    assert!((sum - full[i][j]).abs() < 1e-9);
                }
            }
            let (l, v) = symmetric_eigen_2([m[0], m[1], m[2]]);
            let back = v[0] * v[0].x * l[0] + v[1] * v[1].x * l[1];
            assert!((back.x - m[0]).abs() < 1e-9 && (back.y - m[1]).abs() < 1e-9);
        }
    }
}
