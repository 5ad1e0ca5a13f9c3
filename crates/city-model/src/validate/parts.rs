//! Parts of a building: 601.

use super::snap::Snapped;
use super::solid::{contains, signed_volume};
use super::triangles::{segment_meets_triangle, sweep};
use super::{Code, Issue, Tolerances, shell};
use crate::Shell;
use gable_geometry::DVec3;

/// Checks that the solids of a building do not overlap (601). Walls that lie on each other, touching corners and
/// overlaps shallower than the planarity tolerance are allowed. Solids that are not valid themselves are passed over.
///
/// Two solids overlap if the middle of a face's triangle of one, moved inward by the tolerance, is inside the other,
/// or if an edge of one, shortened by the tolerance at both ends, crosses a triangle of the other away from its plane.
/// (val3dity intersects Nef polyhedra.) O(t₁·t₂) for each pair whose boxes overlap.
#[must_use]
pub fn validate_parts(solids: &[Shell], tolerances: &Tolerances) -> Vec<Issue> {
    let depth = tolerances.planarity;
    let meshes: Vec<_> = solids
        .iter()
        .map(|solid| {
            let snapped = Snapped::new(solid, tolerances.snap).ok()?;
            let triangles = shell::check(&snapped, tolerances).ok()?;
            (signed_volume(&snapped.points, &triangles) > 0.0).then_some((snapped.points, triangles))
        })
        .collect();
    let mut issues = Vec::new();
    for j in 0..meshes.len() {
        for i in 0..j {
            let (Some(a), Some(b)) = (&meshes[i], &meshes[j]) else { continue };
            if overlap(a, b, depth) {
                let message = format!("solids {i} and {j} overlap by more than {depth} m");
                issues.push(Issue::new(Code::PartsOverlap, None, message));
            }
        }
    }
    issues
}

type Mesh = (Vec<DVec3>, Vec<(usize, [u32; 3])>);

fn overlap(a: &Mesh, b: &Mesh, depth: f64) -> bool {
    let bounds = |mesh: &Mesh| {
        mesh.0.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
    };
    let ((a_low, a_high), (b_low, b_high)) = (bounds(a), bounds(b));
    if (a_high.min(b_high) - a_low.max(b_low)).min_element() <= depth {
        return false;
    }
    inner_points(a, depth).any(|p| contains(b, p))
        || inner_points(b, depth).any(|p| contains(a, p))
        || edge_crosses(a, b, depth)
        || edge_crosses(b, a, depth)
}

/// Points just inside a mesh, under the middles of its triangles.
fn inner_points(mesh: &Mesh, depth: f64) -> impl Iterator<Item = DVec3> + '_ {
    mesh.1.iter().filter_map(move |(_, t)| {
        let [a, b, c] = t.map(|i| mesh.0[i as usize]);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let inside = (a + b + c) / 3.0 - normal * depth;
        contains(mesh, inside).then_some(inside)
    })
}

fn edge_crosses(a: &Mesh, b: &Mesh, depth: f64) -> bool {
    let hit = sweep(&a.0, &a.1, &b.0, &b.1, |i, j| {
        let corners = a.1[i].1.map(|k| a.0[k as usize]);
        let t = b.1[j].1.map(|k| b.0[k as usize]);
        let Some(normal) = (t[1] - t[0]).cross(t[2] - t[0]).try_normalize() else { return false };
        // The triangle shrunk towards its middle by the depth, so that contacts at its border do not count.
        let middle = (t[0] + t[1] + t[2]) / 3.0;
        let inner = t.map(|p| p + (middle - p).clamp_length_max(2.0 * depth));
        (0..3).any(|k| {
            let (p, q) = (corners[k], corners[(k + 1) % 3]);
            let (hp, hq) = ((p - t[0]).dot(normal), (q - t[0]).dot(normal));
            hp * hq < 0.0 && hp.abs() > depth && hq.abs() > depth && segment_meets_triangle(p, q, inner)
        })
    });
    hit.is_some()
}
