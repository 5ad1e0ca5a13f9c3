//! A uniform grid over lattice points, to find what is near a segment.

use crate::lattice::Node;

/// Square cells over the bounding box of some nodes, about as many as there are items.
pub(crate) struct Grid {
    min: Node,
    cell: i64,
    columns: i64,
    rows: i64,
}

impl Grid {
    pub(crate) fn over(nodes: impl Iterator<Item = Node> + Clone, items: usize) -> Self {
        let mut min = Node { x: i64::MAX, y: i64::MAX };
        let mut max = Node { x: i64::MIN, y: i64::MIN };
        for n in nodes {
            min = Node { x: min.x.min(n.x), y: min.y.min(n.y) };
            max = Node { x: max.x.max(n.x), y: max.y.max(n.y) };
        }
        if min.x > max.x {
            return Self { min: Node { x: 0, y: 0 }, cell: 1, columns: 1, rows: 1 };
        }
        let (w, h) = (max.x - min.x + 1, max.y - min.y + 1);
        let per_item = w as f64 * h as f64 / items.max(1) as f64;
        // The second bound keeps long thin boxes from getting far more cells than items.
        let cell =
            (per_item.sqrt().ceil() as i64).max((w.max(h) as f64 / (4 * items.max(1)) as f64).ceil() as i64).max(4);
        Self { min, cell, columns: w / cell + 1, rows: h / cell + 1 }
    }

    pub(crate) fn cells(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    pub(crate) fn cell_of(&self, n: Node) -> usize {
        (((n.y - self.min.y) / self.cell) * self.columns + (n.x - self.min.x) / self.cell) as usize
    }

    /// Calls `f` with every cell that comes within 2 lattice units of the segment ab (and few others).
    pub(crate) fn visit(&self, a: Node, b: Node, mut f: impl FnMut(usize)) {
        let (low, high) = if a.y <= b.y { (a, b) } else { (b, a) };
        let row = |y: i64| ((y - self.min.y).div_euclid(self.cell)).clamp(0, self.rows - 1);
        let column = |x: i64| ((x - self.min.x).div_euclid(self.cell)).clamp(0, self.columns - 1);
        let rise = (high.y - low.y).max(1) as f64;
        let run = (high.x - low.x) as f64;
        let (west, east) = (low.x.min(high.x) - 2, low.x.max(high.x) + 2);
        for r in row(low.y - 2)..=row(high.y + 2) {
            let from = self.min.y + r * self.cell - 2;
            let x_at = |y: i64| low.x as f64 + run * ((y - low.y) as f64 / rise).clamp(0.0, 1.0);
            let (p, q) = (x_at(from), x_at(from + self.cell + 4));
            let (p, q) = if low.y == high.y { (west as f64, east as f64) } else { (p.min(q), p.max(q)) };
            let (p, q) = ((p.floor() as i64 - 3).max(west), (q.ceil() as i64 + 3).min(east));
            for c in column(p)..=column(q) {
                f((r * self.columns + c) as usize);
            }
        }
    }
}

/// Lists of indices per bucket, in one allocation.
pub(crate) struct Buckets {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Buckets {
    /// Sorts the (bucket, item) pairs that `emit` produces; it is called twice and must repeat itself.
    pub(crate) fn fill(buckets: usize, mut emit: impl FnMut(&mut dyn FnMut(usize, u32))) -> Self {
        let mut starts = vec![0u32; buckets + 1];
        emit(&mut |bucket, _| starts[bucket + 1] += 1);
        for i in 0..buckets {
            starts[i + 1] += starts[i];
        }
        let mut fill = starts.clone();
        let mut items = vec![0; starts[buckets] as usize];
        emit(&mut |bucket, item| {
            items[fill[bucket] as usize] = item;
            fill[bucket] += 1;
        });
        Self { starts, items }
    }

    pub(crate) fn get(&self, bucket: usize) -> &[u32] {
        &self.items[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }

    pub(crate) fn get_mut(&mut self, bucket: usize) -> &mut [u32] {
        &mut self.items[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }
}
