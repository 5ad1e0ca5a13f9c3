//! Iterated snap rounding: segments become lattice segments that meet at their ends only.
//!
//! Every end and every crossing, rounded to the lattice, is a vertex; a segment that meets the pixel of a vertex
//! is bent through it (Hobby 1999; iterated until nothing is bent any more, Halperin & Packer 2002). Crossings are
//! found and rounded exactly. No point moves by more than about a lattice unit in the first pass; further passes
//! only occur where vertices lie within a unit of a foreign segment.
//!
//! O((n + k) log n) for n evenly spread segments with k crossings.

use crate::grid::{Buckets, Grid};
use crate::lattice::{Node, meets_pixel, properly_cross, rounded_crossing};

/// A segment of the lattice with `a < b`, and the input segment that it stems from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Fragment {
    pub(crate) a: Node,
    pub(crate) b: Node,
    pub(crate) source: u32,
}

/// The vertices, sorted, and the fragments, sorted, each pair of ends once (with its smallest source).
pub(crate) fn snap_round(mut segments: Vec<Fragment>) -> (Vec<Node>, Vec<Fragment>) {
    loop {
        tidy(&mut segments);
        let mut vertices: Vec<Node> = segments.iter().flat_map(|s| [s.a, s.b]).collect();
        let ends = vertices.len();
        add_crossings(&segments, &mut vertices);
        let crossed = vertices.len() > ends;
        vertices.sort_unstable();
        vertices.dedup();
        let fragments = bend(&segments, &vertices);
        let done = !crossed && fragments == segments;
        segments = fragments;
        if done {
            return (vertices, segments);
        }
    }
}

fn tidy(segments: &mut Vec<Fragment>) {
    for s in segments.iter_mut() {
        if s.b < s.a {
            std::mem::swap(&mut s.a, &mut s.b);
        }
    }
    segments.sort_unstable();
    segments.dedup_by(|next, kept| (next.a, next.b) == (kept.a, kept.b));
    segments.retain(|s| s.a != s.b);
}

fn add_crossings(segments: &[Fragment], vertices: &mut Vec<Node>) {
    let grid = Grid::over(segments.iter().flat_map(|s| [s.a, s.b]), segments.len());
    let buckets = Buckets::fill(grid.cells(), |put| {
        for (i, s) in segments.iter().enumerate() {
            grid.visit(s.a, s.b, |cell| put(cell, i as u32));
        }
    });
    let mut stamp = vec![u32::MAX; segments.len()];
    for (i, s) in segments.iter().enumerate() {
        let (low, high) = (s.a.y.min(s.b.y), s.a.y.max(s.b.y));
        grid.visit(s.a, s.b, |cell| {
            for &j in buckets.get(cell) {
                if j as usize <= i || stamp[j as usize] == i as u32 {
                    continue;
                }
                stamp[j as usize] = i as u32;
                let t = &segments[j as usize];
                // Sorted, so t.a.x ≥ s.a.x.
                if t.a.x < s.b.x
                    && t.a.y.min(t.b.y) < high
                    && t.a.y.max(t.b.y) > low
                    && properly_cross(s.a, s.b, t.a, t.b)
                {
                    vertices.push(rounded_crossing(s.a, s.b, t.a, t.b));
                }
            }
        });
    }
}

fn bend(segments: &[Fragment], vertices: &[Node]) -> Vec<Fragment> {
    let grid = Grid::over(vertices.iter().copied(), vertices.len());
    let buckets = Buckets::fill(grid.cells(), |put| {
        for (i, &v) in vertices.iter().enumerate() {
            put(grid.cell_of(v), i as u32);
        }
    });
    let mut out = Vec::with_capacity(segments.len());
    let mut on: Vec<(i128, Node)> = Vec::new();
    for s in segments {
        on.clear();
        let (dx, dy) = (i128::from(s.b.x - s.a.x), i128::from(s.b.y - s.a.y));
        let (low, high) = (s.a.y.min(s.b.y) - 1, s.a.y.max(s.b.y) + 1);
        let length2 = dx * dx + dy * dy;
        grid.visit(s.a, s.b, |cell| {
            for &i in buckets.get(cell) {
                let v = vertices[i as usize];
                let near = v.x >= s.a.x - 1 && v.x <= s.b.x + 1 && v.y >= low && v.y <= high;
                if near && meets_pixel(s.a, s.b, v) {
                    let along = dx * i128::from(v.x - s.a.x) + dy * i128::from(v.y - s.a.y);
                    on.push((along.clamp(0, length2), v));
                }
            }
        });
        // The ends come first and last, whatever pixels reach beyond them.
        on.retain(|&(_, v)| v != s.a && v != s.b);
        on.sort_unstable();
        let mut from = s.a;
        for &(_, v) in on.iter().chain(std::iter::once(&(0, s.b))) {
            out.push(Fragment { a: from.min(v), b: from.max(v), source: s.source });
            from = v;
        }
    }
    tidy(&mut out);
    out
}
