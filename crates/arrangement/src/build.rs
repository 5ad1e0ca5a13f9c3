//! From segments to the half-edge structure.

use crate::grid::Buckets;
use crate::half_edge::{Arrangement, Face, HalfEdge};
use crate::lattice::{LIMIT, Node, compare_angle, cross};
use crate::snap_round::{Fragment, snap_round};
use gable_geometry::{Box2, BoxTree, DVec2, dvec2};
use std::cmp::Ordering;

/// How an arrangement is built.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Lattice spacing, metres; coordinates are rounded to its multiples. The default is 2⁻¹⁰ m: a power of two
    /// makes the rounded coordinates exact.
    pub snap: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { snap: 1.0 / 1024.0 }
    }
}

const NONE: u32 = u32::MAX;

impl Arrangement {
    /// The subdivision of the plane by segments, in local metres.
    ///
    /// 1. Coordinates are rounded to the lattice and the segments noded by iterated snap rounding; overlapping
    ///    segments and equal points are merged.
    /// 2. Edges with the same face on both sides are removed: isolated ones, dangling ends and bridges.
    /// 3. Cycles become faces; those of a nested component become holes of the face around it.
    ///
    /// Segments with a coordinate that is not finite, or further than 2²⁹ lattice units from the middle of the
    /// others, are left out and counted in [`Arrangement::skipped`].
    ///
    /// O((n + k) log n) for n segments with k crossings, and what lies to the west of each nested component.
    #[must_use]
    pub fn build(segments: &[(DVec2, DVec2)], options: &Options) -> Self {
        let snap = options.snap;
        let finite = |&(a, b): &(DVec2, DVec2)| {
            let fits = |p: DVec2| p.is_finite() && (p / snap).abs().max_element() < 1e15;
            fits(a) && fits(b)
        };
        let bounds = Box2::of(segments.iter().filter(|s| finite(s)).flat_map(|&(a, b)| [a, b]));
        let middle = if bounds.is_empty() { DVec2::ZERO } else { (0.5 * (bounds.min + bounds.max) / snap).round() };
        let node = |p: DVec2| {
            let q = (p / snap).round() - middle;
            (q.abs().max_element() <= LIMIT as f64).then_some(Node { x: q.x as i64, y: q.y as i64 })
        };
        let mut fragments = Vec::with_capacity(segments.len());
        for (i, s) in segments.iter().enumerate() {
            if let (true, Some(a), Some(b)) = (finite(s), node(s.0), node(s.1)) {
                fragments.push(Fragment { a, b, source: i as u32 });
            }
        }
        let skipped = segments.len() - fragments.len();
        let (mut nodes, fragments) = snap_round(fragments);
        let mut edges: Vec<[u32; 3]> = Vec::with_capacity(fragments.len());
        for f in &fragments {
            let index = |n: &Node| nodes.binary_search(n).unwrap_or_default() as u32;
            edges.push([index(&f.a), index(&f.b), f.source]);
        }
        drop_bridges(&nodes, &mut edges);
        drop_unused(&mut nodes, &mut edges);

        let next = successors(&nodes, &edges);
        let half_edges = (0..2 * edges.len()).map(|h| HalfEdge {
            origin: edges[h / 2][h % 2],
            twin: h as u32 ^ 1,
            next: next[h],
            face: NONE,
            source: (edges[h / 2][2] != NONE).then_some(edges[h / 2][2]),
        });
        let mut out = Self {
            vertices: nodes.iter().map(|n| (dvec2(n.x as f64, n.y as f64) + middle) * snap).collect(),
            half_edges: half_edges.collect(),
            faces: vec![Face { outer: None, holes: Vec::new(), area: f64::INFINITY }],
            nodes,
            snap,
            components: 0,
            skipped,
        };
        out.find_faces();
        out
    }

    fn find_faces(&mut self) {
        // Outer cycles become faces at once; inner ones wait until the face around them is known.
        let mut inner: Vec<(u32, u32, f64)> = Vec::new();
        for start in 0..self.half_edges.len() as u32 {
            if self.half_edges[start as usize].face != NONE {
                continue;
            }
            let cycle: Vec<u32> = self.cycle(start).collect();
            let twice = self.cycle_area(&cycle);
            let area = 0.5 * twice as f64 * self.snap * self.snap;
            let face = self.faces.len() as u32;
            if twice > 0 {
                self.faces.push(Face { outer: Some(start), holes: Vec::new(), area });
            } else {
                let first = cycle.iter().map(|&h| self.half_edges[h as usize].origin).min().unwrap_or(0);
                inner.push((first, start, area));
            }
            // Inner cycles get a provisional number from the other end.
            let mark = if twice > 0 { face } else { NONE - inner.len() as u32 };
            for h in cycle {
                self.half_edges[h as usize].face = mark;
            }
        }
        self.components = inner.len();
        let edges = self.edge_tree();
        let mut face_of = vec![NONE; inner.len()];
        let mut order: Vec<usize> = (0..inner.len()).collect();
        order.sort_by_key(|&i| inner[i].0);
        for i in order {
            // Whatever lies to the west of a component's first vertex has a smaller first vertex: it is done.
            let (first, start, area) = inner[i];
            let face = match self.half_edge_west_of(first, &edges).map(|h| self.half_edges[h as usize].face) {
                None => 0,
                Some(f) if (f as usize) < self.faces.len() => f,
                Some(provisional) => face_of[(NONE - provisional) as usize - 1],
            };
            face_of[i] = face;
            self.faces[face as usize].holes.push(start);
            if face > 0 {
                self.faces[face as usize].area += area;
            }
        }
        for face in &mut self.faces {
            face.holes.sort_unstable();
        }
        let count = self.faces.len() as u32;
        for h in &mut self.half_edges {
            if h.face >= count {
                h.face = face_of[(NONE - h.face) as usize - 1];
            }
        }
    }

    /// Twice the signed area of a cycle in lattice units.
    fn cycle_area(&self, cycle: &[u32]) -> i128 {
        let node = |h: u32| self.nodes[self.half_edges[h as usize].origin as usize];
        let o = node(cycle[0]);
        cycle.iter().map(|&h| i128::from(cross(o, node(h), node(h ^ 1)))).sum()
    }

    /// The edges, each by half of the number of its half-edges, to be found by where they are in lattice units.
    fn edge_tree(&self) -> BoxTree {
        let place = |h: usize| {
            let node = self.nodes[self.half_edges[h].origin as usize];
            dvec2(node.x as f64, node.y as f64)
        };
        let boxes = (0..self.half_edges.len()).step_by(2).map(|h| Box2::of([place(h), place(h + 1)]));
        BoxTree::new(&boxes.collect::<Vec<_>>())
    }

    /// The half-edge that a ray from a vertex to the west meets first, as its eastern side.
    fn half_edge_west_of(&self, vertex: u32, edges: &BoxTree) -> Option<u32> {
        let p = self.nodes[vertex as usize];
        let ray = Box2 { min: dvec2(f64::NEG_INFINITY, p.y as f64), max: dvec2(p.x as f64, p.y as f64) };
        let mut best: Option<(u32, Node, Node)> = None;
        for h in edges.near(&ray).into_iter().map(|edge| 2 * edge) {
            let (u, v) = (self.half_edges[h].origin, self.half_edges[h + 1].origin);
            let (a, b) = (self.nodes[u as usize], self.nodes[v as usize]);
            // The side that runs down has its face to the east.
            let (low, high, down) = if a.y < b.y { (a, b, h + 1) } else { (b, a, h) };
            if low.y > p.y || high.y <= p.y || u == vertex || v == vertex || cross(low, high, p) >= 0 {
                continue;
            }
            if best.is_none_or(|(_, c, d)| compare_west((low, high), (c, d), p.y) == Ordering::Greater) {
                best = Some((down as u32, low, high));
            }
        }
        best.map(|b| b.0)
    }
}

/// Order, from west to east, of two upward edges just above the line y; both must reach from it upward.
fn compare_west((a, b): (Node, Node), (c, d): (Node, Node), y: i64) -> Ordering {
    // x = a.x + (b.x − a.x)·(y − a.y)/(b.y − a.y), compared as fractions; the products stay below 2^93.
    let (h1, h2) = (i128::from(b.y - a.y), i128::from(d.y - c.y));
    let n1 = i128::from(a.x) * h1 + i128::from(b.x - a.x) * i128::from(y - a.y);
    let n2 = i128::from(c.x) * h2 + i128::from(d.x - c.x) * i128::from(y - c.y);
    (n1 * h2).cmp(&(n2 * h1)).then_with(|| (i128::from(b.x - a.x) * h2).cmp(&(i128::from(d.x - c.x) * h1)))
}

/// For each half-edge (2k from the first to the second end of edge k, 2k + 1 back) the next one around its face.
fn successors(nodes: &[Node], edges: &[[u32; 3]]) -> Vec<u32> {
    let mut around = Buckets::fill(nodes.len(), |put| {
        for (k, e) in edges.iter().enumerate() {
            put(e[0] as usize, 2 * k as u32);
            put(e[1] as usize, 2 * k as u32 + 1);
        }
    });
    let target = |h: u32| nodes[edges[h as usize / 2][1 - h as usize % 2] as usize];
    let mut next = vec![NONE; 2 * edges.len()];
    for v in 0..nodes.len() {
        let out = around.get_mut(v);
        out.sort_unstable_by(|&g, &h| compare_angle(nodes[v], target(g), target(h)));
        for i in 0..out.len() {
            // Coming in along the twin of out[i], the face to the left goes on along the edge clockwise of it.
            let clockwise = out[(i + out.len() - 1) % out.len()];
            next[(out[i] ^ 1) as usize] = clockwise;
        }
    }
    next
}

/// Removes the edges that have the same cycle on both sides. Removing one never makes another.
fn drop_bridges(nodes: &[Node], edges: &mut Vec<[u32; 3]>) {
    let next = successors(nodes, edges);
    let mut cycle = vec![NONE; next.len()];
    for start in 0..next.len() {
        let mut h = start;
        while cycle[h] == NONE {
            cycle[h] = start as u32;
            h = next[h] as usize;
        }
    }
    let mut k = 0;
    edges.retain(|_| {
        k += 1;
        cycle[2 * k - 2] != cycle[2 * k - 1]
    });
}

fn drop_unused(nodes: &mut Vec<Node>, edges: &mut [[u32; 3]]) {
    let mut index = vec![NONE; nodes.len()];
    for e in edges.iter() {
        index[e[0] as usize] = 0;
        index[e[1] as usize] = 0;
    }
    for (kept, i) in index.iter_mut().filter(|i| **i == 0).enumerate() {
        *i = kept as u32;
    }
    let mut k = 0;
    nodes.retain(|_| {
        k += 1;
        index[k - 1] != NONE
    });
    for e in edges {
        e[0] = index[e[0] as usize];
        e[1] = index[e[1] as usize];
    }
}
