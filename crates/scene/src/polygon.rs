//! Polygons into triangles: a fan where they are convex, else ear clipping in the plane of their area vector.

use crate::budget;
use earcut::Earcut;
use gable_geometry::DVec3;

/// Cuts polygons. Keeps its memory from one to the next.
#[derive(Default)]
pub(crate) struct Cutter {
    earcut: Earcut<f64>,
    plan: Vec<[f64; 2]>,
    triangles: Vec<u32>,
}

impl Cutter {
    /// The corners of the triangles of a polygon, three by three; `None` if it has too many corners that turn in.
    ///
    /// A polygon whose border runs along a slit to a hole and back (a keyhole) keeps its hole. One without area becomes a fan of
    /// triangles without area.
    pub(crate) fn cut(&mut self, corners: &[DVec3]) -> Option<&[u32]> {
        self.triangles.clear();
        let normal = area_vector(corners);
        if corners.len() < 4 || normal == DVec3::ZERO || is_convex(corners, normal) {
            self.triangles.extend((2..corners.len() as u32).flat_map(|i| [0, i - 1, i]));
            return Some(&self.triangles);
        }
        if corners.len() > budget::CONCAVE_CORNERS {
            return None;
        }
        let (right, up) = axes(normal);
        let first = corners[0];
        self.plan.clear();
        self.plan.extend(corners.iter().map(|c| [(*c - first).dot(right), (*c - first).dot(up)]));
        self.earcut.earcut(self.plan.iter().copied(), &[], &mut self.triangles);
        // The library turns them as it likes: they run as the border does.
        for three in self.triangles.chunks_exact_mut(3) {
            let [a, b, c] = [three[0], three[1], three[2]].map(|i| corners[i as usize]);
            if (b - a).cross(c - a).dot(normal) < 0.0 {
                three.swap(1, 2);
            }
        }
        Some(&self.triangles)
    }
}

/// Twice the area vector (Newell).
fn area_vector(corners: &[DVec3]) -> DVec3 {
    let first = corners[0];
    let pairs = corners.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first));
    pairs.fold(DVec3::ZERO, |sum, v| sum + v)
}

/// Whether the border turns to the left at every corner, and once around only.
fn is_convex(corners: &[DVec3], normal: DVec3) -> bool {
    let n = corners.len();
    let edge = |i: usize| corners[(i + 1) % n] - corners[i % n];
    let unit = normal.normalize_or_zero();
    let mut turned = 0.0;
    for i in 0..n {
        let (before, after) = (edge(i), edge(i + 1));
        let sine = before.cross(after).dot(unit);
        // Corners on a straight edge turn by what rounding leaves of nothing.
        if sine < -1e-9 * before.length() * after.length() {
            return false;
        }
        turned += sine.atan2(before.dot(after));
    }
    turned < 1.5 * std::f64::consts::TAU
}

/// Two directions across a normal, the first turned to the second as the normal says.
fn axes(normal: DVec3) -> (DVec3, DVec3) {
    let unit = normal.normalize();
    let away = if unit.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
    let right = away.cross(unit).normalize();
    (right, unit.cross(right))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    /// The area of the triangles, and of their area vectors' sum.
    fn areas(corners: &[DVec3]) -> (f64, f64) {
        let mut cutter = Cutter::default();
        let triangles = cutter.cut(corners).unwrap();
        let mut sums = (0.0, DVec3::ZERO);
        for three in triangles.chunks_exact(3) {
            let [a, b, c] = [three[0], three[1], three[2]].map(|i| corners[i as usize]);
            let vector = (b - a).cross(c - a) * 0.5;
            sums = (sums.0 + vector.length(), sums.1 + vector);
        }
        (sums.0, sums.1.length())
    }

    fn flat(corners: &[(f64, f64)]) -> Vec<DVec3> {
        corners.iter().map(|&(x, y)| dvec3(x, y, 10.0)).collect()
    }

    const L: [(f64, f64); 6] = [(40.0, 40.0), (60.0, 40.0), (60.0, 50.0), (50.0, 50.0), (50.0, 60.0), (40.0, 60.0)];

    /// All beginnings of a border, both ways around, and the same stood upright and far from zero.
    fn every_way(corners: &[(f64, f64)], area: f64) {
        for start in 0..corners.len() {
            let mut turned = corners.to_vec();
            turned.rotate_left(start);
            for mirrored in [false, true] {
                if mirrored {
                    turned.reverse();
                }
                let level = flat(&turned);
                let upright: Vec<DVec3> =
                    level.iter().map(|p| dvec3(691_000.0 + p.x, 5_334_000.0 + p.z, p.y)).collect();
                let tilted: Vec<DVec3> = level.iter().map(|p| dvec3(p.x * 0.6 - p.z, p.y, p.x * 0.8)).collect();
                for (way, shape) in [("level", &level), ("upright", &upright), ("tilted", &tilted)] {
                    let (sum, vector) = areas(shape);
                    assert!(
                        (sum - area).abs() < 1e-6 * area && (vector - area).abs() < 1e-6 * area,
                        "{way} {start}: {sum} {vector}"
                    );
                }
            }
        }
    }

    #[test]
    fn concave_polygons_keep_their_area() {
        every_way(&L, 300.0);
        // A quad that turns in, a cross, a comb.
        every_way(&[(0.0, 0.0), (10.0, 0.0), (3.0, 3.0), (0.0, 10.0)], 30.0);
        let cross = [
            (1., 0.),
            (2., 0.),
            (2., 1.),
            (3., 1.),
            (3., 2.),
            (2., 2.),
            (2., 3.),
            (1., 3.),
            (1., 2.),
            (0., 2.),
            (0., 1.),
            (1., 1.),
        ];
        every_way(&cross, 5.0);
        let mut comb = vec![(0.0, 0.0), (40.0, 0.0)];
        (0..20).rev().for_each(|i| comb.extend([(2.0 * f64::from(i) + 1.0, 5.0), (2.0 * f64::from(i), 1.0)]));
        // Twenty teeth on a strip: trapezes from the tips down to where they part.
        let shoelace = |ring: &[(f64, f64)]| {
            let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
            pairs.map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>().abs() / 2.0
        };
        every_way(&comb, shoelace(&comb));
    }

    #[test]
    fn keyholes_keep_their_holes() {
        // A square with a square hole, the slit from corner to corner.
        let keyhole =
            [(0., 0.), (10., 0.), (10., 10.), (0., 10.), (0., 0.), (3., 3.), (3., 7.), (7., 7.), (7., 3.), (3., 3.)];
        every_way(&keyhole, 84.0);
        // Two holes in a row.
        let two = [
            (0., 0.),
            (20., 0.),
            (20., 10.),
            (0., 10.),
            (0., 0.),
            (3., 3.),
            (3., 7.),
            (7., 7.),
            (13., 7.),
            (17., 7.),
            (17., 3.),
            (13., 3.),
            (13., 7.),
            (7., 7.),
            (7., 3.),
            (3., 3.),
        ];
        every_way(&two, 200.0 - 32.0);
    }

    #[test]
    fn convex_and_flat_ones_stay_fans() {
        let square = flat(&[(0., 0.), (5., 0.), (10., 0.), (10., 10.), (0., 10.)]);
        assert_eq!(Cutter::default().cut(&square).unwrap(), [0, 1, 2, 0, 2, 3, 0, 3, 4]);
        assert_eq!(Cutter::default().cut(&square[..3]).unwrap(), [0, 1, 2]);
        let line = flat(&[(0., 0.), (5., 0.), (10., 0.), (7., 0.)]);
        assert_eq!(Cutter::default().cut(&line).unwrap().len(), 6);
        // A pentagram turns to the left everywhere, twice around.
        let star: Vec<(f64, f64)> = (0..5).map(|i| (f64::from(i) * 0.8 * std::f64::consts::PI).sin_cos()).collect();
        assert!(!is_convex(&flat(&star), area_vector(&flat(&star))));
    }

    #[test]
    fn too_many_corners_are_refused() {
        let spiky = |n: usize| -> Vec<DVec3> {
            let at = |i: usize| {
                let (sin, cos) = (i as f64 / n as f64 * std::f64::consts::TAU).sin_cos();
                let r = if i.is_multiple_of(2) { 10.0 } else { 5.0 };
                dvec3(r * cos, r * sin, 0.0)
            };
            (0..n).map(at).collect()
        };
        assert!(Cutter::default().cut(&spiky(budget::CONCAVE_CORNERS + 2)).is_none());
        let (sum, vector) = areas(&spiky(2000));
        assert!((sum - vector).abs() < 1e-6 * sum);
    }
}
