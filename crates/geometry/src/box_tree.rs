//! A tree over boxes on the ground, to find those that are near something.

use crate::{Box2, DVec2};

/// Boxes under one node.
const FANOUT: usize = 8;

/// Boxes that do not change, packed along a Z-order curve through their middles. Sizes may differ by any factor.
///
/// Building costs O(n log n). A query costs O(log n) and what it finds, as long as few boxes are much larger than the
/// distances between them. Empty boxes are never found.
#[derive(Clone, Debug)]
pub struct BoxTree {
    /// The boxes' numbers along the curve.
    order: Vec<u32>,
    /// The boxes in that order, then the boxes around each [`FANOUT`] of them, and so on up to the root.
    levels: Vec<Vec<Box2>>,
}

impl BoxTree {
    /// Packs boxes, which are known by their numbers in this list from here on.
    ///
    /// # Panics
    /// If there are 2³² boxes or more.
    #[must_use]
    pub fn new(boxes: &[Box2]) -> Self {
        assert!(u32::try_from(boxes.len()).is_ok(), "too many boxes");
        let middle = |b: &Box2| 0.5 * (b.min + b.max);
        let whole = Box2::of(boxes.iter().filter(|b| !b.is_empty()).map(middle));
        let scale = f64::from(u16::MAX) / whole.size().max_element().max(f64::MIN_POSITIVE);
        let place = |i: &u32| -> u32 {
            let at: DVec2 = (middle(&boxes[*i as usize]) - whole.min) * scale;
            spread(at.x as u16) | spread(at.y as u16) << 1
        };
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        order.sort_by_cached_key(|i| (place(i), *i));
        let mut levels: Vec<Vec<Box2>> = vec![order.iter().map(|&i| boxes[i as usize]).collect()];
        while let Some(last) = levels.last().filter(|level| level.len() > 1) {
            levels.push(last.chunks(FANOUT).map(around).collect());
        }
        Self { order, levels }
    }

    /// Calls `found` with the number of each box that shares a point with `area`, in no order that means anything.
    pub fn visit(&self, area: &Box2, mut found: impl FnMut(usize)) {
        let mut waiting: Vec<(usize, usize)> = vec![(self.levels.len() - 1, 0)];
        while let Some((level, at)) = waiting.pop() {
            let Some(own) = self.levels[level].get(at) else { continue };
            if !own.intersects(area) {
                continue;
            }
            match level.checked_sub(1) {
                None => found(self.order[at] as usize),
                Some(below) => waiting.extend((at * FANOUT..(at + 1) * FANOUT).rev().map(|child| (below, child))),
            }
        }
    }

    /// The numbers of the boxes that share a point with `area`, ascending.
    #[must_use]
    pub fn near(&self, area: &Box2) -> Vec<usize> {
        let mut out = Vec::new();
        self.visit(area, |i| out.push(i));
        out.sort_unstable();
        out
    }
}

fn around(boxes: &[Box2]) -> Box2 {
    let unite = |a: Box2, b: &Box2| Box2 { min: a.min.min(b.min), max: a.max.max(b.max) };
    boxes.iter().fold(Box2::default(), unite)
}

/// The bits of a number at every other place.
fn spread(value: u16) -> u32 {
    let mut v = u32::from(value);
    v = (v | v << 8) & 0x00ff_00ff;
    v = (v | v << 4) & 0x0f0f_0f0f;
    v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Counter, dvec2};

    #[test]
    fn finds_what_a_scan_finds() {
        let mut rng = Counter::new(5);
        let mut random = |largest: f64| {
            let min = dvec2(rng.range(-50.0, 50.0), rng.range(-50.0, 50.0));
            Box2 { min, max: min + dvec2(rng.range(0.0, largest), rng.range(0.0, largest)) }
        };
        for count in [0, 1, 7, 8, 9, 64, 65, 700] {
            let mut boxes: Vec<Box2> = (0..count).map(|i| random(if i % 20 == 0 { 60.0 } else { 3.0 })).collect();
            if count > 8 {
                boxes[4] = Box2::default();
                boxes[5] = boxes[6];
            }
            let tree = BoxTree::new(&boxes);
            for _ in 0..50 {
                let area = random(20.0);
                let scan: Vec<usize> = (0..count).filter(|&i| boxes[i].intersects(&area)).collect();
                assert_eq!(tree.near(&area), scan);
            }
        }
    }
}
