//! From a partition with a roof plane for each region to a closed shell: roofs, walls and the underside.
//!
//! Zhu 2018, §5.4 (projection of the face vertices to their plane), with what the paper leaves open: walls between
//! regions, where two planes cross along an edge, and shared vertices, so that the shell is a closed
//! 2-manifold by construction.

use crate::nesting::Nest;
use crate::partition::{Partition, Region};
use gable_city_model::{Attributes, Face, Semantic, Shell};
use gable_geometry::{DVec2, Plane};
use std::collections::BTreeMap;

/// Heights at one vertex that differ by less than this (metres) become one: what the rounding of vertices to the
/// lattice of the arrangement leaves between planes that meet in their line of intersection.
pub(crate) const WELD: f64 = 0.004;

/// How far a vertex may leave the wall that runs past it, metres.
const STRAIGHT: f64 = 4e-3;

/// Extrudes a partition to its planes from a flat underside at `base`. Every roof must stand above the base at
/// all its vertices, and junctions must have been [split](crate::junctions::split).
///
/// The faces are the roofs by region, then the walls, then the underside. The region of each roof face is returned
/// beside the shell.
pub(crate) fn extrude(partition: &Partition, planes: &[Plane], base: f64) -> (Shell, Vec<Region>) {
    let partition = with_crossings(partition, planes);
    let levels = Levels::new(&partition, planes, base);
    let mut shell = Shell { vertices: levels.points(&partition), faces: Vec::new() };
    let mut roofs = Vec::new();
    for (region, faces) in partition.region_faces().into_iter().enumerate() {
        for rings in faces {
            let lift = |ring: &Vec<u32>| ring.iter().map(|&v| levels.roof(v, region)).collect();
            shell.faces.push(face(rings.iter().map(lift).collect(), Semantic::RoofSurface));
            roofs.push(region);
        }
    }
    shell.faces.extend(inner_walls(&partition, &levels));
    let (outer, underside) = outer_walls(&partition, &levels);
    shell.faces.extend(outer);
    shell.faces.extend(underside);
    drop_unused_vertices(&mut shell);
    (shell, roofs)
}

fn face(rings: Vec<Vec<u32>>, semantic: Semantic) -> Face {
    Face { rings, semantic, attributes: Attributes::new() }
}

/// Adds a vertex to each edge along which the planes of its two regions cross.
fn with_crossings(partition: &Partition, planes: &[Plane]) -> Partition {
    let mut out = partition.clone();
    let index = partition.index();
    for (i, e) in partition.edges.iter().enumerate() {
        let Some(&twin) = index.get(&(e.to, e.from)) else { continue };
        if twin < i {
            continue;
        }
        let (p, q) = (planes[e.region], planes[partition.edges[twin].region]);
        let (a, b) = (partition.vertices[e.from as usize], partition.vertices[e.to as usize]);
        let (da, db) = (p.height(a) - q.height(a), p.height(b) - q.height(b));
        if da * db >= 0.0 || da.abs() <= WELD || db.abs() <= WELD {
            continue;
        }
        let v = out.vertices.len() as u32;
        out.vertices.push(a + (b - a) * (da / (da - db)));
        for half in [i, twin] {
            let rest = crate::partition::Edge { from: v, ..out.edges[half] };
            out.edges[half].to = v;
            out.edges[half].next = out.edges.len();
            out.edges.push(rest);
        }
    }
    out
}

/// The distinct heights above each vertex.
struct Levels {
    /// Heights at each vertex, ascending; the first vertex index in the shell.
    at: Vec<(u32, Vec<f64>)>,
    roof: BTreeMap<(u32, Region), u32>,
}

impl Levels {
    fn new(partition: &Partition, planes: &[Plane], base: f64) -> Self {
        let mut wanted: Vec<Vec<(f64, Region)>> = vec![Vec::new(); partition.vertices.len()];
        for e in &partition.edges {
            let z = planes[e.region].height(partition.vertices[e.from as usize]);
            wanted[e.from as usize].push((z, e.region));
        }
        let mut roof = BTreeMap::new();
        let mut first = 0;
        let at = wanted
            .into_iter()
            .enumerate()
            .map(|(v, mut heights)| {
                heights.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let mut levels = vec![base];
                let mut from = f64::NEG_INFINITY;
                let (mut sum, mut count) = (0.0, 0.0);
                for (z, region) in heights {
                    if z - from > WELD {
                        from = z;
                        (sum, count) = (0.0, 0.0);
                        levels.push(z);
                    }
                    sum += z;
                    count += 1.0;
                    if let Some(last) = levels.last_mut() {
                        *last = sum / count;
                    }
                    roof.insert((v as u32, region), first + levels.len() as u32 - 1);
                }
                let out = (first, levels);
                first += out.1.len() as u32;
                out
            })
            .collect();
        Self { at, roof }
    }

    fn points(&self, partition: &Partition) -> Vec<gable_geometry::DVec3> {
        let lift = |(v, (_, levels)): (usize, &(u32, Vec<f64>))| {
            let p = partition.vertices[v];
            levels.iter().map(move |&z| p.extend(z)).collect::<Vec<_>>()
        };
        self.at.iter().enumerate().flat_map(lift).collect()
    }

    /// Shell vertex of a region's roof at a vertex.
    fn roof(&self, v: u32, region: Region) -> u32 {
        self.roof[&(v, region)]
    }

    /// Shell vertex of the underside.
    fn base(&self, v: u32) -> u32 {
        self.at[v as usize].0
    }
}

/// Appends the shell vertices above one vertex from level `a` to level `b`, both ends included.
fn climb(ring: &mut Vec<u32>, a: u32, b: u32) {
    if a <= b {
        ring.extend(a..=b);
    } else {
        ring.extend((b..=a).rev());
    }
}

/// Walls between two regions, each seen from the lower one.
fn inner_walls(partition: &Partition, levels: &Levels) -> Vec<Face> {
    let index = partition.index();
    let mut walls = Vec::new();
    for e in &partition.edges {
        let Some(&twin) = index.get(&(e.to, e.from)) else { continue };
        let right = partition.edges[twin].region;
        let (high_a, high_b) = (levels.roof(e.from, e.region), levels.roof(e.to, e.region));
        let (low_a, low_b) = (levels.roof(e.from, right), levels.roof(e.to, right));
        // Crossings were cut, so that one region is on top along the whole edge: this one, or its twin's turn comes.
        if high_a < low_a || high_b < low_b || (high_a == low_a && high_b == low_b) {
            continue;
        }
        let mut ring = Vec::new();
        climb(&mut ring, high_a, low_a);
        climb(&mut ring, low_b, high_b);
        walls.push(face(vec![ring], Semantic::WallSurface));
    }
    walls
}

/// Walls from the underside to the roofs, and the underside. Edges that run on in a straight line share a wall.
fn outer_walls(partition: &Partition, levels: &Levels) -> (Vec<Face>, Vec<Face>) {
    let index = partition.index();
    let outer: Vec<usize> = (0..partition.edges.len())
        .filter(|&i| !index.contains_key(&(partition.edges[i].to, partition.edges[i].from)))
        .collect();
    let mut walls = Vec::new();
    let mut corners: BTreeMap<u32, u32> = BTreeMap::new();
    for chain in chains(partition, &outer) {
        let (from, to) = (partition.edges[chain[0]].from, partition.edges[chain[chain.len() - 1]].to);
        corners.insert(from, to);
        let mut ring = vec![levels.base(from)];
        let mut level = levels.base(to);
        let mut at = to;
        for &i in chain.iter().rev() {
            let e = &partition.edges[i];
            climb(&mut ring, level, levels.roof(at, e.region));
            if at != to {
                // The step between two roofs starts where the last one ended.
                ring.dedup();
            }
            at = e.from;
            level = levels.roof(at, e.region);
        }
        climb(&mut ring, level, levels.base(from));
        ring.dedup();
        ring.pop();
        walls.push(face(vec![ring], Semantic::WallSurface));
    }
    (walls, undersides(partition, levels, &corners))
}

/// Outer edges in runs that are straight to within [`STRAIGHT`], ring by ring, each ring from its sharpest corner.
fn chains(partition: &Partition, outer: &[usize]) -> Vec<Vec<usize>> {
    // After split junctions one outer edge leaves each vertex.
    let leaving: BTreeMap<u32, usize> = outer.iter().rev().map(|&i| (partition.edges[i].from, i)).collect();
    let point = |v: u32| partition.vertices[v as usize];
    let direction = |i: usize| (point(partition.edges[i].to) - point(partition.edges[i].from)).normalize_or_zero();
    let mut seen = vec![false; partition.edges.len()];
    let mut out = Vec::new();
    for &start in outer {
        let mut ring = Vec::new();
        let mut at = start;
        while !seen[at] {
            seen[at] = true;
            ring.push(at);
            let Some(&next) = leaving.get(&partition.edges[at].to) else { break };
            at = next;
        }
        if ring.is_empty() {
            continue;
        }
        let turn = |i: usize| direction(ring[(i + ring.len() - 1) % ring.len()]).dot(direction(ring[i]));
        let sharpest = (0..ring.len()).min_by(|&i, &j| turn(i).total_cmp(&turn(j))).unwrap_or(0);
        ring.rotate_left(sharpest);
        let mut chain: Vec<usize> = Vec::new();
        for edge in ring {
            if !chain.is_empty() && !is_straight(partition, &chain, edge) {
                out.push(std::mem::take(&mut chain));
            }
            chain.push(edge);
        }
        out.push(chain);
    }
    out
}

/// Whether all vertices inside a run that is lengthened by an edge lie on its chord, and it does not turn back.
fn is_straight(partition: &Partition, chain: &[usize], edge: usize) -> bool {
    let point = |v: u32| partition.vertices[v as usize];
    let (a, b) = (point(partition.edges[chain[0]].from), point(partition.edges[edge].to));
    let Some(along) = (b - a).try_normalize() else { return false };
    let mut reached = 0.0;
    chain.iter().all(|&i| {
        let d: DVec2 = point(partition.edges[i].to) - a;
        let onward = d.dot(along) > reached;
        reached = d.dot(along);
        onward && d.perp_dot(along).abs() < STRAIGHT
    }) && (b - a).dot(along) > reached
}

/// The underside: rings of corners at the base, turned to face down.
fn undersides(partition: &Partition, levels: &Levels, corners: &BTreeMap<u32, u32>) -> Vec<Face> {
    let mut seen: BTreeMap<u32, bool> = corners.keys().map(|&v| (v, false)).collect();
    let mut rings = Vec::new();
    for &start in corners.keys() {
        let mut ring = Vec::new();
        let mut v = start;
        while seen.get(&v) == Some(&false) {
            seen.insert(v, true);
            ring.push(v);
            v = corners[&v];
        }
        if ring.len() > 2 {
            rings.push(ring);
        }
    }
    let points = |ring: &Vec<u32>| partition.points(ring);
    let area = |ring: &Vec<u32>| gable_geometry::ring_area(&points(ring));
    let (outers, holes): (Vec<_>, Vec<_>) = rings.into_iter().partition(|r| area(r) > 0.0);
    let nest = Nest::of(outers.iter().map(points).collect());
    let mut faces: Vec<Vec<Vec<u32>>> = outers.into_iter().map(|o| vec![o]).collect();
    for hole in holes {
        if let Some(i) = nest.smallest_around(partition.vertices[hole[0] as usize]) {
            faces[i].push(hole);
        }
    }
    let down = |ring: Vec<u32>| ring.into_iter().rev().map(|v| levels.base(v)).collect();
    faces.into_iter().map(|f| face(f.into_iter().map(down).collect(), Semantic::GroundSurface)).collect()
}

fn drop_unused_vertices(shell: &mut Shell) {
    let mut number = vec![u32::MAX; shell.vertices.len()];
    for &v in shell.faces.iter().flat_map(|f| f.rings.iter().flatten()) {
        number[v as usize] = 0;
    }
    let mut vertices = Vec::new();
    for (v, n) in number.iter_mut().enumerate() {
        if *n == 0 {
            *n = vertices.len() as u32;
            vertices.push(shell.vertices[v]);
        }
    }
    for v in shell.faces.iter_mut().flat_map(|f| f.rings.iter_mut().flatten()) {
        *v = number[*v as usize];
    }
    shell.vertices = vertices;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::tests::pair;
    use gable_geometry::dvec2;

    /// Each edge is used once in each direction.
    fn assert_closed(shell: &Shell) {
        let mut edges = BTreeMap::new();
        for f in &shell.faces {
            for ring in &f.rings {
                for i in 0..ring.len() {
                    let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
                    assert_ne!(a, b);
                    *edges.entry((a, b)).or_insert(0) += 1;
                }
            }
        }
        for (&(a, b), &n) in &edges {
            assert_eq!((n, edges.get(&(b, a))), (1, Some(&1)), "edge {a}-{b} of {:?}", shell.vertices);
        }
    }

    fn count(shell: &Shell, semantic: Semantic) -> usize {
        shell.faces.iter().filter(|f| f.semantic == semantic).count()
    }

    #[test]
    fn a_gable_house_has_seven_faces() {
        // The ridge runs along x = 4.
        let planes = [Plane { a: 0.5, b: 0.0, c: 3.0 }, Plane { a: -0.5, b: 0.0, c: 7.0 }];
        let (shell, roofs) = extrude(&pair(), &planes, 0.0);
        assert_closed(&shell);
        assert_eq!(roofs, [0, 1]);
        assert_eq!((count(&shell, Semantic::RoofSurface), count(&shell, Semantic::WallSurface)), (2, 4));
        assert_eq!(count(&shell, Semantic::GroundSurface), 1);
        assert_eq!(shell.vertices.len(), 10);
    }

    #[test]
    fn steps_and_crossings_close() {
        let flat = [Plane::horizontal(5.0), Plane::horizontal(3.0)];
        let (shell, _) = extrude(&pair(), &flat, 0.0);
        assert_closed(&shell);
        assert_eq!((shell.faces.len(), shell.vertices.len()), (8, 12));
        // The planes cross in the middle of the common edge.
        let cross = [Plane { a: 0.0, b: 0.5, c: 4.0 }, Plane { a: 0.0, b: -0.5, c: 6.0 }];
        let (shell, _) = extrude(&pair(), &cross, 0.0);
        assert_closed(&shell);
        // Two roofs, two triangles between them, four outer walls, the underside.
        assert_eq!(shell.faces.len(), 9);
    }

    #[test]
    fn a_courtyard_gives_the_underside_a_hole() {
        let vertices = [(0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0), (3.0, 3.0), (6.0, 3.0), (6.0, 6.0), (3.0, 6.0)];
        let vertices = vertices.map(|(x, y)| dvec2(x, y)).to_vec();
        let p = Partition::from_rings(vertices, &[(0, vec![0, 1, 2, 3]), (0, vec![7, 6, 5, 4])]);
        let (shell, _) = extrude(&p, &[Plane { a: 0.1, b: 0.0, c: 4.0 }], 0.0);
        assert_closed(&shell);
        assert_eq!(shell.faces.len(), 10);
        assert!(shell.faces.iter().filter(|f| f.rings.len() == 2).count() == 2);
    }

    #[test]
    fn three_roofs_at_one_corner_share_its_levels() {
        // Region 2 lies north of both others and is lower than one and higher than the other.
        let vertices = [(0.0, 0.0), (4.0, 0.0), (8.0, 0.0), (8.0, 4.0), (4.0, 4.0), (0.0, 4.0), (8.0, 8.0), (0.0, 8.0)];
        let vertices = vertices.map(|(x, y)| dvec2(x, y)).to_vec();
        let rings = [(0, vec![0, 1, 4, 5]), (1, vec![1, 2, 3, 4]), (2, vec![5, 4, 3, 6, 7])];
        let p = Partition::from_rings(vertices, &rings);
        let (shell, _) = extrude(&p, &[3.0, 7.0, 5.0].map(Plane::horizontal), 0.0);
        assert_closed(&shell);
    }
}
