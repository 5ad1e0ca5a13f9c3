//! A labelled planar partition: the footprint cut into regions, each with one roof plane.

use crate::nesting::Nest;
use gable_geometry::{DVec2, Polygon, ring_area};
use std::collections::BTreeMap;

/// Index of a region; regions are numbered from 0 without gaps.
pub(crate) type Region = usize;

/// A directed boundary edge with its region to the left. What lies to the right is the region of the
/// edge in the other direction, or the ground where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// Vertex where the edge starts.
    pub(crate) from: u32,
    /// Vertex where it ends.
    pub(crate) to: u32,
    /// Region to the left.
    pub(crate) region: Region,
    /// The following edge of the same ring.
    pub(crate) next: usize,
}

/// Regions that do not overlap, bounded by shared vertices and edges.
///
/// Invariants: an edge and its twin run between the same two vertices; the edges of a ring keep the region to
/// their left (outer rings counter-clockwise, holes clockwise); each directed edge occurs once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Partition {
    pub(crate) vertices: Vec<DVec2>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) regions: usize,
}

impl Partition {
    /// A partition from rings of vertices, each with its region.
    #[cfg(test)]
    pub(crate) fn from_rings(vertices: Vec<DVec2>, rings: &[(Region, Vec<u32>)]) -> Self {
        let mut out = Self { vertices, edges: Vec::new(), regions: 0 };
        for (region, ring) in rings {
            out.regions = out.regions.max(region + 1);
            out.push_ring(*region, ring);
        }
        out
    }

    #[cfg(test)]
    fn push_ring(&mut self, region: Region, ring: &[u32]) {
        let first = self.edges.len();
        for i in 0..ring.len() {
            let next = first + (i + 1) % ring.len();
            self.edges.push(Edge { from: ring[i], to: ring[(i + 1) % ring.len()], region, next });
        }
    }

    /// Edge index by (from, to).
    pub(crate) fn index(&self) -> BTreeMap<(u32, u32), usize> {
        self.edges.iter().enumerate().map(|(i, e)| ((e.from, e.to), i)).collect()
    }

    /// The rings, each as (region, edge indices), in the order of their first edge.
    pub(crate) fn rings(&self) -> Vec<(Region, Vec<usize>)> {
        let mut seen = vec![false; self.edges.len()];
        let mut rings = Vec::new();
        for start in 0..self.edges.len() {
            if seen[start] {
                continue;
            }
            let mut ring = Vec::new();
            let mut e = start;
            while !seen[e] {
                seen[e] = true;
                ring.push(e);
                e = self.edges[e].next;
            }
            rings.push((self.edges[start].region, ring));
        }
        rings
    }

    /// The vertices of a ring of edges.
    pub(crate) fn ring_vertices(&self, ring: &[usize]) -> Vec<u32> {
        ring.iter().map(|&e| self.edges[e].from).collect()
    }

    /// Coordinates of a ring of vertices.
    pub(crate) fn points(&self, ring: &[u32]) -> Vec<DVec2> {
        ring.iter().map(|&v| self.vertices[v as usize]).collect()
    }

    /// Area of each region, m².
    pub(crate) fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.regions];
        for (region, ring) in self.rings() {
            areas[region] += ring_area(&self.points(&self.ring_vertices(&ring)));
        }
        areas
    }

    /// The same partition with regions joined: region `r` becomes `group[r]`, `None` becomes ground.
    /// Edges between regions of one group vanish; groups keep their numbers.
    pub(crate) fn joined(&self, group: &[Option<Region>]) -> Self {
        let index = self.index();
        let right = |e: &Edge| index.get(&(e.to, e.from)).and_then(|&t| group[self.edges[t].region]);
        let keeps = |i: usize| {
            let e = &self.edges[i];
            group[e.region].is_some() && right(e) != group[e.region]
        };
        let mut number = vec![usize::MAX; self.edges.len()];
        let mut kept = Vec::new();
        for i in 0..self.edges.len() {
            if keeps(i) {
                number[i] = kept.len();
                kept.push(i);
            }
        }
        let edges = kept
            .iter()
            .map(|&i| {
                let e = self.edges[i];
                let mut next = e.next;
                while !keeps(next) {
                    let n = &self.edges[next];
                    // An edge that vanishes has its own group on the other side: go round its end.
                    next = self.edges[index[&(n.to, n.from)]].next;
                }
                Edge { region: group[e.region].unwrap_or(0), next: number[next], ..e }
            })
            .collect();
        let regions = group.iter().flatten().max().map_or(0, |m| m + 1);
        let mut out = Self { vertices: self.vertices.clone(), edges, regions };
        out.drop_unused_vertices();
        out
    }

    /// Removes vertices where two regions meet along a straight line: those with one neighbour on either side
    /// (and at most the twins) that lie within `tolerance` metres of the line between them.
    pub(crate) fn straightened(&self, tolerance: f64) -> Self {
        let mut out = self.clone();
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); out.vertices.len()];
        for e in &out.edges {
            for (a, b) in [(e.from, e.to), (e.to, e.from)] {
                if !neighbours[a as usize].contains(&b) {
                    neighbours[a as usize].push(b);
                }
            }
        }
        let mut index = out.index();
        let mut gone = vec![false; out.edges.len()];
        for v in 0..out.vertices.len() as u32 {
            let [a, b] = neighbours[v as usize][..] else { continue };
            let (p, q, m) = (out.vertices[a as usize], out.vertices[b as usize], out.vertices[v as usize]);
            let along = q - p;
            let distance = (m - p).perp_dot(along).abs() / along.length().max(1e-12);
            let between = (m - p).dot(along) > 0.0 && (q - m).dot(along) > 0.0;
            let taken = index.contains_key(&(a, b)) || index.contains_key(&(b, a));
            if distance > tolerance || !between || taken {
                continue;
            }
            for (x, y) in [(a, b), (b, a)] {
                if let (Some(&first), Some(&second)) = (index.get(&(x, v)), index.get(&(v, y))) {
                    out.edges[first].to = y;
                    out.edges[first].next = out.edges[second].next;
                    gone[second] = true;
                    index.remove(&(x, v));
                    index.remove(&(v, y));
                    index.insert((x, y), first);
                }
            }
            for (x, y) in [(a, b), (b, a)] {
                for n in &mut neighbours[x as usize] {
                    if *n == v {
                        *n = y;
                    }
                }
            }
            neighbours[v as usize].clear();
        }
        let mut number = vec![usize::MAX; out.edges.len()];
        let mut count = 0;
        for (i, gone) in gone.iter().enumerate() {
            if !gone {
                number[i] = count;
                count += 1;
            }
        }
        out.edges = (0..out.edges.len())
            .filter(|&i| !gone[i])
            .map(|i| Edge { next: number[out.edges[i].next], ..out.edges[i] })
            .collect();
        out.drop_unused_vertices();
        out
    }

    /// Rings as sequences of vertices in which none repeats: a ring that touches itself is cut at the vertex.
    pub(crate) fn simple_rings(&self) -> Vec<(Region, Vec<u32>)> {
        let mut out = Vec::new();
        // Where each vertex stands in the stack.
        let mut place = vec![usize::MAX; self.vertices.len()];
        for (region, ring) in self.rings() {
            let mut stack: Vec<u32> = Vec::new();
            for v in self.ring_vertices(&ring) {
                if place[v as usize] != usize::MAX {
                    let loop_ = stack.split_off(place[v as usize]);
                    loop_.iter().for_each(|&u| place[u as usize] = usize::MAX);
                    if loop_.len() > 2 {
                        out.push((region, loop_));
                    }
                }
                place[v as usize] = stack.len();
                stack.push(v);
            }
            stack.iter().for_each(|&u| place[u as usize] = usize::MAX);
            if stack.len() > 2 {
                out.push((region, stack));
            }
        }
        out
    }

    /// The polygons of each region, holes with the outer ring that contains them, as rings of vertices
    /// (outer one first).
    pub(crate) fn region_faces(&self) -> Vec<Vec<Vec<Vec<u32>>>> {
        let mut faces: Vec<Vec<Vec<Vec<u32>>>> = vec![Vec::new(); self.regions];
        let mut holes: Vec<Vec<Vec<u32>>> = vec![Vec::new(); self.regions];
        for (region, ring) in self.simple_rings() {
            if ring_area(&self.points(&ring)) > 0.0 {
                faces[region].push(vec![ring]);
            } else {
                holes[region].push(ring);
            }
        }
        for (faces, holes) in faces.iter_mut().zip(holes) {
            if holes.is_empty() {
                continue;
            }
            let outer = Nest::of(faces.iter().map(|face| self.points(&face[0])).collect());
            for ring in holes {
                // A hole may touch its outer ring in a vertex, so the middle of an edge is asked for.
                let middle = 0.5 * (self.vertices[ring[0] as usize] + self.vertices[ring[1] as usize]);
                if let Some(i) = outer.smallest_around(middle) {
                    faces[i].push(ring);
                }
            }
        }
        faces
    }

    /// The polygons of each region.
    pub(crate) fn polygons(&self) -> Vec<Vec<Polygon>> {
        let polygon = |face: &Vec<Vec<u32>>| Polygon {
            outer: self.points(&face[0]),
            holes: face[1..].iter().map(|h| self.points(h)).collect(),
        };
        self.region_faces().iter().map(|faces| faces.iter().map(polygon).collect()).collect()
    }

    /// A partition for each group of regions, which are numbered by their places in the group. O(edges · log), whatever the
    /// number of groups.
    ///
    /// # Panics
    /// If a region is in two groups.
    pub(crate) fn parts(&self, groups: &[Vec<Region>]) -> Vec<Self> {
        let mut place = vec![None; self.regions];
        for (g, regions) in groups.iter().enumerate() {
            for (n, &region) in regions.iter().enumerate() {
                assert!(place[region].replace((g, n)).is_none(), "region {region} is in two groups");
            }
        }
        let mut kept: Vec<Vec<usize>> = vec![Vec::new(); groups.len()];
        let mut number = vec![usize::MAX; self.edges.len()];
        for (i, e) in self.edges.iter().enumerate() {
            if let Some((g, _)) = place[e.region] {
                number[i] = kept[g].len();
                kept[g].push(i);
            }
        }
        let part = |(regions, edges): (&Vec<Region>, Vec<usize>)| {
            let edge = |&i: &usize| {
                let e = self.edges[i];
                Edge { region: place[e.region].map_or(0, |(_, n)| n), next: number[e.next], ..e }
            };
            let edges = edges.iter().map(edge).collect();
            let mut part = Self { vertices: Vec::new(), edges, regions: regions.len() };
            part.take_vertices(&self.vertices);
            part
        };
        groups.iter().zip(kept).map(part).collect()
    }

    /// Takes from `all`, to which the edges refer, the vertices that they use, in the same order.
    fn take_vertices(&mut self, all: &[DVec2]) {
        let mut used: Vec<u32> = self.edges.iter().flat_map(|e| [e.from, e.to]).collect();
        used.sort_unstable();
        used.dedup();
        self.vertices = used.iter().map(|&v| all[v as usize]).collect();
        for e in &mut self.edges {
            for end in [&mut e.from, &mut e.to] {
                *end = used.partition_point(|&v| v < *end) as u32;
            }
        }
    }

    /// The same partition without the vertices that no edge uses.
    pub(crate) fn compacted(mut self) -> Self {
        self.drop_unused_vertices();
        self
    }

    fn drop_unused_vertices(&mut self) {
        let mut number = vec![u32::MAX; self.vertices.len()];
        for e in &self.edges {
            number[e.from as usize] = 0;
        }
        let mut vertices = Vec::new();
        for (v, n) in number.iter_mut().enumerate() {
            if *n == 0 {
                *n = vertices.len() as u32;
                vertices.push(self.vertices[v]);
            }
        }
        for e in &mut self.edges {
            e.from = number[e.from as usize];
            e.to = number[e.to as usize];
        }
        self.vertices = vertices;
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use gable_geometry::dvec2;

    /// Two 4 × 4 m squares side by side, regions 0 (west) and 1 (east).
    pub(crate) fn pair() -> Partition {
        let vertices =
            vec![dvec2(0.0, 0.0), dvec2(4.0, 0.0), dvec2(8.0, 0.0), dvec2(8.0, 4.0), dvec2(4.0, 4.0), dvec2(0.0, 4.0)];
        Partition::from_rings(vertices, &[(0, vec![0, 1, 4, 5]), (1, vec![1, 2, 3, 4])])
    }

    #[test]
    fn joining_two_squares_gives_a_rectangle() {
        let joined = pair().joined(&[Some(0), Some(0)]);
        assert_eq!(joined.areas(), [32.0]);
        assert_eq!(joined.edges.len(), 6);
        let straight = joined.straightened(1e-3);
        assert_eq!(straight.edges.len(), 4);
        assert_eq!(straight.vertices.len(), 4);
        assert_eq!(straight.areas(), [32.0]);
        assert_eq!(pair().straightened(1e-3), pair());
    }

    #[test]
    fn a_region_that_becomes_ground_leaves_the_other() {
        let one = pair().joined(&[Some(0), None]);
        assert_eq!((one.regions, one.edges.len(), one.areas()), (1, 4, vec![16.0]));
    }

    #[test]
    fn a_hole_that_touches_the_outer_ring_is_cut_off() {
        let vertices =
            vec![dvec2(0.0, 0.0), dvec2(4.0, 0.0), dvec2(4.0, 4.0), dvec2(0.0, 4.0), dvec2(2.0, 1.0), dvec2(1.0, 2.0)];
        let p = Partition::from_rings(vertices, &[(0, vec![0, 1, 2, 3, 0, 5, 4])]);
        let faces = p.region_faces();
        assert_eq!(faces[0].len(), 1);
        assert_eq!(faces[0][0].len(), 2, "an outer ring and a hole");
        assert_eq!(p.polygons()[0][0].area(), 16.0 - 1.5);
    }
}
