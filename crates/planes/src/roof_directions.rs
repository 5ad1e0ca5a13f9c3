//! Prominent normals of a roof.

use crate::RoofPlane;
use crate::facade_directions::difference;
use gable_geometry::{Counter, DVec2, DVec3, dvec3};

/// A direction that roof planes share, together with its z-symmetric mate (−x, −y, z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoofDirection {
    /// Unit normal, pointing up.
    pub normal: DVec3,
    /// Part of the normals (or of the planes' area) that follows it or its mate.
    pub share: f64,
}

impl RoofDirection {
    /// The z-symmetric counterpart.
    #[must_use]
    pub fn mate(&self) -> DVec3 {
        mate(self.normal)
    }
}

fn mate(n: DVec3) -> DVec3 {
    dvec3(-n.x, -n.y, n.z)
}

/// Moves a normal into the nearest of the vertical planes through z and a facade normal (both axes of each frame);
/// `None` if the projection vanishes.
fn snap(normal: DVec3, facade_angles: &[f64]) -> Option<DVec3> {
    let axes = facade_angles.iter().flat_map(|&a| [DVec2::from_angle(a), DVec2::from_angle(a).perp()]);
    let projected = axes.map(|f| dvec3(f.x, f.y, 0.0) * f.dot(normal.truncate()) + dvec3(0.0, 0.0, normal.z));
    projected.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?.try_normalize()
}

/// RANSAC over the normals of a roof, snapped to the roof direction planes: Zhu 2018, §5.3, Eq. 8.
///
/// Each hypothesis is one of the normals, moved into the nearest plane through z and a facade normal; its inliers
/// are the normals within `angle` degrees (ang_thre) of it or of its mate. The best one is kept, its inliers
/// leave, and the search repeats while one has at least `min_share` of all normals. Without facade angles
/// nothing is snapped. `iterations` hypotheses are drawn for each direction.
#[must_use]
pub fn ransac(
    normals: &[DVec3],
    facade_angles: &[f64],
    angle: f64,
    min_share: f64,
    iterations: usize,
    seed: u64,
) -> Vec<RoofDirection> {
    let mut rng = Counter::new(seed);
    let cos_angle = angle.to_radians().cos();
    let mut rest: Vec<DVec3> = normals.to_vec();
    let mut out = Vec::new();
    while !rest.is_empty() {
        let mut best = (0, DVec3::Z);
        for _ in 0..iterations {
            let drawn = rest[rng.index(rest.len())];
            let hypothesis = if facade_angles.is_empty() { Some(drawn) } else { snap(drawn, facade_angles) };
            let Some(h) = hypothesis else { continue };
            let inliers = rest.iter().filter(|n| n.dot(h).max(n.dot(mate(h))) > cos_angle).count();
            if inliers > best.0 {
                best = (inliers, h);
            }
        }
        let share = best.0 as f64 / normals.len() as f64;
        if best.0 == 0 || share < min_share {
            break;
        }
        rest.retain(|n| n.dot(best.1).max(n.dot(mate(best.1))) <= cos_angle);
        out.push(RoofDirection { normal: best.1, share });
    }
    out
}

/// Directions from detected planes: area-weighted modes, snapped softly.
///
/// Planes join, the largest first, the direction that they or their mates come within `angle` degrees of, and the
/// mean moves along; afterwards a direction within `level` degrees of the vertical becomes vertical, and one
/// whose azimuth is within `turn` degrees of a facade angle (modulo 90°) is turned to it. Others stay: turrets
/// and skew hips keep their own. Differs from Eq. 8 by weighing areas, which one slope in many small
/// pieces of mesh cannot distort.
#[must_use]
pub fn cluster(planes: &[RoofPlane], facade_angles: &[f64], angle: f64, level: f64, turn: f64) -> Vec<RoofDirection> {
    let total: f64 = planes.iter().map(|p| p.area).sum();
    let mut order: Vec<usize> = (0..planes.len()).collect();
    order.sort_by(|&i, &j| planes[j].area.total_cmp(&planes[i].area).then(i.cmp(&j)));
    let cos_angle = angle.to_radians().cos();
    let mut sums: Vec<(DVec3, f64)> = Vec::new();
    for i in order {
        let (n, area) = (planes[i].plane.normal(), planes[i].area);
        let aligned = |sum: DVec3| if sum.dot(n) >= sum.dot(mate(n)) { n } else { mate(n) };
        let score = |s: &(DVec3, f64)| s.0.normalize_or_zero().dot(aligned(s.0));
        match sums.iter_mut().max_by(|a, b| score(a).total_cmp(&score(b))).filter(|s| score(s) > cos_angle) {
            Some(s) => {
                s.0 += aligned(s.0) * area;
                s.1 += area;
            }
            None => sums.push((n * area, area)),
        }
    }
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    sums.into_iter()
        .map(|(sum, area)| {
            let mut normal = sum.normalize_or(DVec3::Z);
            let horizontal = normal.truncate();
            if horizontal.length() < level.to_radians().sin() {
                normal = DVec3::Z;
            } else {
                let azimuth = horizontal.to_angle();
                let off =
                    facade_angles.iter().map(|&f| difference(azimuth, f)).min_by(|a, b| a.abs().total_cmp(&b.abs()));
                if let Some(off) = off.filter(|o| o.abs() <= turn.to_radians()) {
                    normal = DVec2::from_angle(azimuth - off).extend(0.0) * horizontal.length() + DVec3::Z * normal.z;
                }
            }
            RoofDirection { normal, share: area / total }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Plane;

    fn noisy(base: DVec3, count: usize, rng: &mut Counter) -> Vec<DVec3> {
        let mut jitter = || 0.04 * rng.normal();
        (0..count).map(|_| (base + dvec3(jitter(), jitter(), jitter())).normalize()).collect()
    }

    fn tilted(azimuth: f64, slope: f64) -> DVec3 {
        DVec2::from_angle(azimuth.to_radians()).extend(0.0) * slope.to_radians().sin()
            + DVec3::Z * slope.to_radians().cos()
    }

    #[test]
    fn a_gable_with_a_flat_annexe_has_two_directions() {
        let mut rng = Counter::new(2);
        let mut normals = noisy(tilted(33.0, 40.0), 500, &mut rng);
        normals.extend(noisy(tilted(213.0, 40.0), 450, &mut rng));
        normals.extend(noisy(DVec3::Z, 300, &mut rng));
        let found = ransac(&normals, &[30f64.to_radians()], 12.0, 0.1, 100, 5);
        assert_eq!(found.len(), 2, "{found:?}");
        let n = found[0].normal;
        // Snapped exactly into the plane of the facade normal at 30°.
        assert!(DVec2::from_angle(30f64.to_radians()).perp_dot(n.truncate()).abs() < 1e-12);
        assert!((n.z.acos().to_degrees() - 40.0).abs() < 5.0 && found[0].share > 0.7);
        assert!(found[1].normal.z > 0.99);
    }

    #[test]
    fn planes_cluster_by_area() {
        let plane = |azimuth: f64, slope: f64, area: f64| RoofPlane {
            plane: Plane::from_normal(tilted(azimuth, slope), DVec3::ZERO).unwrap(),
            inliers: area as usize * 25,
            area,
            rms: 0.1,
            centroid: DVec3::ZERO,
        };
        let planes =
            [plane(31.0, 40.0, 60.0), plane(209.0, 41.0, 40.0), plane(80.0, 2.0, 20.0), plane(64.0, 30.0, 10.0)];
        let found = cluster(&planes, &[30f64.to_radians()], 8.0, 3.0, 8.0);
        assert_eq!(found.len(), 3);
        assert!((found[0].normal.truncate().to_angle().to_degrees() - 30.0).abs() < 1e-9);
        assert!((found[0].share - 100.0 / 130.0).abs() < 1e-12);
        assert_eq!(found[1].normal, DVec3::Z);
        assert!((found[2].normal - tilted(64.0, 30.0)).length() < 1e-9, "skew: stays");
    }
}
