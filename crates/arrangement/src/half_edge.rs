//! The half-edge structure and ways to walk it.

use crate::lattice::Node;
use gable_geometry::DVec2;

/// One side of an edge. Its face lies to its left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfEdge {
    /// Vertex that it starts from.
    pub origin: u32,
    /// The other side of the edge.
    pub twin: u32,
    /// The half-edge that follows on the boundary of the face.
    pub next: u32,
    /// The face to the left.
    pub face: u32,
    /// Index of the input segment that it stems from: the smallest one where several overlap, `None` for
    /// edges that come from no segment.
    pub source: Option<u32>,
}

/// A face: a connected open part of the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// A half-edge of the outer boundary cycle, which runs counter-clockwise; `None` for the unbounded face.
    pub outer: Option<u32>,
    /// A half-edge of each inner boundary cycle; these run clockwise.
    pub holes: Vec<u32>,
    /// Area in m², without the holes; infinite for the unbounded face.
    pub area: f64,
}

/// An edge with what lies on both sides, as [`Arrangement::edges`] gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The half-edge that runs from the western to the eastern end (from south to north if vertical).
    pub half_edge: u32,
    /// Face to its left.
    pub left: u32,
    /// Face to its right.
    pub right: u32,
    /// Length, metres.
    pub length: f64,
    /// Index of the input segment, as in [`HalfEdge::source`].
    pub source: Option<u32>,
}

/// A subdivision of the plane into faces by straight edges.
///
/// Invariants: edges meet at vertices only; no two edges have the same ends; every edge has different faces on its
/// sides (dangling edges and bridges are gone); half-edges 2k and 2k + 1 are twins; vertices are sorted by x, then
/// y; face 0 is the unbounded one. The structure depends on the segments as a set of points, not on their order
/// or direction ([`HalfEdge::source`] apart).
#[derive(Clone, Debug)]
pub struct Arrangement {
    pub(crate) vertices: Vec<DVec2>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) half_edges: Vec<HalfEdge>,
    pub(crate) faces: Vec<Face>,
    /// Metres per lattice unit.
    pub(crate) snap: f64,
    pub(crate) components: usize,
    pub(crate) skipped: usize,
}

impl Arrangement {
    /// Vertices, local metres.
    #[must_use]
    pub fn vertices(&self) -> &[DVec2] {
        &self.vertices
    }

    /// Half-edges; 2k and 2k + 1 are twins.
    #[must_use]
    pub fn half_edges(&self) -> &[HalfEdge] {
        &self.half_edges
    }

    /// Faces; face 0 is the unbounded one.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Connected components of the edges.
    #[must_use]
    pub fn components(&self) -> usize {
        self.components
    }

    /// Input segments that were left out because a coordinate was not finite or too far from the others.
    #[must_use]
    pub fn skipped(&self) -> usize {
        self.skipped
    }

    /// The vertex that a half-edge ends at.
    #[must_use]
    pub fn target(&self, half_edge: u32) -> u32 {
        self.half_edges[(half_edge ^ 1) as usize].origin
    }

    /// The half-edges of a boundary cycle, from one of them on.
    pub fn cycle(&self, start: u32) -> impl Iterator<Item = u32> + '_ {
        let mut at = Some(start);
        std::iter::from_fn(move || {
            let h = at?;
            let next = self.half_edges[h as usize].next;
            at = (next != start).then_some(next);
            Some(h)
        })
    }

    /// A half-edge of each boundary cycle of a face, the outer one first.
    pub fn boundary(&self, face: u32) -> impl Iterator<Item = u32> + '_ {
        let face = &self.faces[face as usize];
        face.outer.into_iter().chain(face.holes.iter().copied())
    }

    /// Every edge once, with the faces on both sides.
    pub fn edges(&self) -> impl Iterator<Item = Edge> + '_ {
        (0..self.half_edges.len()).step_by(2).map(|h| {
            let (a, b) = (&self.half_edges[h], &self.half_edges[h + 1]);
            Edge {
                half_edge: h as u32,
                left: a.face,
                right: b.face,
                length: self.vertices[a.origin as usize].distance(self.vertices[b.origin as usize]),
                source: a.source,
            }
        })
    }

    /// For each face, the faces that share an edge with it and the length of the border, sorted by face.
    /// Where two faces share several edges their lengths are added.
    #[must_use]
    pub fn adjacency(&self) -> Vec<Vec<(u32, f64)>> {
        let mut out: Vec<Vec<(u32, f64)>> = vec![Vec::new(); self.faces.len()];
        for e in self.edges() {
            out[e.left as usize].push((e.right, e.length));
            out[e.right as usize].push((e.left, e.length));
        }
        for list in &mut out {
            list.sort_by_key(|&(face, _)| face);
            list.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                if same {
                    kept.1 += next.1;
                }
                same
            });
        }
        out
    }
}
