//! The polygon of a face, and a point inside it.

use crate::Arrangement;
use gable_geometry::{DVec2, Polygon, dvec2, ring_area};

impl Arrangement {
    /// The face as a polygon: outer ring counter-clockwise, holes clockwise, each ring simple. Where the boundary
    /// touches itself in a vertex it is split there, into rings that touch. The unbounded face has an empty
    /// outer ring.
    #[must_use]
    pub fn face_polygon(&self, face: u32) -> Polygon {
        let mut polygon = Polygon::default();
        for start in self.boundary(face) {
            let ids: Vec<u32> = self.cycle(start).map(|h| self.half_edges[h as usize].origin).collect();
            for ring in simple_rings(ids) {
                let ring: Vec<DVec2> = ring.into_iter().map(|v| self.vertices[v as usize]).collect();
                if ring_area(&ring) > 0.0 {
                    polygon.outer = ring;
                } else {
                    polygon.holes.push(ring);
                }
            }
        }
        polygon
    }

    /// A point strictly inside a face: the middle of the widest span on the best of a few horizontal lines that
    /// pass between the vertices; `None` for the unbounded face.
    #[must_use]
    pub fn point_inside(&self, face: u32) -> Option<DVec2> {
        self.faces[face as usize].outer?;
        let edges: Vec<(DVec2, DVec2)> = self
            .boundary(face)
            .flat_map(|start| self.cycle(start))
            .map(|h| (self.half_edges[h as usize].origin, self.target(h)))
            .map(|(u, v)| (self.vertices[u as usize], self.vertices[v as usize]))
            .collect();
        let mut levels: Vec<f64> = edges.iter().map(|e| e.0.y).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let mut bands: Vec<(f64, f64)> = levels.windows(2).map(|w| (w[1] - w[0], 0.5 * (w[0] + w[1]))).collect();
        bands.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
        let mut best = (0.0, None);
        let mut crossings = Vec::new();
        for &(height, y) in bands.iter().take(8) {
            crossings.clear();
            for (a, b) in &edges {
                if (a.y > y) != (b.y > y) {
                    crossings.push(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
                }
            }
            crossings.sort_by(f64::total_cmp);
            for span in crossings.chunks_exact(2) {
                let room = (span[1] - span[0]).min(height);
                if room > best.0 || best.1.is_none() {
                    best = (room, Some(dvec2(0.5 * (span[0] + span[1]), y)));
                }
            }
        }
        best.1
    }
}

/// Cuts a closed walk wherever it comes back to a vertex, so that every ring visits each vertex once.
pub(crate) fn simple_rings(walk: Vec<u32>) -> Vec<Vec<u32>> {
    let mut rings = Vec::new();
    let mut stack: Vec<u32> = Vec::with_capacity(walk.len());
    for v in walk {
        // Walks are short, or rarely touch themselves, so looking back is cheaper than a map.
        if let Some(at) = stack.iter().rposition(|&u| u == v) {
            rings.push(stack.split_off(at));
        }
        stack.push(v);
    }
    rings.push(stack);
    rings
}
