//! Which face holds a point, or each pixel of a window.

use crate::Arrangement;
use gable_geometry::{DVec2, Orientation, orientation};

impl Arrangement {
    /// The face that holds a point; of a point on an edge, the face to the east. O(edges).
    #[must_use]
    pub fn locate(&self, p: DVec2) -> u32 {
        let mut best: Option<(f64, f64, u32)> = None;
        for (h, low, high) in self.rising() {
            if low.y > p.y || high.y <= p.y || orientation(low, high, p) == Orientation::Left {
                continue;
            }
            let slope = (high.x - low.x) / (high.y - low.y);
            let x = low.x + slope * (p.y - low.y);
            if best.is_none_or(|(bx, bs, _)| (x, slope) > (bx, bs)) {
                best = Some((x, slope, h));
            }
        }
        best.map_or(0, |(_, _, h)| self.half_edges[h as usize].face)
    }

    /// The face of every pixel centre of a window, row by row from the south.
    ///
    /// Pixel (i, j) has its centre at ((x0 + i + ½)·step, (y0 + j + ½)·step). One sweep over the rows:
    /// O(pixels + crossings of edges with rows).
    #[must_use]
    pub fn face_raster(&self, x0: i64, y0: i64, width: usize, height: usize, step: f64) -> Vec<u32> {
        let mut out = vec![0; width * height];
        // Where each edge crosses the rows: (row, x, slope, half-edge), sorted row by row.
        let mut rows: Vec<Vec<(f64, f64, u32)>> = vec![Vec::new(); height];
        let row_at = |y: f64| ((y / step - 0.5).ceil() as i64 - y0).clamp(0, height as i64) as usize;
        for (h, low, high) in self.rising() {
            let slope = (high.x - low.x) / (high.y - low.y);
            for row in row_at(low.y)..row_at(high.y) {
                let y = ((y0 + row as i64) as f64 + 0.5) * step;
                rows[row].push((low.x + slope * (y - low.y), slope, h));
            }
        }
        let column_at = |x: f64| ((x / step - 0.5).ceil() as i64 - x0).clamp(0, width as i64) as usize;
        for (row, crossings) in rows.iter_mut().enumerate() {
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            let line = &mut out[row * width..][..width];
            for (k, &(x, _, h)) in crossings.iter().enumerate() {
                let end = crossings.get(k + 1).map_or(width, |c| column_at(c.0));
                let start = column_at(x);
                if start < end {
                    line[start..end].fill(self.half_edges[h as usize].face);
                }
            }
        }
        out
    }

    /// Edges that are not horizontal: the half-edge whose face lies to the east, the lower and the upper end.
    fn rising(&self) -> impl Iterator<Item = (u32, DVec2, DVec2)> + '_ {
        (0..self.half_edges.len() as u32).step_by(2).filter_map(|h| {
            let a = self.vertices[self.half_edges[h as usize].origin as usize];
            let b = self.vertices[self.target(h) as usize];
            match a.y.total_cmp(&b.y) {
                std::cmp::Ordering::Less => Some((h + 1, a, b)),
                std::cmp::Ordering::Greater => Some((h, b, a)),
                std::cmp::Ordering::Equal => None,
            }
        })
    }
}
