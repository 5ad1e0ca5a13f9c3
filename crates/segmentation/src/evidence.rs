//! What speaks for or against a region being a building, in sums that can be gathered piece by piece.

use gable_ortho::Raster;
use serde::{Deserialize, Serialize};

use crate::Label;
use crate::morphology::erode;
use crate::stumps::Plants;

/// Full tree probability in the sums.
const FULL: f64 = 255.0;

/// When a region is no building.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionParams {
    /// A building has places farther than this from its border, metres: railings, garden walls and slivers of the mesh
    /// have none.
    pub half_width: f64,
    /// Least share of such places.
    pub core_share: f64,
    /// Regions whose mean tree probability exceeds this are trees.
    pub tree_share: f64,
    /// By how much less is enough if the whole border is shared with trees: what is left over in the midst of a belt of
    /// trees belongs to it, a house in a wood does not look like a tree.
    pub among_trees: f64,
}

impl Default for RegionParams {
    fn default() -> Self {
        Self { half_width: 1.0, core_share: 0.08, tree_share: 0.6, among_trees: 0.35 }
    }
}

impl RegionParams {
    /// Judges nothing, as the published method does.
    #[must_use]
    pub fn zhu2018() -> Self {
        Self { half_width: 0.0, core_share: 0.0, tree_share: 1.0, among_trees: 0.0 }
    }
}

/// Sums over the pixels of a region. Those of its pieces add up to its own, so the verdict on a building does not depend
/// on how it was cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Evidence {
    pixels: u64,
    /// Tree probabilities, in 255ths.
    tree: u64,
    /// Pixels far from the border.
    core: u64,
    /// Sides of pixels that are shared with another class.
    border: u64,
    /// Of these, those that are shared with trees.
    leafy: u64,
}

impl Evidence {
    /// The evidence on the building regions that `marks` numbers from 1 to `count`.
    ///
    /// `labels` and `plants` lie on a window that holds that of `marks`; what lies within [`RegionParams::half_width`] of
    /// it is looked at. O(pixels).
    ///
    /// # Panics
    /// If `marks` has a number above `count` or reaches out of `labels`.
    #[must_use]
    pub fn gather(
        labels: &Raster<u8>,
        plants: &Plants,
        marks: &Raster<u32>,
        count: usize,
        params: &RegionParams,
    ) -> Vec<Self> {
        let (width, height) = (labels.width(), labels.height());
        let building: Vec<bool> = labels.values().iter().map(|l| *l == Label::Building as u8).collect();
        let core = erode(&building, width, height, (params.half_width / labels.window().step) as f32);
        let shift = |of: i64, from: i64| (of - from) as usize;
        let (window, inner) = (labels.window(), marks.window());
        let (dx, dy) = (shift(inner.x0, window.x0), shift(inner.y0, window.y0));
        let mut out = vec![Self::default(); count];
        for y in 0..inner.height {
            for (x, mark) in marks.row(y).iter().enumerate().filter(|(_, mark)| **mark != 0) {
                let (column, row) = (x + dx, y + dy);
                let i = row * width + column;
                let evidence = &mut out[*mark as usize - 1];
                evidence.pixels += 1;
                evidence.core += u64::from(core[i]);
                evidence.tree += (f64::from(plants.tree.values()[i]) * FULL).round() as u64;
                let around = [
                    (column > 0, i.wrapping_sub(1)),
                    (column + 1 < width, i + 1),
                    (row > 0, i.wrapping_sub(width)),
                    (row + 1 < height, i + width),
                ];
                for (_, j) in around.into_iter().filter(|(inside, _)| *inside) {
                    evidence.border += u64::from(!building[j]);
                    evidence.leafy += u64::from(labels.values()[j] == Label::Tree as u8);
                }
            }
        }
        out
    }

    /// Adds the evidence of another piece of the same region.
    pub fn absorb(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.tree += other.tree;
        self.core += other.core;
        self.border += other.border;
        self.leafy += other.leafy;
    }

    /// What the region is.
    #[must_use]
    pub fn verdict(&self, params: &RegionParams) -> Label {
        let pixels = self.pixels.max(1) as f64;
        let tree = self.tree as f64 / (FULL * pixels);
        let among = self.leafy as f64 / self.border.max(1) as f64;
        if tree + params.among_trees * among > params.tree_share {
            Label::Tree
        } else if (self.core as f64) < params.core_share * pixels {
            if tree > 0.5 { Label::Tree } else { Label::Ground }
        } else {
            Label::Building
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_ortho::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: -5, y0: 7, width: 120, height: 90 };

    // A building of some size on ground or in a wood, with one tree probability.
    fn verdict(size: [usize; 2], around: Label, tree: f32) -> Label {
        let mut labels = Raster::filled(WINDOW, around as u8);
        let mut marks = Raster::filled(WINDOW, 0);
        for y in 0..size[1] {
            for x in 0..size[0] {
                labels[(10 + x, 10 + y)] = Label::Building as u8;
                marks[(10 + x, 10 + y)] = 1;
            }
        }
        let plants = Plants { tree: Raster::filled(WINDOW, tree), low: None };
        let params = RegionParams::default();
        let whole = Evidence::gather(&labels, &plants, &marks, 1, &params)[0];
        // Cut in two, it is judged the same.
        let mut sum = Evidence::default();
        for (x0, width) in [(-5, 33), (28, 87)] {
            let part = marks.crop(GridWindow { x0, width, ..WINDOW }, 0);
            sum.absorb(&Evidence::gather(&labels, &plants, &part, 1, &params)[0]);
        }
        assert_eq!(sum, whole);
        whole.verdict(&params)
    }

    #[test]
    fn railings_and_remnants_of_belts_are_no_buildings() {
        assert_eq!(verdict([100, 8], Label::Ground, 0.1), Label::Ground, "a railing of 1.6 m");
        assert_eq!(verdict([15, 20], Label::Ground, 0.1), Label::Building, "a shed of 3 × 4 m");
        assert_eq!(verdict([30, 30], Label::Tree, 0.4), Label::Tree, "a gap in a wood");
        assert_eq!(verdict([60, 40], Label::Tree, 0.1), Label::Building, "a house in a wood");
        assert_eq!(verdict([30, 30], Label::Ground, 0.4), Label::Building, "a mossy roof");
        assert_eq!(verdict([30, 30], Label::Ground, 0.7), Label::Tree, "a crown");
    }

    #[test]
    fn the_published_method_judges_nothing() {
        let evidence = Evidence { pixels: 100, tree: 25_500, core: 0, border: 40, leafy: 40 };
        assert_eq!(evidence.verdict(&RegionParams::zhu2018()), Label::Building);
    }
}
