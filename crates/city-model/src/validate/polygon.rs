//! Polygons whose rings are valid: 201–208.

use super::segments::{Meeting, candidate_pairs, meeting};
use super::snap::Snapped;
use super::{Code, Tolerances};
use crate::projection::AxisProjection;
use crate::shell::ring_vector_area;
use crate::triangulate::triangulate_rings;
use gable_geometry::{Covariance3, DVec2, DVec3, DisjointSets, ring_area, ring_contains};

type Defect = (Code, String);

/// The polygon's triangles, or its first defect. Distances to the plane are judged before the rings are compared in
/// it, as a projection of a polygon that is not planar means little.
pub(super) fn check(points: &[DVec3], rings: &[Vec<u32>], tolerances: &Tolerances) -> Result<Vec<[u32; 3]>, Defect> {
    let Some(outer) = rings.first() else { return Err((Code::TooFewPoints, "a face has no ring".to_owned())) };
    if let Some(defect) = duplicated(points, rings) {
        return Err(defect);
    }
    distance_to_plane(points, rings, tolerances.planarity)?;
    // The outer ring's own normal: a hole that runs the wrong way must not turn the polygon.
    let normal = ring_vector_area(points, outer);
    let Some(projection) = AxisProjection::along(normal) else {
        return Err((Code::RingCollapsed, "the outer ring has no area".to_owned()));
    };
    if rings.len() > 1 {
        let flat = |ring: &Vec<u32>| ring.iter().map(|&i| projection.project(points[i as usize])).collect();
        let flat: Vec<Vec<DVec2>> = rings.iter().map(flat).collect();
        let touches = touches(points, rings, &flat)?;
        nesting(points, rings, &flat)?;
        connected(rings.len(), &touches)?;
        for (r, ring) in flat.iter().enumerate().skip(1) {
            if ring_area(ring) > 0.0 {
                let place = Snapped::place(points[rings[r][0] as usize]);
                let message = format!("the hole at {place} runs the same way as the outer ring");
                return Err((Code::OrientationRingsSame, message));
            }
        }
    }
    let triangles = triangulate_rings(points, rings)
        .ok_or_else(|| (Code::IntersectionRings, "the rings could not be triangulated".to_owned()))?;
    normals(points, normal.normalize(), &triangles, tolerances)?;
    Ok(triangles)
}

/// 202: two rings with the same corners.
fn duplicated(points: &[DVec3], rings: &[Vec<u32>]) -> Option<Defect> {
    if rings.len() < 2 {
        return None;
    }
    let mut sets: Vec<_> = rings.to_vec();
    sets.iter_mut().for_each(|set| set.sort_unstable());
    sets.sort_unstable();
    let pair = sets.windows(2).find(|pair| pair[0] == pair[1])?;
    let place = Snapped::place(points[pair[0][0] as usize]);
    Some((Code::DuplicatedRings, format!("two rings have the same corners, one at {place}")))
}

/// 203: distance of the corners from their least-squares plane.
fn distance_to_plane(points: &[DVec3], rings: &[Vec<u32>], tolerance: f64) -> Result<(), Defect> {
    if let [ring] = rings
        && ring.len() == 3
    {
        return Ok(());
    }
    let corners = || rings.iter().flatten().map(|&i| points[i as usize]);
    let mut covariance = Covariance3::default();
    corners().for_each(|p| covariance.add(p, 1.0));
    let (_, [normal, ..]) = covariance.eigen();
    let centroid = covariance.centroid();
    let (worst, place) = corners()
        .map(|p| ((p - centroid).dot(normal).abs(), p))
        .fold((0.0, centroid), |best, next| if next.0 > best.0 { next } else { best });
    if worst <= tolerance {
        return Ok(());
    }
    let message = format!("the corner {} is {worst:.4} m from the plane", Snapped::place(place));
    Err((Code::NonPlanarDistance, message))
}

/// 201, or the points where rings touch: (ring, ring, place).
fn touches(points: &[DVec3], rings: &[Vec<u32>], flat: &[Vec<DVec2>]) -> Result<Vec<(usize, usize, DVec2)>, Defect> {
    let mut owner = Vec::new();
    let mut edges = Vec::new();
    for (r, ring) in flat.iter().enumerate() {
        for k in 0..ring.len() {
            owner.push((r, k));
            edges.push((ring[k], ring[(k + 1) % ring.len()]));
        }
    }
    let mut touches = Vec::new();
    let defect = candidate_pairs(&edges, |i, j| {
        let (r, s) = (owner[i].0, owner[j].0);
        if r == s {
            return None;
        }
        match meeting(edges[i].0, edges[i].1, edges[j].0, edges[j].1) {
            Meeting::Apart => None,
            Meeting::Touch(p) => {
                touches.push((r.min(s), r.max(s), p));
                None
            }
            Meeting::Cross | Meeting::Overlap => {
                let place = Snapped::place(points[rings[r][owner[i].1] as usize]);
                Some((Code::IntersectionRings, format!("two rings meet along the edge from {place}")))
            }
        }
    });
    match defect {
        Some(defect) => Err(defect),
        None => {
            // The inner ring may pass through the outer one at a touched corner: corners on both sides show it.
            touches.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(order(a.2, b.2)));
            touches.dedup();
            Ok(touches)
        }
    }
}

fn order(a: DVec2, b: DVec2) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}

/// Where the parts of a ring lie with respect to another one that it does not cross along an edge: for each corner and
/// edge middle off the other's boundary, inside or not.
fn sides(ring: &[DVec2], other: &[DVec2]) -> (bool, bool) {
    let on = |p: DVec2| {
        (0..other.len())
            .any(|k| gable_geometry::point_segment_distance(p, other[k], other[(k + 1) % other.len()]) < 1e-9)
    };
    let (mut inside, mut outside) = (false, false);
    for k in 0..ring.len() {
        for p in [ring[k], 0.5 * (ring[k] + ring[(k + 1) % ring.len()])] {
            if !on(p) {
                let within = ring_contains(other, p);
                inside |= within;
                outside |= !within;
            }
        }
    }
    (inside, outside)
}

/// 206 and 207; a ring that is on both sides of another crosses it in a corner: 201.
fn nesting(points: &[DVec3], rings: &[Vec<u32>], flat: &[Vec<DVec2>]) -> Result<(), Defect> {
    let place = |r: usize| Snapped::place(points[rings[r][0] as usize]);
    for r in 1..flat.len() {
        let (inside, outside) = sides(&flat[r], &flat[0]);
        if inside && outside {
            return Err((Code::IntersectionRings, format!("the hole at {} crosses the outer ring", place(r))));
        }
        if outside {
            return Err((Code::InnerRingOutside, format!("the hole at {} is outside the outer ring", place(r))));
        }
    }
    for r in 1..flat.len() {
        for s in (1..flat.len()).filter(|&s| s != r) {
            let (inside, outside) = sides(&flat[r], &flat[s]);
            if inside && outside {
                return Err((Code::IntersectionRings, format!("the holes at {} and {} cross", place(r), place(s))));
            }
            if inside {
                return Err((
                    Code::InnerRingsNested,
                    format!("the hole at {} is in the one at {}", place(r), place(s)),
                ));
            }
        }
    }
    Ok(())
}

/// 205: the interior falls apart exactly if the graph of rings and the points in which they touch has a cycle.
fn connected(rings: usize, touches: &[(usize, usize, DVec2)]) -> Result<(), Defect> {
    let mut places: Vec<DVec2> = touches.iter().map(|t| t.2).collect();
    places.sort_by(|a, b| order(*a, *b));
    places.dedup();
    let mut links: Vec<(usize, usize)> = Vec::new();
    for &(r, s, p) in touches {
        let node = rings + places.partition_point(|q| order(*q, p).is_lt());
        links.extend([(r, node), (s, node)]);
    }
    links.sort_unstable();
    links.dedup();
    let mut sets = DisjointSets::new(rings + places.len());
    for (ring, node) in links {
        if !sets.join(ring, node) {
            let p = places[node - rings];
            let message = format!("rings that touch at ({:.4}, {:.4}) in the plane cut the interior", p.x, p.y);
            return Err((Code::InteriorDisconnected, message));
        }
    }
    Ok(())
}

/// 204: the triangles must lie in the polygon's plane. Triangles lower than the snap tolerance are passed over, their
/// normals being those of the rounding.
fn normals(points: &[DVec3], normal: DVec3, triangles: &[[u32; 3]], tolerances: &Tolerances) -> Result<(), Defect> {
    if triangles.len() < 2 {
        return Ok(());
    }
    let limit = tolerances.normals_deg.to_radians().cos();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| points[i as usize]);
        let cross = (b - a).cross(c - a);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let twice = cross.length();
        if twice <= tolerances.snap * longest {
            continue;
        }
        let cosine = cross.dot(normal) / twice;
        if cosine < limit {
            let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
            let message = format!("the triangle at {} is tilted by {angle:.1}°", Snapped::place(a));
            return Err((Code::NonPlanarNormals, message));
        }
    }
    Ok(())
}
