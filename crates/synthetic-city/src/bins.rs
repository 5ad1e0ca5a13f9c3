//! Boxes by square bins, to find those near a window.

use gable_geometry::{Box2, DVec2};
use std::collections::BTreeMap;

const PITCH: f64 = 32.0;

/// An index of boxes; memory grows with the area that they cover.
pub(crate) struct Bins {
    boxes: Vec<Box2>,
    bins: BTreeMap<(i64, i64), Vec<usize>>,
}

fn bin(p: DVec2) -> (i64, i64) {
    ((p.x / PITCH).floor() as i64, (p.y / PITCH).floor() as i64)
}

impl Bins {
    pub(crate) fn new(boxes: &[Box2]) -> Self {
        let mut bins: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
        for (i, b) in boxes.iter().enumerate().filter(|(_, b)| !b.is_empty()) {
            let (low, high) = (bin(b.min), bin(b.max));
            for x in low.0..=high.0 {
                for y in low.1..=high.1 {
                    bins.entry((x, y)).or_default().push(i);
                }
            }
        }
        Self { boxes: boxes.to_vec(), bins }
    }

    /// Indices of the boxes that share a point with the window, ascending.
    pub(crate) fn touching(&self, window: &Box2) -> Vec<usize> {
        let (low, high) = (bin(window.min), bin(window.max));
        let mut out: Vec<usize> = (low.0..=high.0)
            .flat_map(|x| self.bins.range((x, low.1)..=(x, high.1)))
            .flat_map(|(_, list)| list.iter().copied())
            .filter(|&i| self.boxes[i].intersects(window))
            .collect();
        out.sort_unstable();
        out.dedup();
        out
    }
}
