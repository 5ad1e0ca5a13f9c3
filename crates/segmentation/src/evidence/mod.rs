//! What speaks for or against a region being a building: gathered piece by piece, judged as a whole.

use serde::{Deserialize, Serialize};

mod gather;
mod verdict;

pub use verdict::RegionParams;

/// Full tree probability in the sums.
const FULL: f64 = 255.0;

/// Least share of the border that is open if it is to say something.
const LEAST_OPEN: f64 = 0.15;

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
    /// Tree probabilities before the shape of the surface corrected them, in 255ths.
    classified: u64,
    /// Sides shared with trees, with a surface on both sides.
    tree_sides: u64,
    /// Sum of the steps there, up or down, centimetres.
    tree_steps: u64,
    /// Sides with a surface on both sides and no tree outside.
    open: u64,
    /// Sum of the drops there, centimetres.
    drop: u64,
    /// Sum of the heights over the ground of all pixels, centimetres.
    rise: u64,
    /// Sides beyond which nothing was seen.
    #[serde(default)]
    unseen: u64,
}

impl Evidence {
    /// Mean height over the ground, metres.
    #[must_use]
    pub fn mean_height(&self) -> f64 {
        self.rise as f64 / 100.0 / self.pixels.max(1) as f64
    }

    /// Adds the evidence of another piece of the same region.
    pub fn absorb(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.tree += other.tree;
        self.core += other.core;
        self.border += other.border;
        self.leafy += other.leafy;
        self.classified += other.classified;
        self.tree_sides += other.tree_sides;
        self.tree_steps += other.tree_steps;
        self.open += other.open;
        self.drop += other.drop;
        self.rise += other.rise;
        self.unseen += other.unseen;
    }

    /// Mean tree probability, shape taken into account.
    #[must_use]
    pub fn tree(&self) -> f64 {
        self.tree as f64 / (FULL * self.pixels.max(1) as f64)
    }

    /// Mean tree probability that the classifier alone gives.
    #[must_use]
    pub fn classified(&self) -> f64 {
        self.classified as f64 / (FULL * self.pixels.max(1) as f64)
    }

    /// Share of the border that trees share.
    #[must_use]
    pub fn leafy(&self) -> f64 {
        self.leafy as f64 / self.border.max(1) as f64
    }

    /// Mean step to those trees, up or down, metres; at most six.
    #[must_use]
    pub fn step_to_trees(&self) -> f64 {
        self.tree_steps as f64 / self.tree_sides.max(1) as f64 / 100.0
    }

    /// Share of the border beyond which nothing was seen: there a hole or the rim of the mesh cuts it.
    #[must_use]
    pub fn cut(&self) -> f64 {
        self.unseen as f64 / self.border.max(1) as f64
    }

    /// Share of the region that lies far from its border.
    #[must_use]
    pub fn core(&self) -> f64 {
        self.core as f64 / self.pixels.max(1) as f64
    }

    /// Mean drop at the open border as a share of the mean height over the ground; `None` where too little of the border is open.
    #[must_use]
    pub fn walls(&self) -> Option<f64> {
        let enough = self.open as f64 > LEAST_OPEN * self.border as f64;
        let (drop, rise) = (self.drop as f64 / self.open.max(1) as f64, self.rise as f64 / self.pixels.max(1) as f64);
        (enough && rise > 0.0).then(|| drop / rise)
    }
}
