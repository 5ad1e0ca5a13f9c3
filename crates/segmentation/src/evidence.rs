//! What speaks for or against a region being a building, in sums that can be gathered piece by piece.

use gable_ortho::Raster;
use serde::{Deserialize, Serialize};

use crate::Label;
use crate::morphology::erode;
use crate::segment::Segmentation;

/// Full tree probability in the sums.
const FULL: f64 = 255.0;

/// How far from the border, inwards and outwards, heights are compared to measure a drop, metres: walls of a mesh are rounded.
const WALL_REACH: f64 = 0.8;

/// Drops and heights beyond this say no more, metres: a tower need not have more wall than a house.
const TALL: f32 = 6.0;

/// Least share of the border that is open if it is to say something.
const LEAST_OPEN: f64 = 0.15;

/// Tree probability over which what has no walls is a tree and not ground.
const WITHOUT_WALLS: f64 = 0.3;

/// Area from which what is long and narrow everywhere is no shed, m².
const LONG_AREA: f64 = 29.0;

/// Share of the border with trees from which a region may be a crown among others.
const AMONG_CROWNS: f64 = 0.3;

fn centimetres(height: f32) -> u64 {
    // NaN gives 0.
    (height.clamp(0.0, TALL) * 100.0).round() as u64
}

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
    /// Least ratio of the mean drop at the open border (towards ground, grass and water) to the mean height over the ground: a building
    /// ends in walls, what hangs together with its surroundings does not.
    pub wall_share: f64,
    /// Regions that trees share some of the border with are trees if the mean of what the classifier says of them, with half the share
    /// of that border and less a quarter of the mean step there (metres), exceeds this: a roof stands off the crowns around it, the
    /// smooth top of a crown does not.
    pub crown_score: f64,
    /// Least share of places far from the border for regions of 29 m² and more: long and narrow as lorries, containers and walls
    /// are.
    pub long_core_share: f64,
}

impl Default for RegionParams {
    fn default() -> Self {
        Self {
            half_width: 1.0,
            core_share: 0.08,
            tree_share: 0.6,
            among_trees: 0.35,
            wall_share: 0.4,
            crown_score: 0.5,
            long_core_share: 0.24,
        }
    }
}

impl RegionParams {
    /// Judges nothing, as the published method does.
    #[must_use]
    pub fn zhu2018() -> Self {
        Self {
            half_width: 0.0,
            core_share: 0.0,
            tree_share: 1.0,
            among_trees: 0.0,
            wall_share: 0.0,
            crown_score: 2.0,
            long_core_share: 0.0,
        }
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
}

impl Evidence {
    /// The evidence on the building regions that `marks` numbers from 1 to `count`.
    ///
    /// `labels`, `found`, and the surface's `heights` lie on a window that holds that of `marks`; what lies within
    /// [`RegionParams::half_width`] and 0.8 m of it is looked at. O(pixels).
    ///
    /// # Panics
    /// If `marks` has a number above `count` or reaches out of `labels`.
    #[must_use]
    pub fn gather(
        labels: &Raster<u8>,
        found: &Segmentation,
        heights: &Raster<f32>,
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
        let reach = (WALL_REACH / labels.window().step).round().max(1.0) as i64;
        let mut out = vec![Self::default(); count];
        for y in 0..inner.height {
            for (x, mark) in marks.row(y).iter().enumerate().filter(|(_, mark)| **mark != 0) {
                let (column, row) = (x + dx, y + dy);
                let i = row * width + column;
                let evidence = &mut out[*mark as usize - 1];
                evidence.pixels += 1;
                evidence.core += u64::from(core[i]);
                evidence.tree += (f64::from(found.plants.tree.values()[i]) * FULL).round() as u64;
                evidence.classified += (f64::from(found.classified.values()[i]) * FULL).round() as u64;
                evidence.rise += centimetres(found.above.values()[i]);
                for (dx, dy) in [(-1_i64, 0_i64), (1, 0), (0, -1), (0, 1)] {
                    let at = |steps: i64| {
                        let (u, v) = (column as i64 + steps * dx, row as i64 + steps * dy);
                        let inside = u >= 0 && v >= 0 && (u as usize) < width && (v as usize) < height;
                        inside.then(|| v as usize * width + u as usize)
                    };
                    let Some(j) = at(1).filter(|&j| !building[j]) else { continue };
                    let is_tree = labels.values()[j] == Label::Tree as u8;
                    evidence.border += 1;
                    evidence.leafy += u64::from(is_tree);
                    let (Some(inner), Some(outer)) = (at(1 - reach), at(reach)) else { continue };
                    let drop = heights.values()[inner] - heights.values()[outer];
                    if drop.is_nan() {
                        continue;
                    }
                    if is_tree {
                        evidence.tree_sides += 1;
                        evidence.tree_steps += centimetres(drop.abs());
                    } else {
                        evidence.open += 1;
                        evidence.drop += centimetres(drop);
                    }
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
        self.classified += other.classified;
        self.tree_sides += other.tree_sides;
        self.tree_steps += other.tree_steps;
        self.open += other.open;
        self.drop += other.drop;
        self.rise += other.rise;
    }

    /// Mean drop at the open border as a share of the mean height over the ground; `None` where too little of the border is open.
    #[must_use]
    pub fn walls(&self) -> Option<f64> {
        let enough = self.open as f64 > LEAST_OPEN * self.border as f64;
        let (drop, rise) = (self.drop as f64 / self.open.max(1) as f64, self.rise as f64 / self.pixels.max(1) as f64);
        (enough && rise > 0.0).then(|| drop / rise)
    }

    /// Whether it is the smooth top of a crown among others, see [`RegionParams::crown_score`].
    fn is_among_crowns(&self, params: &RegionParams) -> bool {
        let shared = self.leafy as f64 / self.border.max(1) as f64;
        let step = self.tree_steps as f64 / self.tree_sides.max(1) as f64 / 100.0;
        let classified = self.classified as f64 / (FULL * self.pixels.max(1) as f64);
        shared >= AMONG_CROWNS && classified + 0.5 * shared - 0.25 * step > params.crown_score
    }

    /// What the region is, if a pixel has `step` metres.
    #[must_use]
    pub fn verdict(&self, params: &RegionParams, step: f64) -> Label {
        let pixels = self.pixels.max(1) as f64;
        let tree = self.tree as f64 / (FULL * pixels);
        let among = self.leafy as f64 / self.border.max(1) as f64;
        if self.walls().is_some_and(|walls| walls < params.wall_share) {
            return if tree > WITHOUT_WALLS { Label::Tree } else { Label::Ground };
        }
        if self.is_among_crowns(params) {
            return Label::Tree;
        }
        let least_core = if pixels * step * step >= LONG_AREA {
            params.core_share.max(params.long_core_share)
        } else {
            params.core_share
        };
        if tree + params.among_trees * among > params.tree_share {
            Label::Tree
        } else if (self.core as f64) < least_core * pixels {
            if tree > 0.5 { Label::Tree } else { Label::Ground }
        } else {
            Label::Building
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stumps::Plants;
    use gable_ortho::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: -5, y0: 7, width: 120, height: 90 };

    // What was found where the classifier and the shape agree on one tree probability.
    fn segmentation(labels: &Raster<u8>, heights: &Raster<f32>, tree: f32) -> Segmentation {
        let tree = Raster::filled(WINDOW, tree);
        Segmentation {
            labels: labels.clone(),
            classified: tree.clone(),
            plants: Plants { tree, low: None },
            above: heights.clone(),
            features: crate::FeatureSet::Geometric,
            energy: 0.0,
        }
    }

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
        let heights = labels.map(|label| if *label == Label::Building as u8 { 4.0 } else { 0.0 });
        let found = segmentation(&labels, &heights, tree);
        let params = RegionParams::default();
        let whole = Evidence::gather(&labels, &found, &heights, &marks, 1, &params)[0];
        // Cut in two, it is judged the same.
        let mut sum = Evidence::default();
        for (x0, width) in [(-5, 33), (28, 87)] {
            let part = marks.crop(GridWindow { x0, width, ..WINDOW }, 0);
            sum.absorb(&Evidence::gather(&labels, &found, &heights, &part, 1, &params)[0]);
        }
        assert_eq!(sum, whole);
        whole.verdict(&params, WINDOW.step)
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

    // A region 60 pixels wide whose surface falls off to the ground over some metres outside of its middle.
    fn sloping(fall: f64, tree: f32) -> (Option<f64>, Label) {
        let height = |x: usize, y: usize| {
            let outside = |at: usize, first: f64| (first - at as f64).max(at as f64 - first - 59.0).max(0.0) * 0.2;
            (4.0 - 4.0 / fall * outside(x, 30.0).hypot(outside(y, 15.0))).max(0.0) as f32
        };
        let mut heights = Raster::filled(WINDOW, 0.0_f32);
        let mut labels = Raster::filled(WINDOW, Label::Ground as u8);
        for y in 0..WINDOW.height {
            for x in 0..WINDOW.width {
                heights[(x, y)] = height(x, y);
                if heights[(x, y)] > 2.0 {
                    labels[(x, y)] = Label::Building as u8;
                }
            }
        }
        let marks = labels.map(|label| u32::from(*label == Label::Building as u8));
        let found = segmentation(&labels, &heights, tree);
        let params = RegionParams::default();
        let evidence = Evidence::gather(&labels, &found, &heights, &marks, 1, &params)[0];
        (evidence.walls(), evidence.verdict(&params, WINDOW.step))
    }

    #[test]
    fn what_ends_in_no_wall_is_no_building() {
        let (walls, verdict) = sloping(0.5, 0.1);
        assert!(walls.unwrap() > 0.9, "{walls:?}");
        assert_eq!(verdict, Label::Building);
        let (walls, verdict) = sloping(6.0, 0.1);
        assert!(walls.unwrap() < 0.4, "{walls:?}");
        assert_eq!(verdict, Label::Ground);
        assert_eq!(sloping(6.0, 0.4).1, Label::Tree);
    }

    // A flat region of 30 × 30 pixels among crowns that lie `step` lower; shape took it for no crown, the classifier did not.
    fn among_crowns(step: f32, classified: f32) -> Label {
        let mut labels = Raster::filled(WINDOW, Label::Tree as u8);
        for y in 20..50 {
            for x in 40..70 {
                labels[(x, y)] = Label::Building as u8;
            }
        }
        let is_roof = |label: &u8| *label == Label::Building as u8;
        let heights = labels.map(|label| if is_roof(label) { 9.0 } else { 9.0 - step });
        let marks = labels.map(|label| u32::from(is_roof(label)));
        let mut found = segmentation(&labels, &heights, 0.1);
        found.classified = Raster::filled(WINDOW, classified);
        let params = RegionParams::default();
        Evidence::gather(&labels, &found, &heights, &marks, 1, &params)[0].verdict(&params, WINDOW.step)
    }

    #[test]
    fn a_smooth_crown_among_crowns_is_a_tree_and_a_roof_among_them_is_not() {
        assert_eq!(among_crowns(0.6, 0.8), Label::Tree, "a smooth crown");
        assert_eq!(among_crowns(0.6, 0.05), Label::Building, "a grey roof as high as the crowns");
        assert_eq!(among_crowns(4.0, 0.8), Label::Building, "a green roof over the crowns");
    }

    #[test]
    fn what_is_as_narrow_as_a_lorry_is_none_from_some_length_on() {
        assert_eq!(verdict([75, 13], Label::Ground, 0.1), Label::Ground, "a lorry of 15 × 2.6 m");
        assert_eq!(verdict([25, 13], Label::Ground, 0.1), Label::Building, "a shed of 5 × 2.6 m");
        assert_eq!(verdict([75, 18], Label::Ground, 0.1), Label::Building, "a row of garages of 15 × 3.6 m");
    }

    #[test]
    fn the_published_method_judges_nothing() {
        let evidence = Evidence { pixels: 100, tree: 25_500, border: 40, leafy: 40, ..Evidence::default() };
        assert_eq!(evidence.verdict(&RegionParams::zhu2018(), 0.2), Label::Building);
    }
}
