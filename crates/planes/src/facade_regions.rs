//! Deterministic region growing over steep facets: walls without random seeds.

use crate::facade_segments::Region;
use crate::soup::{Mesh, Triangle};
use gable_geometry::DVec3;

/// Parameters of [`grow`].
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Facets count as walls if their normal is within this angle of the horizontal, degrees.
    pub steepness: f64,
    /// Largest angle between the normals of a facet and of the growing wall, degrees.
    pub angle: f64,
    /// Largest distance of a facet's centroid to the growing wall, metres.
    pub distance: f64,
    /// Smallest wall, m².
    pub min_area: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { steepness: 30.0, angle: 25.0, distance: 0.3, min_area: 2.0 }
    }
}

/// Walls of a triangle soup: regions of neighbouring steep facets near a common vertical plane, grown from the
/// largest facets on. The plane is vertical by construction, its horizontal normal and offset are the area-weighted
/// means of the facets so far. Bumpy photogrammetry walls come out whole where normals alone would break
/// them up. O(n log n).
#[must_use]
pub fn grow(triangles: &[Triangle], params: &Params) -> Vec<Region> {
    let mesh = Mesh::weld(triangles);
    let steepest = params.steepness.to_radians().sin();
    let is_steep = |t: usize| mesh.areas[t] > 0.0 && mesh.normals[t].z.abs() <= steepest;
    let mut order: Vec<u32> = (0..mesh.len() as u32).filter(|&t| is_steep(t as usize)).collect();
    order.sort_by(|&s, &t| mesh.areas[t as usize].total_cmp(&mesh.areas[s as usize]).then(s.cmp(&t)));
    let cos_angle = params.angle.to_radians().cos();
    let mut taken = vec![false; mesh.len()];
    let mut regions = Vec::new();
    for seed in order {
        if taken[seed as usize] {
            continue;
        }
        let mut members = vec![seed];
        taken[seed as usize] = true;
        let (mut sum, mut weighted, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        let mut next = 0;
        while next < members.len() {
            let t = members[next] as usize;
            next += 1;
            sum += mesh.normals[t] * mesh.areas[t];
            weighted += mesh.centroids[t] * mesh.areas[t];
            area += mesh.areas[t];
            let Some(normal) = sum.truncate().try_normalize() else { continue };
            let offset = normal.dot(weighted.truncate()) / area;
            for &n in mesh.neighbours(t) {
                let u = n as usize;
                let close = (normal.dot(mesh.centroids[u].truncate()) - offset).abs() <= params.distance;
                let parallel = mesh.normals[u].truncate().normalize_or_zero().dot(normal) >= cos_angle;
                if !taken[u] && is_steep(u) && close && parallel {
                    taken[u] = true;
                    members.push(n);
                }
            }
        }
        if area >= params.min_area {
            members.sort_unstable();
            regions.push(Region::of(&mesh, members));
        } else {
            // Small leftovers may still join a later wall, but must not be seeds again.
            for &t in &members[1..] {
                taken[t as usize] = false;
            }
        }
    }
    regions
}

#[cfg(test)]
mod tests {
    use crate::facade_segments::facade_segments;
    use crate::soup::Triangle;
    use crate::vsa;
    use gable_geometry::{Counter, DVec2, DVec3, dvec2, dvec3};

    /// The walls and the flat roof of a 10 × 6 × 5 m box, turned by 20°, in cells of 1 m, with bumps of 3 cm.
    fn house() -> Vec<Triangle> {
        let c = [dvec2(0.0, 0.0), dvec2(10.0, 0.0), dvec2(10.0, 6.0), dvec2(0.0, 6.0)];
        let place = |p: DVec2, z: f64| {
            let q = DVec2::from_angle(0.35).rotate(p);
            let mut rng = Counter::keyed(3, &[(p.x * 64.0) as i64, (p.y * 64.0) as i64, (z * 64.0) as i64]);
            dvec3(q.x, q.y, z) + 0.03 * DVec3::new(rng.normal(), rng.normal(), rng.normal())
        };
        let mut out = Vec::new();
        let mut quad = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| out.extend([[a, b, c], [a, c, d]]);
        for k in 0..4 {
            let (a, b) = (c[k], c[(k + 1) % 4]);
            let n = a.distance(b) as usize;
            for i in 0..n {
                let (p, q) = (a.lerp(b, i as f64 / n as f64), a.lerp(b, (i + 1) as f64 / n as f64));
                for z in 0..5 {
                    let (z, y) = (f64::from(z), f64::from(z + 1));
                    quad(place(p, z), place(q, z), place(q, y), place(p, y));
                }
            }
        }
        for i in 0..10 {
            for j in 0..6 {
                let at = |x: i32, y: i32| place(dvec2(f64::from(x), f64::from(y)), 5.0);
                quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            }
        }
        out
    }

    fn lengths(segments: &[(DVec2, DVec2, f64)]) -> Vec<f64> {
        let mut out: Vec<f64> = segments.iter().map(|s| s.0.distance(s.1)).collect();
        out.sort_by(f64::total_cmp);
        out
    }

    #[test]
    fn a_box_has_four_walls_with_the_house_to_their_left() {
        let soup = house();
        let regions = super::grow(&soup, &super::Params::default());
        let segments = facade_segments(&soup, &regions, 15.0);
        assert_eq!(segments.len(), 4);
        for (found, truth) in lengths(&segments).iter().zip([6.0, 6.0, 10.0, 10.0]) {
            assert!((found - truth).abs() < 0.3, "{found}");
        }
        let middle = DVec2::from_angle(0.35).rotate(dvec2(5.0, 3.0));
        for (a, b, area) in segments {
            assert!((b - a).perp_dot(middle - a) > 0.0);
            assert!((area / (5.0 * a.distance(b)) - 1.0).abs() < 0.1);
        }
        assert!(super::grow(&[], &super::Params::default()).is_empty());
    }

    #[test]
    fn variational_proxies_cover_the_box_and_repeat_themselves() {
        let soup = house();
        let regions = vsa::approximate(&soup, &vsa::Params::default());
        assert!(regions.len() >= 22 && regions.iter().map(|r| r.triangles.len()).sum::<usize>() == soup.len());
        let area: f64 = regions.iter().map(|r| r.area).sum();
        let segments = facade_segments(&soup, &regions, 15.0);
        let walls: f64 = segments.iter().map(|s| s.2).sum();
        assert!(area > 220.0 && walls > 0.6 * 160.0 && walls < 1.1 * 160.0, "{area} {walls}");
        assert_eq!(regions, vsa::approximate(&soup, &vsa::Params::default()));
    }
}
