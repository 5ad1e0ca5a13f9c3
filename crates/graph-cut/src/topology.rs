//! Who neighbours whom: the 4-connected grid without stored adjacency, and general graphs in compressed rows.

use crate::Error;
use std::ops::Range;

/// A symmetric directed graph: every arc has a sister that leads back.
pub(crate) trait Topology {
    /// Nodes, those of a margin included.
    fn nodes(&self) -> usize;
    /// Arcs.
    fn arcs(&self) -> usize;
    /// The arcs that leave a node.
    fn leaving(&self, node: u32) -> Range<u32>;
    /// Where an arc that leaves `node` leads.
    fn head(&self, node: u32, arc: u32) -> u32;
    /// The arc back from `head` to the node that `arc` leaves.
    fn sister(&self, arc: u32, head: u32) -> u32;
}

/// The 4-connected grid. Pixels are numbered row by row, after a margin of one row; the arcs of node `v` are
/// `4v..4v+4`: right, left, up, down. Arcs over the left and right border lead to the neighbouring row and those
/// over the lower and upper border into the margin; all of these have to get capacity 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    width: u32,
    pixels: u32,
}

impl Grid {
    pub(crate) fn new(width: usize, height: usize) -> Result<Self, Error> {
        let most = (u32::MAX as usize - 4) / 4;
        // At least one column, so that right and left of the first node stay inside the margin.
        let size = width.saturating_mul(height.saturating_add(2)).saturating_add(2);
        if size > most {
            return Err(Error::Size { size, most });
        }
        Ok(Self { width: width as u32, pixels: (width * height) as u32 })
    }

    /// Nodes before the first pixel.
    pub(crate) fn margin(&self) -> usize {
        self.width as usize
    }
}

impl Topology for Grid {
    fn nodes(&self) -> usize {
        self.pixels as usize + 2 * self.width as usize
    }

    fn arcs(&self) -> usize {
        4 * self.nodes()
    }

    #[inline(always)]
    fn leaving(&self, node: u32) -> Range<u32> {
        4 * node..4 * node + 4
    }

    #[inline(always)]
    fn head(&self, node: u32, arc: u32) -> u32 {
        match arc & 3 {
            0 => node + 1,
            1 => node - 1,
            2 => node + self.width,
            _ => node - self.width,
        }
    }

    #[inline(always)]
    fn sister(&self, arc: u32, head: u32) -> u32 {
        4 * head + ((arc & 3) ^ 1)
    }
}

/// A general graph in compressed rows.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    first: Vec<u32>,
    heads: Vec<u32>,
    sisters: Vec<u32>,
}

impl Rows {
    /// From the ends of the edges. Also gives, for each arc, the edge that it comes from: arc `2e` of edge `e` leaves
    /// its first end. Time and memory are linear.
    pub(crate) fn new(
        nodes: usize,
        edges: impl ExactSizeIterator<Item = (u32, u32)> + Clone,
    ) -> Result<(Self, Vec<u32>), Error> {
        let most = (u32::MAX as usize - 8) / 2;
        let size = nodes.max(edges.len());
        if size > most {
            return Err(Error::Size { size, most });
        }
        let mut first = vec![0_u32; nodes + 1];
        for (edge, (from, to)) in edges.clone().enumerate() {
            if from as usize >= nodes || to as usize >= nodes || from == to {
                return Err(Error::Edge { edge, from, to, nodes });
            }
            first[from as usize + 1] += 1;
            first[to as usize + 1] += 1;
        }
        for node in 0..nodes {
            first[node + 1] += first[node];
        }
        let count = 2 * edges.len();
        let (mut heads, mut sisters, mut origin) = (vec![0; count], vec![0; count], vec![0; count]);
        let mut next = first.clone();
        for (edge, (from, to)) in edges.enumerate() {
            let (out, back) = (next[from as usize], next[to as usize]);
            next[from as usize] += 1;
            next[to as usize] += 1;
            (heads[out as usize], heads[back as usize]) = (to, from);
            (sisters[out as usize], sisters[back as usize]) = (back, out);
            (origin[out as usize], origin[back as usize]) = (2 * edge as u32, 2 * edge as u32 + 1);
        }
        Ok((Self { first, heads, sisters }, origin))
    }
}

impl Topology for Rows {
    fn nodes(&self) -> usize {
        self.first.len() - 1
    }

    fn arcs(&self) -> usize {
        self.heads.len()
    }

    #[inline(always)]
    fn leaving(&self, node: u32) -> Range<u32> {
        self.first[node as usize]..self.first[node as usize + 1]
    }

    #[inline(always)]
    fn head(&self, _node: u32, arc: u32) -> u32 {
        self.heads[arc as usize]
    }

    #[inline(always)]
    fn sister(&self, arc: u32, _head: u32) -> u32 {
        self.sisters[arc as usize]
    }
}
