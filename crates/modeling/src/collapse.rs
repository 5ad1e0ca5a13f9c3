//! Removes edges that are too short to mean anything.
//!
//! Lines that almost meet in one point leave edges of a few centimetres in the arrangement: at the foot of a hip beside
//! the corner of the walls, or where three planes almost share a point. They carry no information, and the slivers
//! beside them fail validation.

use crate::partition::{Edge, Partition};
use gable_geometry::{Box2, BoxTree, DVec2, Orientation, orientation};
use std::collections::BTreeSet;

/// Edges shorter than this are collapsed in every model, metres.
pub(crate) const SHORTEST: f64 = 0.1;

/// Collapses edges shorter than `shortest` metres, the shortest first, each to that of its ends where most edges
/// meet (the other would move them all). An edge stays if its ends share a neighbour (a triangle would vanish) or if
/// another edge would be crossed. Works in passes, in which no vertex takes part twice, until one changes nothing.
/// O(edges · log) for each pass.
pub(crate) fn short_edges(partition: &Partition, shortest: f64) -> Partition {
    short_edges_where(partition, shortest, |_, _| true)
}

/// The same for those edges only for whose ends `chosen` holds.
pub(crate) fn short_edges_where(
    partition: &Partition,
    shortest: f64,
    chosen: impl Fn(DVec2, DVec2) -> bool,
) -> Partition {
    let mut net = Net::new(partition);
    loop {
        let mut short: Vec<(f64, u32, u32)> = net
            .live()
            .map(|e| (e.from.min(e.to), e.from.max(e.to)))
            .map(|(a, b)| (net.at(a).distance(net.at(b)), a, b))
            .filter(|s| s.0 < shortest && chosen(net.at(s.1), net.at(s.2)))
            .collect();
        short.sort_by(|s, t| s.0.total_cmp(&t.0).then((s.1, s.2).cmp(&(t.1, t.2))));
        short.dedup();
        if short.is_empty() {
            return net.finish();
        }
        let tree = net.tree(shortest);
        let mut touched = BTreeSet::new();
        let mut changed = false;
        for (_, a, b) in short {
            if touched.contains(&a) || touched.contains(&b) {
                continue;
            }
            let (na, nb) = (net.neighbours(a), net.neighbours(b));
            let (keep, drop) = if nb.len() > na.len() { (b, a) } else { (a, b) };
            let moved: Vec<u32> = if drop == a { &na } else { &nb }.iter().copied().filter(|&n| n != keep).collect();
            if na.iter().any(|n| nb.contains(n)) || !net.is_free(&tree, keep, drop, &moved) {
                continue;
            }
            net.merge(keep, drop);
            touched.extend([keep, drop]);
            changed = true;
        }
        if !changed {
            return net.finish();
        }
    }
}

/// A partition of which edges go, with the edges around each vertex.
struct Net {
    part: Partition,
    gone: Vec<bool>,
    /// Edges that start or end at each vertex, those that are gone among them.
    around: Vec<Vec<usize>>,
}

impl Net {
    fn new(partition: &Partition) -> Self {
        let part = partition.clone();
        let mut around = vec![Vec::new(); part.vertices.len()];
        for (i, e) in part.edges.iter().enumerate() {
            around[e.from as usize].push(i);
            around[e.to as usize].push(i);
        }
        Self { gone: vec![false; part.edges.len()], part, around }
    }

    fn at(&self, v: u32) -> DVec2 {
        self.part.vertices[v as usize]
    }

    fn live(&self) -> impl Iterator<Item = &Edge> {
        self.part.edges.iter().zip(&self.gone).filter(|(_, gone)| !**gone).map(|(e, _)| e)
    }

    /// Vertices joined to `v` by an edge, in either direction, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let edges = self.around[v as usize].iter().filter(|&&i| !self.gone[i]).map(|&i| &self.part.edges[i]);
        let mut out: Vec<u32> = edges.map(|e| if e.from == v { e.to } else { e.from }).collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// The edges, to be found by where they are, also after each of their ends was collapsed once.
    fn tree(&self, shortest: f64) -> BoxTree {
        let place = |(e, gone): (&Edge, &bool)| {
            if *gone { Box2::default() } else { Box2::of([self.at(e.from), self.at(e.to)]).grown(shortest) }
        };
        BoxTree::new(&self.part.edges.iter().zip(&self.gone).map(place).collect::<Vec<_>>())
    }

    /// Whether the edges of `drop` can end at `keep` instead without touching any other edge.
    fn is_free(&self, tree: &BoxTree, keep: u32, drop: u32, moved: &[u32]) -> bool {
        moved.iter().all(|&m| {
            let (p, q) = (self.at(keep), self.at(m));
            let corners = [keep, drop, m];
            let near = tree.near(&Box2::of([p, q, self.at(drop)]));
            near.into_iter().filter(|&i| !self.gone[i]).map(|i| &self.part.edges[i]).all(|e| {
                // A vertex in the triangle that the edge sweeps would change sides without being touched.
                if !corners.contains(&e.from) && in_triangle(self.at(e.from), p, self.at(drop), q) {
                    return false;
                }
                let ends = [e.from, e.to];
                // Edges that move too, or share an end with the new edge, meet it in that end only, unless they overlap.
                if ends.contains(&drop) {
                    return true;
                }
                let other = match (ends.contains(&keep), ends.contains(&m)) {
                    (true, true) => return false,
                    (true, false) => Some((p, q, if e.from == keep { e.to } else { e.from })),
                    (false, true) => Some((q, p, if e.from == m { e.to } else { e.from })),
                    (false, false) => None,
                };
                match other {
                    Some((end, far, v)) => {
                        let (d, o) = (far - end, self.at(v) - end);
                        d.perp_dot(o).abs() > 1e-9 * d.length() * o.length() || d.dot(o) < 0.0
                    }
                    None => !cross(p, q, self.at(e.from), self.at(e.to)),
                }
            })
        })
    }

    /// Lets all edges of `drop` end at `keep` and removes the edge between them.
    fn merge(&mut self, keep: u32, drop: u32) {
        for i in std::mem::take(&mut self.around[drop as usize]) {
            let e = &mut self.part.edges[i];
            if [e.from, e.to].contains(&keep) {
                self.gone[i] = true;
                continue;
            }
            for end in [&mut e.from, &mut e.to] {
                if *end == drop {
                    *end = keep;
                }
            }
            self.around[keep as usize].push(i);
        }
    }

    /// The partition without the edges that are gone.
    fn finish(mut self) -> Partition {
        let mut number = vec![usize::MAX; self.gone.len()];
        let stay = (0..self.gone.len()).filter(|&i| !self.gone[i]);
        stay.enumerate().for_each(|(count, i)| number[i] = count);
        let follow = |mut e: usize| {
            while self.gone[e] {
                e = self.part.edges[e].next;
            }
            number[e]
        };
        self.part.edges = self.live().map(|e| Edge { next: follow(e.next), ..*e }).collect();
        self.part.compacted()
    }
}

/// Whether a point lies in a triangle or on its border.
fn in_triangle(v: DVec2, a: DVec2, b: DVec2, c: DVec2) -> bool {
    if v.cmplt(a.min(b).min(c)).any() || v.cmpgt(a.max(b).max(c)).any() {
        return false;
    }
    let sides = [orientation(a, b, v), orientation(b, c, v), orientation(c, a, v)];
    !(sides.contains(&Orientation::Left) && sides.contains(&Orientation::Right))
}

/// Whether two segments share a point.
fn cross(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> bool {
    if a.min(b).cmpgt(c.max(d)).any() || c.min(d).cmpgt(a.max(b)).any() {
        return false;
    }
    let splits = |p, q, r, s| {
        let (x, y) = (orientation(p, q, r), orientation(p, q, s));
        x != y || x == Orientation::On
    };
    splits(a, b, c, d) && splits(c, d, a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    #[test]
    fn a_cut_corner_becomes_sharp() {
        let vertices = vec![dvec2(0.0, 0.0), dvec2(4.0, 0.0), dvec2(4.0, 3.95), dvec2(3.96, 4.0), dvec2(0.0, 4.0)];
        let p = Partition::from_rings(vertices, &[(0, vec![0, 1, 2, 3, 4])]);
        let out = short_edges(&p, 0.1);
        assert_eq!((out.edges.len(), out.vertices.len()), (4, 4));
        assert!((out.areas()[0] - 16.0).abs() < 0.2);
        assert_eq!(short_edges(&p, 0.05), p);
    }

    #[test]
    fn no_vertex_changes_sides() {
        // Collapsing 1–2 would sweep over vertex 6, the tip of a hole beside it.
        let vertices =
            [(0.0, 0.0), (4.0, 0.0), (4.05, 0.06), (4.05, 4.0), (0.0, 4.0), (3.0, 2.0), (4.03, 0.1), (3.5, 3.0)];
        let vertices = vertices.map(|(x, y)| dvec2(x, y)).to_vec();
        let p = Partition::from_rings(vertices, &[(0, vec![0, 1, 2, 3, 4]), (0, vec![5, 7, 6])]);
        assert_eq!(short_edges(&p, 0.1), p);
    }

    #[test]
    fn a_triangle_does_not_vanish() {
        let vertices = vec![dvec2(0.0, 0.0), dvec2(4.0, 0.0), dvec2(4.0, 0.05)];
        let p = Partition::from_rings(vertices, &[(0, vec![0, 1, 2])]);
        assert_eq!(short_edges(&p, 0.1), p);
    }
}
