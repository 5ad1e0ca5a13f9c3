//! Triangulation of faces with holes: constrained Delaunay in the plane of the face.

use crate::projection::AxisProjection;
use crate::{Face, Shell};
use gable_geometry::{DVec2, DVec3, Orientation, orientation};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::collections::{BTreeMap, BTreeSet};

/// A triangle of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaceTriangle {
    /// Vertex indices, counter-clockwise seen from outside.
    pub corners: [u32; 3],
    /// Index of the face in the shell.
    pub face: u32,
}

/// Triangles of all faces, in the order of the faces. No vertex is added: neighbouring faces that share an edge still
/// share it, so the triangles of a closed shell are closed.
///
/// Convex quadrilaterals are cut along a diagonal; anything larger is triangulated by constrained Delaunay (crate
/// `spade`) on the coordinates without the normal's dominant one, which decides exactly. A face whose rings cross
/// (never a valid one) falls back to fans of its rings: their triangles overlap, but their signed sum is the face, so
/// areas by projection and volumes stay right. Faces without extent give nothing.
///
/// O(n log n) per face. Indices must be in range ([`Shell::is_well_formed`]).
#[must_use]
pub fn triangulate(shell: &Shell) -> Vec<FaceTriangle> {
    let mut out = Vec::with_capacity(shell.faces.len() * 3);
    for (f, face) in shell.faces.iter().enumerate() {
        let triangles = triangulate_face(&shell.vertices, face);
        out.extend(triangles.into_iter().map(|corners| FaceTriangle { corners, face: f as u32 }));
    }
    out
}

/// Triangles of one face, counter-clockwise about its outward normal; see [`triangulate`].
#[must_use]
pub fn triangulate_face(points: &[DVec3], face: &Face) -> Vec<[u32; 3]> {
    triangulate_rings(points, &face.rings).unwrap_or_else(|| fans(&face.rings))
}

/// As [`triangulate_face`]; `None` if the rings cross, so that only the fallback could cover them.
pub(crate) fn triangulate_rings(points: &[DVec3], rings: &[Vec<u32>]) -> Option<Vec<[u32; 3]>> {
    if let [ring] = rings
        && ring.len() == 3
    {
        return Some(vec![[ring[0], ring[1], ring[2]]]);
    }
    let normal = rings.iter().map(|ring| crate::shell::ring_vector_area(points, ring)).sum();
    let Some(projection) = AxisProjection::along(normal) else { return Some(Vec::new()) };
    let flat = |i: u32| projection.project(points[i as usize]);
    if let [ring] = rings
        && let &[a, b, c, d] = ring.as_slice()
    {
        let left = |p: u32, q: u32, r: u32| orientation(flat(p), flat(q), flat(r)) == Orientation::Left;
        if left(a, b, c) && left(a, c, d) {
            return Some(vec![[a, b, c], [a, c, d]]);
        }
        if left(b, c, d) && left(b, d, a) {
            return Some(vec![[b, c, d], [b, d, a]]);
        }
    }
    delaunay(rings, flat)
}

#[derive(Clone, Copy)]
struct Corner {
    position: Point2<f64>,
    index: u32,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Constrained Delaunay of the rings, of which the triangles are kept that an odd number of ring edges separates from
/// the outside.
fn delaunay(rings: &[Vec<u32>], flat: impl Fn(u32) -> DVec2) -> Option<Vec<[u32; 3]>> {
    let mut local: BTreeMap<u32, usize> = BTreeMap::new();
    let mut corners = Vec::new();
    // An edge that the rings use twice, as a bridge from the outer ring to a hole, separates nothing.
    let mut edges: BTreeSet<[usize; 2]> = BTreeSet::new();
    for ring in rings {
        let mut place = |i: u32| {
            *local.entry(i).or_insert_with(|| {
                let p = flat(i);
                let position = spade::mitigate_underflow(Point2::new(p.x, p.y));
                corners.push(Corner { position, index: i });
                corners.len() - 1
            })
        };
        for k in 0..ring.len() {
            let (a, b) = (place(ring[k]), place(ring[(k + 1) % ring.len()]));
            let edge = [a.min(b), a.max(b)];
            if a != b && !edges.insert(edge) {
                edges.remove(&edge);
            }
        }
    }
    let count = corners.len();
    let mut crossed = false;
    let cdt = ConstrainedDelaunayTriangulation::<_>::try_bulk_load_cdt(corners, edges.into_iter().collect(), |_| {
        crossed = true
    })
    .ok()?;
    if crossed || cdt.num_vertices() != count {
        return None;
    }
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face();
    inside[outer.index()] = Some(false);
    let mut queue = Vec::new();
    for edge in cdt.convex_hull() {
        let face = edge.rev().face();
        if inside[face.index()].is_none() {
            inside[face.index()] = Some(edge.is_constraint_edge());
            queue.push(face.fix());
        }
    }
    while let Some(face) = queue.pop() {
        let here = inside[face.index()] == Some(true);
        let Some(face) = cdt.face(face).as_inner() else { continue };
        for edge in face.adjacent_edges() {
            let next = edge.rev().face();
            if inside[next.index()].is_none() {
                inside[next.index()] = Some(here ^ edge.is_constraint_edge());
                queue.push(next.fix());
            }
        }
    }
    let kept = cdt.inner_faces().filter(|face| inside[face.index()] == Some(true));
    Some(kept.map(|face| face.vertices().map(|v| v.data().index)).collect())
}

/// Fans of all rings about their first corners.
fn fans(rings: &[Vec<u32>]) -> Vec<[u32; 3]> {
    let mut out = Vec::new();
    for ring in rings {
        if let Some((&first, rest)) = ring.split_first() {
            out.extend(rest.windows(2).map(|pair| [first, pair[0], pair[1]]));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Semantic;
    use crate::shell::samples::{face, gabled, prism};
    use gable_geometry::dvec3;
    use proptest::prelude::*;

    fn vector_area(points: &[DVec3], triangles: &[[u32; 3]]) -> DVec3 {
        let at = |i: u32| points[i as usize];
        triangles.iter().map(|&[a, b, c]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a))).sum()
    }

    fn total_area(points: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
        let at = |i: u32| points[i as usize];
        triangles.iter().map(|&[a, b, c]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).length()).sum()
    }

    #[test]
    fn keeps_area_and_volume_of_solids() {
        let outer = [(0., 0.), (9., 0.), (9., 4.), (5., 4.), (5., 7.), (0., 7.)];
        let hole = [(1., 1.), (1., 2.), (2., 2.), (2., 1.)];
        let touching = [(5., 4.), (4., 3.), (3., 4.), (4., 5.)];
        for shell in [prism(&[&outer, &hole], 0.0, 3.0), gabled(dvec3(5.0, 6.0, 7.0))] {
            let triangles = triangulate(&shell);
            let corners: Vec<_> = triangles.iter().map(|t| t.corners).collect();
            assert!((total_area(&shell.vertices, &corners) - shell.area()).abs() < 1e-9);
            let volume: f64 = triangles
                .iter()
                .map(|t| t.corners.map(|i| shell.vertices[i as usize]))
                .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
                .sum();
            assert!((volume - shell.volume()).abs() < 1e-9);
        }
        // A hole that touches the outer ring in a corner, the corner being one vertex.
        let points: Vec<_> = outer.iter().chain(&touching[1..]).map(|&(x, y)| dvec3(x, y, 1.0)).collect();
        let touched = face(&[&[0, 1, 2, 3, 4, 5], &[3, 6, 7, 8]], Semantic::RoofSurface);
        let area = total_area(&points, &triangulate_face(&points, &touched));
        assert!((area - (36.0 + 15.0 - 2.0)).abs() < 1e-12);
    }

    #[test]
    fn a_bridge_to_a_hole_separates_nothing() {
        // A square whose hole is written as a keyhole: there and back along one edge, as some programs do.
        let points: Vec<_> = [(0., 0.), (9., 0.), (9., 9.), (0., 9.), (3., 3.), (3., 6.), (6., 6.), (6., 3.)]
            .map(|(x, y)| dvec3(x, y, 2.))
            .to_vec();
        let keyhole = face(&[&[0, 1, 2, 3, 0, 4, 5, 6, 7, 4]], Semantic::RoofSurface);
        let triangles = triangulate_face(&points, &keyhole);
        assert!((total_area(&points, &triangles) - (81.0 - 9.0)).abs() < 1e-12);
        assert_eq!(vector_area(&points, &triangles), dvec3(0.0, 0.0, 72.0));
    }

    #[test]
    fn crossing_rings_fall_back_to_fans_with_the_right_sum() {
        let points: Vec<_> = [(0., 0.), (4., 0.), (4., 4.), (0., 4.), (3., 1.), (3., 3.), (6., 3.), (6., 1.)]
            .map(|(x, y)| dvec3(x, y, 0.))
            .to_vec();
        let crossing = face(&[&[0, 1, 2, 3], &[4, 5, 6, 7]], Semantic::RoofSurface);
        assert!(triangulate_rings(&points, &crossing.rings).is_none());
        let sum = vector_area(&points, &triangulate_face(&points, &crossing));
        assert_eq!(sum, dvec3(0.0, 0.0, 10.0));
    }

    proptest! {
        /// Star-shaped rings in any plane: n - 2 triangles, none reversed, of the ring's area.
        #[test]
        fn star_polygons(radii in prop::collection::vec(0.5..9.0f64, 3..24), tilt in -3.0..3.0f64, turn in 0..3usize) {
            let n = radii.len();
            let points: Vec<_> = radii.iter().enumerate().map(|(i, r)| {
                let (s, c) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
                let p = dvec3(r * c, r * s, tilt * r * c - 0.4 * r * s);
                [p, dvec3(p.y, p.z, p.x), dvec3(p.z, p.x, p.y)][turn]
            }).collect();
            let ring: Vec<u32> = (0..n as u32).collect();
            let triangles = triangulate_face(&points, &face(&[&ring], Semantic::RoofSurface));
            prop_assert_eq!(triangles.len(), n - 2);
            let area = vector_area(&points, &triangles);
            let expected = crate::shell::ring_vector_area(&points, &ring);
            prop_assert!((area - expected).length() < 1e-9);
            prop_assert!((total_area(&points, &triangles) - expected.length()).abs() < 1e-6);
        }
    }
}
