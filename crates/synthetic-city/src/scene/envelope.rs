//! The upper envelope of roof primitives as an exact planar subdivision.
//!
//! 1. Each primitive is cut into cells, one for each of its planes (convex, creases between them).
//! 2. For two cells that overlap, the line of equal height, clipped to the overlap, is where the
//!    upper roof changes: the valley of an L, the foot of a cross gable.
//! 3. Cell borders and those lines are cut at their common points and traced into faces.
//! 4. A point inside each face says which plane is uppermost; where no plan covers it, it is outside.
//!
//! Quadratic in the number of segments (some dozens for a house).

use super::primitive::{Primitive, clip, highest, intersect_convex};
use gable_geometry::{DVec2, Plane, point_segment_distance, ring_area, ring_contains};
use std::collections::{BTreeMap, BTreeSet};

/// Places closer than this are one node, metres.
const SNAP: f64 = 1e-6;

/// A face of the subdivision under one roof plane.
#[derive(Clone, Debug)]
pub(crate) struct EnvelopeFace {
    /// Rings of nodes: outer counter-clockwise, holes clockwise.
    pub(crate) rings: Vec<Vec<usize>>,
    /// Which of [`Envelope::planes`] is the roof.
    pub(crate) plane: usize,
}

/// The plan of a building cut where its uppermost roof plane changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Envelope {
    pub(crate) nodes: Vec<DVec2>,
    pub(crate) planes: Vec<Plane>,
    /// Faces that a plan covers.
    pub(crate) faces: Vec<EnvelopeFace>,
}

/// Computes the upper envelope.
pub(crate) fn upper_envelope(primitives: &[Primitive]) -> Envelope {
    let segments = segments(primitives);
    let (nodes, edges) = cut(&segments);
    let rings = trace(&nodes, &edges);
    let mut planes: Vec<Plane> = Vec::new();
    let mut faces = Vec::new();
    for rings in nest(&nodes, rings) {
        let Some(inside) = interior_point(&nodes, &rings) else { continue };
        let Some((_, i, j)) = highest(primitives, inside) else { continue };
        let own = primitives[i].planes[j];
        let same = |p: &Plane| (p.a - own.a).abs() < 1e-9 && (p.b - own.b).abs() < 1e-9 && (p.c - own.c).abs() < 1e-7;
        let plane = planes.iter().position(same).unwrap_or_else(|| {
            planes.push(own);
            planes.len() - 1
        });
        faces.push(EnvelopeFace { rings, plane });
    }
    Envelope { nodes, planes, faces }
}

fn segments(primitives: &[Primitive]) -> Vec<(DVec2, DVec2)> {
    let mut cells: Vec<(usize, Plane, Vec<DVec2>)> = Vec::new();
    for (i, primitive) in primitives.iter().enumerate() {
        for j in 0..primitive.planes.len() {
            let ring = primitive.cell(j);
            if ring.len() >= 3 && ring_area(&ring) > 1e-6 {
                cells.push((i, primitive.planes[j], ring));
            }
        }
    }
    let mut segments = Vec::new();
    for (n, (i, plane, ring)) in cells.iter().enumerate() {
        for k in 0..ring.len() {
            segments.push((ring[k], ring[(k + 1) % ring.len()]));
        }
        for (_, other, other_ring) in cells[n + 1..].iter().filter(|c| c.0 != *i) {
            let overlap = intersect_convex(ring, other_ring);
            if overlap.len() < 3 || ring_area(&overlap) < 1e-9 {
                continue;
            }
            let above = clip(&overlap, |p| plane.height(p) - other.height(p));
            let below = clip(&overlap, |p| other.height(p) - plane.height(p));
            if ring_area(&above) < 1e-9 || ring_area(&below) < 1e-9 {
                continue;
            }
            // The cut is the edge of the upper part along which both planes have the same height.
            for k in 0..above.len() {
                let (a, b) = (above[k], above[(k + 1) % above.len()]);
                let level = |p: DVec2| (plane.height(p) - other.height(p)).abs() < 1e-9;
                if level(a) && level(b) {
                    segments.push((a, b));
                }
            }
        }
    }
    segments.retain(|(a, b)| a.distance(*b) > SNAP);
    segments
}

/// Nodes and undirected edges after cutting all segments at their common points.
fn cut(segments: &[(DVec2, DVec2)]) -> (Vec<DVec2>, BTreeSet<(usize, usize)>) {
    let mut nodes: Vec<DVec2> = Vec::new();
    let mut add = |p: DVec2| {
        if !nodes.iter().any(|n| n.distance(p) < SNAP) {
            nodes.push(p);
        }
    };
    for &(a, b) in segments {
        add(a);
        add(b);
    }
    for (i, &(a, b)) in segments.iter().enumerate() {
        for &(c, d) in &segments[i + 1..] {
            let (r, s) = (b - a, d - c);
            let cross = r.perp_dot(s);
            if cross.abs() < 1e-9 * r.length() * s.length() {
                continue;
            }
            let t = (c - a).perp_dot(s) / cross;
            let u = (c - a).perp_dot(r) / cross;
            let (et, eu) = (SNAP / r.length(), SNAP / s.length());
            if t > -et && t < 1.0 + et && u > -eu && u < 1.0 + eu {
                add(a + r * t);
            }
        }
    }
    let mut edges = BTreeSet::new();
    for &(a, b) in segments {
        let direction = b - a;
        let mut on: Vec<(f64, usize)> = (0..nodes.len())
            .filter(|&n| point_segment_distance(nodes[n], a, b) < SNAP)
            .map(|n| ((nodes[n] - a).dot(direction), n))
            .collect();
        on.sort_by(|x, y| x.0.total_cmp(&y.0));
        for pair in on.windows(2) {
            let (u, v) = (pair[0].1, pair[1].1);
            edges.insert((u.min(v), u.max(v)));
        }
    }
    prune(&mut edges, nodes.len());
    (nodes, edges)
}

/// Takes away edges that end in nothing.
fn prune(edges: &mut BTreeSet<(usize, usize)>, nodes: usize) {
    loop {
        let mut degree = vec![0_usize; nodes];
        for &(u, v) in edges.iter() {
            degree[u] += 1;
            degree[v] += 1;
        }
        let before = edges.len();
        edges.retain(|&(u, v)| degree[u] > 1 && degree[v] > 1);
        if edges.len() == before {
            return;
        }
    }
}

/// All rings of the planar graph, each with its face on the left.
fn trace(nodes: &[DVec2], edges: &BTreeSet<(usize, usize)>) -> Vec<Vec<usize>> {
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    for &(u, v) in edges {
        around[u].push(v);
        around[v].push(u);
    }
    for (u, list) in around.iter_mut().enumerate() {
        let angle = |v: usize| (nodes[v] - nodes[u]).to_angle();
        list.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
    }
    let mut used: BTreeSet<(usize, usize)> = BTreeSet::new();
    let mut rings = Vec::new();
    for (u, list) in around.iter().enumerate() {
        for &v in list {
            if used.contains(&(u, v)) {
                continue;
            }
            let mut ring = Vec::new();
            let (mut a, mut b) = (u, v);
            while used.insert((a, b)) {
                ring.push(a);
                let turn = &around[b];
                let from = turn.iter().position(|&n| n == a).unwrap_or(0);
                let next = turn[(from + turn.len() - 1) % turn.len()];
                (a, b) = (b, next);
            }
            rings.push(ring);
        }
    }
    rings
}

/// Puts each clockwise ring (the outside of a component) as a hole into the smallest ring around it.
fn nest(nodes: &[DVec2], rings: Vec<Vec<usize>>) -> Vec<Vec<Vec<usize>>> {
    let place = |ring: &[usize]| ring.iter().map(|&n| nodes[n]).collect::<Vec<_>>();
    let (outer, inner): (Vec<_>, Vec<_>) = rings.into_iter().partition(|r| ring_area(&place(r)) > 0.0);
    let outlines: Vec<Vec<DVec2>> = outer.iter().map(|r| place(r)).collect();
    let mut faces: Vec<Vec<Vec<usize>>> = outer.into_iter().map(|r| vec![r]).collect();
    for hole in inner {
        let own: BTreeSet<usize> = hole.iter().copied().collect();
        let at = nodes[hole[0]];
        let around = (0..outlines.len())
            .filter(|&i| !faces[i][0].iter().any(|n| own.contains(n)) && ring_contains(&outlines[i], at))
            .min_by(|&i, &j| ring_area(&outlines[i]).total_cmp(&ring_area(&outlines[j])));
        if let Some(i) = around {
            faces[i].push(hole);
        }
    }
    faces
}

/// A place well inside a face.
fn interior_point(nodes: &[DVec2], rings: &[Vec<usize>]) -> Option<DVec2> {
    let mut sides: BTreeMap<u64, (DVec2, DVec2)> = BTreeMap::new();
    for ring in rings {
        for i in 0..ring.len() {
            let (a, b) = (nodes[ring[i]], nodes[ring[(i + 1) % ring.len()]]);
            sides.entry(a.distance(b).to_bits()).or_insert((a, b));
        }
    }
    let places: Vec<Vec<DVec2>> = rings.iter().map(|r| r.iter().map(|&n| nodes[n]).collect()).collect();
    for (a, b) in sides.values().rev() {
        for depth in [0.05, 5e-3, 5e-4, 5e-5, 5e-6] {
            let p = a.midpoint(*b) + (b - a).normalize().perp() * depth;
            let inside = places.iter().filter(|r| ring_contains(r, p)).count() % 2 == 1;
            let clear = places
                .iter()
                .all(|r| (0..r.len()).all(|i| point_segment_distance(p, r[i], r[(i + 1) % r.len()]) > 0.5 * depth));
            if inside && clear {
                return Some(p);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::primitive::Oblong;
    use crate::scene::solid::{is_manifold, shell_volume, solid};
    use gable_geometry::dvec2;
    use proptest::prelude::*;

    fn wing() -> impl Strategy<Value = Primitive> {
        let numbers = (-8.0..8.0, -8.0..8.0, 0.0..3.1, 2.0..9.0, 2.0..5.0, 3.0..7.0, 0.3..1.2, 0..3);
        numbers.prop_map(|(x, y, turn, half_length, half_width, eave, slope, kind)| {
            let plan = Oblong { centre: dvec2(x, y), axis: DVec2::from_angle(turn), half_length, half_width };
            match kind {
                0 => Primitive::gable(&plan, eave, slope),
                1 => Primitive::hip(&plan, eave, slope, eave, slope),
                _ => Primitive::flat(plan.ring(), eave),
            }
        })
    }

    /// Three planes meet at each end of a hip's ridge. A corner that is there twice has a side of no length, along which an
    /// overlapping flat roof was once cut in two.
    #[test]
    fn cells_of_a_hip_have_no_corner_twice() {
        for turn in 0..2000 {
            let axis = DVec2::from_angle(0.001 * f64::from(turn));
            let plan = Oblong { centre: dvec2(6.5, -7.3), axis, half_length: 4.8, half_width: 2.6 };
            let hip = Primitive::hip(&plan, 4.0, 1.07, 4.0, 1.07);
            let corners: Vec<usize> = (0..4).map(|k| hip.cell(k).len()).collect();
            assert_eq!(corners, [4, 3, 4, 3], "at turn {turn}");
        }
    }

    proptest! {
        /// The subdivision against the highest primitive at points of a grid.
        #[test]
        fn faces_carry_the_highest_plane(wings in prop::collection::vec(wing(), 1..4)) {
            let envelope = upper_envelope(&wings);
            let rings = |f: &EnvelopeFace| -> Vec<Vec<DVec2>> {
                f.rings.iter().map(|r| r.iter().map(|&n| envelope.nodes[n]).collect()).collect()
            };
            let faces: Vec<(Vec<Vec<DVec2>>, Plane)> =
                envelope.faces.iter().map(|f| (rings(f), envelope.planes[f.plane])).collect();
            for i in -20..=20 {
                for j in -20..=20 {
                    let p = dvec2(f64::from(i) * 0.93 + 0.013, f64::from(j) * 0.93 - 0.017);
                    let inside = |rings: &Vec<Vec<DVec2>>| rings.iter().filter(|r| ring_contains(r, p)).count() % 2 == 1;
                    let found: Vec<f64> =
                        faces.iter().filter(|(r, _)| inside(r)).map(|(_, plane)| plane.height(p)).collect();
                    match highest(&wings, p) {
                        None => prop_assert!(found.is_empty()),
                        Some((z, ..)) => {
                            prop_assert_eq!(found.len(), 1);
                            prop_assert!((found[0] - z).abs() < 1e-5);
                        }
                    }
                }
            }
            // Its solid, where there is one, holds the volume under the envelope, but for corners whose heights differ by
            // less than 0.1 mm and are one vertex.
            if let Some(shell) = solid(&envelope, 0.0) {
                prop_assert!(is_manifold(&shell));
                let (mut area, mut under) = (0.0, 0.0);
                for (r, plane) in faces.iter().flat_map(|(rings, plane)| rings.iter().map(move |r| (r, plane))) {
                    // Exact over fans of triangles: area times the height at the centroid.
                    for k in 1..r.len() - 1 {
                        let t = [r[0], r[k], r[k + 1]];
                        area += ring_area(&t);
                        under += ring_area(&t) * plane.height((t[0] + t[1] + t[2]) / 3.0);
                    }
                }
                let volume = shell_volume(&shell);
                prop_assert!((volume - under).abs() < 1e-4 * area, "{volume} m³ instead of {under} over {area} m²");
            }
        }
    }
}
