//! From the evidence on a region to what it is.

use super::Evidence;
use crate::Label;

/// Tree probability over which what is no building is a tree and not ground.
const TREE: f64 = 0.3;

/// The same for what is too narrow for a building: railings and walls between shrubs are none.
const NARROW_TREE: f64 = 0.5;

/// Area from which what is long and narrow everywhere is no shed, m².
const LONG_AREA: f64 = 29.0;

/// Weights of the logistic function that gives a region's probability of being a building: fitted to the regions of the tuning half
/// of the real meshes (`tests/real`) and of synthetic cities, each scene and both classes with the same weight.
struct Weights;

impl Weights {
    const OFFSET: f64 = 2.8;
    /// Tree probability, shape taken into account; and that of the classifier alone.
    const TREE: f64 = -3.8;
    const CLASSIFIED: f64 = -3.2;
    /// Share of the border that trees share.
    const LEAFY: f64 = -3.4;
    /// The same, for each metre of the step to these trees: a roof stands off the crowns around it, a crown does not.
    const STEP_TO_TREES: f64 = 0.85;
}

/// Share times step beyond which it says no more, metres.
const MOST_STEP: f64 = 4.0;

/// When a region is no building.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionParams {
    /// A building has places farther than this from its border, metres: railings, garden walls and slivers of the mesh
    /// have none.
    pub half_width: f64,
    /// Least share of such places.
    pub core_share: f64,
    /// Least share of such places for regions of 29 m² and more: long and narrow as lorries, containers and walls are.
    pub long_core_share: f64,
    /// Least ratio of the mean drop at the open border (towards ground, grass and water) to the mean height over the ground: a building
    /// ends in walls, what hangs together with its surroundings does not.
    pub wall_share: f64,
    /// Least probability of being a building and not a crown, see [`Evidence::probability`].
    pub probability: f64,
}

impl Default for RegionParams {
    fn default() -> Self {
        Self { half_width: 1.0, core_share: 0.08, long_core_share: 0.24, wall_share: 0.4, probability: 0.25 }
    }
}

impl RegionParams {
    /// Judges nothing, as the published method does.
    #[must_use]
    pub fn zhu2018() -> Self {
        Self { half_width: 0.0, core_share: 0.0, long_core_share: 0.0, wall_share: 0.0, probability: 0.0 }
    }
}

impl Evidence {
    /// Probability of being a building and not a crown, from what the classifier and the shape of the surface say of plants, the
    /// share of the border that trees share, and the step to them.
    #[must_use]
    pub fn probability(&self) -> f64 {
        let score = Weights::OFFSET
            + Weights::TREE * self.tree()
            + Weights::CLASSIFIED * self.classified()
            + Weights::LEAFY * self.leafy()
            + Weights::STEP_TO_TREES * (self.leafy() * self.step_to_trees()).min(MOST_STEP);
        1.0 / (1.0 + (-score).exp())
    }

    /// What the region is, if a pixel has `step` metres.
    #[must_use]
    pub fn verdict(&self, params: &RegionParams, step: f64) -> Label {
        let none = |tree: f64| if self.tree() > tree { Label::Tree } else { Label::Ground };
        if self.walls().is_some_and(|walls| walls < params.wall_share) {
            return none(TREE);
        }
        if self.probability() < params.probability {
            return Label::Tree;
        }
        let is_long = self.pixels as f64 * step * step >= LONG_AREA;
        let least_core = if is_long { params.core_share.max(params.long_core_share) } else { params.core_share };
        if self.core() < least_core { none(NARROW_TREE) } else { Label::Building }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::Segmentation;
    use crate::stumps::Plants;
    use gable_raster::{GridWindow, Raster};

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: -5, y0: 7, width: 120, height: 90 };

    // What was found where the classifier and the shape agree on one tree probability.
    fn segmentation(labels: &Raster<u8>, heights: &Raster<f32>, tree: f32) -> Segmentation {
        let tree = Raster::filled(WINDOW, tree);
        Segmentation {
            labels: labels.clone(),
            classified: tree.clone(),
            plants: Plants { tree, low: None },
            above: heights.clone(),
            energy: 0.0,
        }
    }

    // A building of some size, 4 m high, on ground or among crowns as high as given, with one tree probability.
    fn verdict(size: [usize; 2], around: Option<f32>, tree: f32) -> Label {
        let (around, height_around) = around.map_or((Label::Ground, 0.0), |height| (Label::Tree, height));
        let mut labels = Raster::filled(WINDOW, around as u8);
        let mut marks = Raster::filled(WINDOW, 0);
        for y in 0..size[1] {
            for x in 0..size[0] {
                labels[(10 + x, 10 + y)] = Label::Building as u8;
                marks[(10 + x, 10 + y)] = 1;
            }
        }
        let heights = labels.map(|label| if *label == Label::Building as u8 { 4.0 } else { height_around });
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
        assert_eq!(verdict([100, 8], None, 0.1), Label::Ground, "a railing of 1.6 m");
        assert_eq!(verdict([15, 20], None, 0.1), Label::Building, "a shed of 3 × 4 m");
        assert_eq!(verdict([30, 30], Some(4.5), 0.4), Label::Tree, "a gap in a wood");
        assert_eq!(verdict([60, 40], Some(7.0), 0.1), Label::Building, "a house in a wood");
        assert_eq!(verdict([30, 30], None, 0.4), Label::Building, "a mossy roof");
        assert_eq!(verdict([30, 30], None, 0.7), Label::Tree, "a crown");
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
        assert_eq!(verdict([75, 13], None, 0.1), Label::Ground, "a lorry of 15 × 2.6 m");
        assert_eq!(verdict([25, 13], None, 0.1), Label::Building, "a shed of 5 × 2.6 m");
        assert_eq!(verdict([75, 18], None, 0.1), Label::Building, "a row of garages of 15 × 3.6 m");
    }

    #[test]
    fn the_published_method_judges_nothing() {
        let evidence = Evidence { pixels: 100, tree: 25_500, border: 40, leafy: 40, ..Evidence::default() };
        assert_eq!(evidence.verdict(&RegionParams::zhu2018(), 0.2), Label::Building);
    }
}
