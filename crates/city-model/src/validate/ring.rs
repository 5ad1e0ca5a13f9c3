//! Rings: 101, 102, 104, 105.

use super::Code;
use super::segments::{Meeting, candidate_pairs, meeting};
use super::snap::Snapped;
use crate::projection::AxisProjection;
use crate::shell::ring_vector_area;
use gable_geometry::{DVec3, Orientation, orientation};

/// The first defect of a ring of snapped corners.
pub(super) fn check(points: &[DVec3], ring: &[u32], snap: f64) -> Option<(Code, String)> {
    let at = |k: usize| points[ring[k % ring.len()] as usize];
    let mut distinct = ring.to_vec();
    distinct.sort_unstable();
    distinct.dedup();
    if distinct.len() < 3 {
        return Some((Code::TooFewPoints, format!("a ring has {} different corners", distinct.len())));
    }
    if let Some(k) = (0..ring.len()).find(|&k| ring[k] == ring[(k + 1) % ring.len()]) {
        return Some((Code::ConsecutivePointsSame, format!("the corner {} is repeated", Snapped::place(at(k)))));
    }
    // A tenth of the snap tolerance: narrower than that, neither the normal nor the order of the edges means anything.
    let width = width(points, ring);
    if width < 0.1 * snap {
        let message = format!("the ring at {} is {width:.1e} m wide", Snapped::place(at(0)));
        return Some((Code::RingCollapsed, message));
    }
    if distinct.len() < ring.len() {
        let (k, _) = ring.iter().enumerate().find(|(k, i)| ring[..*k].contains(i))?;
        return Some((Code::RingSelfIntersection, format!("the ring touches itself at {}", Snapped::place(at(k)))));
    }
    // A bow tie may have no area: any plane in which it has extent shows the crossing then.
    let normal = ring_vector_area(points, ring);
    let normal = if normal.length() > 1e-12 { normal } else { any_normal(points, ring) };
    let projection = AxisProjection::along(normal)?;
    let n = ring.len();
    let flat: Vec<_> = ring.iter().map(|&i| projection.project(points[i as usize])).collect();
    let edges: Vec<_> = (0..n).map(|k| (flat[k], flat[(k + 1) % n])).collect();
    candidate_pairs(&edges, |i, j| {
        let ((a, b), (c, d)) = (edges[i], edges[j]);
        let bad = if j == i + 1 || (i == 0 && j == n - 1) {
            // Neighbours share a corner; they may not fold back on each other.
            let (before, corner, after) = if j == i + 1 { (a, b, d) } else { (c, d, b) };
            orientation(before, corner, after) == Orientation::On && (corner - before).dot(after - corner) < 0.0
        } else {
            meeting(a, b, c, d) != Meeting::Apart
        };
        bad.then(|| {
            let places = (Snapped::place(at(i)), Snapped::place(at(j)));
            (Code::RingSelfIntersection, format!("the edges from {} and {} meet", places.0, places.1))
        })
    })
}

/// Largest distance of a corner from the line through the first corner and the one farthest from it.
fn width(points: &[DVec3], ring: &[u32]) -> f64 {
    let first = points[ring[0] as usize];
    let offsets = || ring.iter().map(|&i| points[i as usize] - first);
    let far = offsets().fold(DVec3::ZERO, |far, d| if d.length_squared() > far.length_squared() { d } else { far });
    let length = far.length();
    offsets().map(|d| d.cross(far).length() / length).fold(0.0, f64::max)
}

/// Normal of the largest triangle that the first corner and the one farthest from it make with another.
fn any_normal(points: &[DVec3], ring: &[u32]) -> DVec3 {
    let first = points[ring[0] as usize];
    let offsets = || ring.iter().map(|&i| points[i as usize] - first);
    let longer = |best: DVec3, d: DVec3| if d.length_squared() > best.length_squared() { d } else { best };
    let far = offsets().fold(DVec3::ZERO, longer);
    offsets().map(|d| d.cross(far)).fold(DVec3::ZERO, longer)
}
