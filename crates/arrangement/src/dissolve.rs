//! Merging faces of equal label into regions with shared borders.

use crate::Arrangement;
use crate::face::simple_rings;
use gable_geometry::{DVec2, Orientation, Polygon, orientation, point_segment_distance};
use std::collections::BTreeSet;

const NONE: u32 = u32::MAX;

/// A maximal set of faces of one label that hang together across edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The label.
    pub label: u32,
    /// The faces, ascending.
    pub faces: Vec<u32>,
    /// Outer ring, counter-clockwise, as indices into [`Dissolved::vertices`].
    pub outer: Vec<u32>,
    /// Holes, clockwise.
    pub holes: Vec<Vec<u32>>,
    /// Area of the faces, m² (before borders were straightened).
    pub area: f64,
}

/// An edge between two regions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DissolvedEdge {
    /// Vertex it starts from.
    pub from: u32,
    /// Vertex it ends at.
    pub to: u32,
    /// Region to the left, `None` for the outside.
    pub left: Option<u32>,
    /// Region to the right, `None` for the outside.
    pub right: Option<u32>,
}

/// The regions of a labelling. Neighbours share the vertices of their common border.
#[derive(Clone, Debug, PartialEq)]
pub struct Dissolved {
    /// Vertices that a region uses.
    pub vertices: Vec<DVec2>,
    /// Regions, ordered by their smallest face.
    pub regions: Vec<Region>,
    /// Region of each face of the arrangement; `None` for the outside.
    pub region_of_face: Vec<Option<u32>>,
}

impl Dissolved {
    /// A region as a polygon.
    ///
    /// # Panics
    /// If there is no such region.
    #[must_use]
    pub fn polygon(&self, region: u32) -> Polygon {
        let region = &self.regions[region as usize];
        let points = |ring: &Vec<u32>| ring.iter().map(|&v| self.vertices[v as usize]).collect();
        Polygon { outer: points(&region.outer), holes: region.holes.iter().map(points).collect() }
    }

    /// Every border edge once, with the regions on both sides, ordered by its ends.
    #[must_use]
    pub fn edges(&self) -> Vec<DissolvedEdge> {
        let mut sides: Vec<(u32, u32, bool, u32)> = Vec::new();
        for (r, region) in self.regions.iter().enumerate() {
            for ring in std::iter::once(&region.outer).chain(&region.holes) {
                for (i, &u) in ring.iter().enumerate() {
                    let v = ring[(i + 1) % ring.len()];
                    sides.push((u.min(v), u.max(v), u > v, r as u32));
                }
            }
        }
        sides.sort_unstable();
        let mut out: Vec<DissolvedEdge> = Vec::new();
        for (from, to, right, region) in sides {
            if out.last().is_none_or(|e| (e.from, e.to) != (from, to)) {
                out.push(DissolvedEdge { from, to, left: None, right: None });
            }
            if let Some(e) = out.last_mut() {
                *(if right { &mut e.right } else { &mut e.left }) = Some(region);
            }
        }
        out
    }
}

impl Arrangement {
    /// Dissolves the edges between faces of equal label.
    ///
    /// `labels` has one label per face; the faces that hang together with the unbounded face through faces of its
    /// label (`labels[0]`) are the outside and give no region. Vertices where only two border edges meet are
    /// removed where the border stays within `straight` metres of its old course, once for both sides, and only
    /// if the triangle that is cut off holds no other vertex: so regions stay simple and keep their neighbours.
    ///
    /// # Panics
    /// If the number of labels is not the number of faces.
    #[must_use]
    pub fn merge_faces(&self, labels: &[u32], straight: f64) -> Dissolved {
        assert_eq!(labels.len(), self.faces.len(), "one label for each face");
        let region_of_face = self.connected_faces(labels);
        let mut regions: Vec<Region> = Vec::new();
        for (face, region) in region_of_face.iter().enumerate() {
            let Some(r) = *region else { continue };
            if r as usize == regions.len() {
                let (label, holes) = (labels[face], Vec::new());
                regions.push(Region { label, faces: Vec::new(), outer: Vec::new(), holes, area: 0.0 });
            }
            regions[r as usize].faces.push(face as u32);
            regions[r as usize].area += self.faces[face].area;
        }
        let region = |h: u32| region_of_face[self.half_edges[h as usize].face as usize];
        let is_border = |h: u32| region(h) != region(h ^ 1);

        let mut border = Border::new(self, &is_border);
        border.straighten(straight);
        let mut index = vec![NONE; self.vertices.len()];
        let mut vertices = Vec::new();
        for v in (0..self.vertices.len()).filter(|&v| border.kept[v]) {
            index[v] = vertices.len() as u32;
            vertices.push(self.vertices[v]);
        }

        let mut seen = vec![false; self.half_edges.len()];
        for start in 0..self.half_edges.len() as u32 {
            let Some(r) = region(start).filter(|_| is_border(start) && !seen[start as usize]) else { continue };
            let mut walk = Vec::new();
            let mut h = start;
            while !seen[h as usize] {
                seen[h as usize] = true;
                walk.push(self.half_edges[h as usize].origin);
                h = self.half_edges[h as usize].next;
                while !is_border(h) {
                    h = self.half_edges[(h ^ 1) as usize].next;
                }
            }
            for ring in simple_rings(walk) {
                let twice = self.ring_area(&ring);
                let ring = ring.into_iter().map(|v| index[v as usize]).filter(|&v| v != NONE).collect();
                let region = &mut regions[r as usize];
                if twice > 0 { region.outer = ring } else { region.holes.push(ring) }
            }
        }
        Dissolved { vertices, regions, region_of_face }
    }

    fn ring_area(&self, ring: &[u32]) -> i128 {
        let node = |i: usize| self.nodes[ring[i % ring.len()] as usize];
        (1..ring.len()).map(|i| i128::from(crate::lattice::cross(node(0), node(i), node(i + 1)))).sum()
    }

    /// Region of each face, numbered by smallest face; `None` for what hangs together with the unbounded face.
    fn connected_faces(&self, labels: &[u32]) -> Vec<Option<u32>> {
        let mut region = vec![None; labels.len()];
        let mut done = vec![false; labels.len()];
        let mut count = 0;
        for seed in 0..labels.len() {
            if std::mem::replace(&mut done[seed], true) {
                continue;
            }
            let id = (seed > 0).then_some(count);
            count += u32::from(seed > 0);
            let mut stack = vec![seed as u32];
            while let Some(face) = stack.pop() {
                region[face as usize] = id;
                for h in self.boundary(face).flat_map(|start| self.cycle(start)) {
                    let other = self.half_edges[(h ^ 1) as usize].face as usize;
                    if labels[other] == labels[seed] && !std::mem::replace(&mut done[other], true) {
                        stack.push(other as u32);
                    }
                }
            }
        }
        region
    }
}

/// The border edges as a graph from which vertices of degree 2 are removed.
struct Border<'a> {
    points: &'a [DVec2],
    /// The two neighbours of a vertex of degree 2.
    around: Vec<[u32; 2]>,
    /// Border edges at each vertex.
    degree: Vec<u32>,
    kept: Vec<bool>,
    edges: BTreeSet<(u32, u32)>,
}

fn key(u: u32, v: u32) -> (u32, u32) {
    (u.min(v), u.max(v))
}

impl<'a> Border<'a> {
    fn new(arrangement: &'a Arrangement, is_border: &dyn Fn(u32) -> bool) -> Self {
        let n = arrangement.vertices.len();
        let mut border = Self {
            points: &arrangement.vertices,
            around: vec![[NONE; 2]; n],
            degree: vec![0; n],
            kept: vec![false; n],
            edges: BTreeSet::new(),
        };
        for h in (0..arrangement.half_edges.len() as u32).step_by(2).filter(|&h| is_border(h)) {
            let (u, v) = (arrangement.half_edges[h as usize].origin, arrangement.target(h));
            border.edges.insert(key(u, v));
            for (a, b) in [(u, v), (v, u)] {
                let d = &mut border.degree[a as usize];
                if *d < 2 {
                    border.around[a as usize][*d as usize] = b;
                }
                *d += 1;
                border.kept[a as usize] = true;
            }
        }
        border
    }

    /// Removes vertices, the flattest first in each round, until none can go.
    fn straighten(&mut self, tolerance: f64) {
        // Removed vertices that a border edge stands for, listed at one of the edge's removals.
        let mut behind: std::collections::BTreeMap<(u32, u32), Vec<u32>> = std::collections::BTreeMap::new();
        loop {
            let mut flat: Vec<(f64, u32)> = Vec::new();
            for v in (0..self.points.len() as u32).filter(|&v| self.kept[v as usize] && self.degree[v as usize] == 2) {
                let [a, b] = self.around[v as usize];
                let off = point_segment_distance(self.at(v), self.at(a), self.at(b));
                if off <= tolerance {
                    flat.push((off, v));
                }
            }
            flat.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
            let mut removed = 0;
            for (_, v) in flat {
                let [a, b] = self.around[v as usize];
                let mut old: Vec<u32> = vec![v];
                for end in [a, b] {
                    old.extend(behind.get(&key(v, end)).into_iter().flatten());
                }
                let close = |&u: &u32| point_segment_distance(self.at(u), self.at(a), self.at(b)) <= tolerance;
                if self.edges.contains(&key(a, b)) || !old.iter().all(close) || !self.ear_is_empty(a, v, b) {
                    continue;
                }
                removed += 1;
                self.kept[v as usize] = false;
                for (end, other) in [(a, b), (b, a)] {
                    self.edges.remove(&key(v, end));
                    behind.remove(&key(v, end));
                    for n in &mut self.around[end as usize] {
                        if *n == v {
                            *n = other;
                        }
                    }
                }
                self.edges.insert(key(a, b));
                behind.insert(key(a, b), old);
            }
            if removed == 0 {
                break;
            }
        }
    }

    fn at(&self, v: u32) -> DVec2 {
        self.points[v as usize]
    }

    /// Whether no kept vertex lies in the closed triangle avb, its corners apart.
    fn ear_is_empty(&self, a: u32, v: u32, b: u32) -> bool {
        let (pa, pv, pb) = (self.at(a), self.at(v), self.at(b));
        let turn = orientation(pa, pv, pb);
        // The vertices are sorted by x.
        let (west, east) = (pa.x.min(pv.x).min(pb.x), pa.x.max(pv.x).max(pb.x));
        let from = self.points.partition_point(|p| p.x < west);
        let to = self.points.partition_point(|p| p.x <= east);
        (from..to).all(|u| {
            let p = self.points[u];
            let corner = [a, v, b].contains(&(u as u32));
            if !self.kept[u] || corner {
                return true;
            }
            let sides = [orientation(pa, pv, p), orientation(pv, pb, p), orientation(pb, pa, p)];
            if turn == Orientation::On {
                // A flat triangle holds what lies on its longest side.
                return point_segment_distance(p, pa, pb) > 0.0 || sides[2] != Orientation::On;
            }
            sides.iter().any(|&s| s != turn && s != Orientation::On)
        })
    }
}
