//! Labels where a person is sure.

use super::outlines::OutlineClass;
use super::scene::{Known, RealScene};
use crate::statistics::ratio;
use gable_geometry::DVec2;
use serde::{Deserialize, Serialize};

/// A label of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Label {
    /// Ground.
    Ground,
    /// Grass.
    Grass,
    /// Tree.
    Tree,
    /// Building.
    Building,
}

/// Intersection over union of each class on the pixels where a person is sure; `None` if neither truth nor result has the
/// class there.
///
/// A pixel whose truth is `water` or `other` has no right label but a wrong one: building. It counts for the building's
/// union alone. A pixel whose truth is `open` may be ground or grass: it counts for both together, and against either only if it is
/// labelled as neither.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JudgedLabels {
    /// Area of these pixels, m².
    pub area_m2: f64,
    /// Buildings.
    pub building: Option<f64>,
    /// Trees.
    pub tree: Option<f64>,
    /// Ground and grass as one class.
    pub open_ground: Option<f64>,
    /// Ground.
    pub ground: Option<f64>,
    /// Grass.
    pub grass: Option<f64>,
    /// Share of ground and grass that is labelled as building.
    pub ground_called_building: f64,
}

/// Intersection and union, pixels.
#[derive(Clone, Copy, Default)]
struct Overlap {
    both: usize,
    either: usize,
}

impl Overlap {
    fn add(&mut self, truth: bool, result: bool) {
        self.both += usize::from(truth && result);
        self.either += usize::from(truth || result);
    }

    fn iou(self) -> Option<f64> {
        (self.either > 0).then(|| self.both as f64 / self.either as f64)
    }
}

/// `label` gives the result's label at a place, `None` where it has none.
pub(crate) fn judged_labels(scene: &RealScene, label: &dyn Fn(DVec2) -> Option<Label>) -> JudgedLabels {
    let [mut building, mut tree, mut open_ground, mut ground, mut grass] = [Overlap::default(); 5];
    let (mut pixels, mut open_pixels, mut called_building) = (0, 0, 0);
    for (at, known) in scene.known.iter().enumerate() {
        let Known::Drawn(truth) = *known else { continue };
        if matches!(truth, OutlineClass::Unsure | OutlineClass::Area) {
            continue;
        }
        let result = label(scene.centre(at));
        let is = |label: Label| result == Some(label);
        building.add(truth == OutlineClass::Building, is(Label::Building));
        if matches!(truth, OutlineClass::Water | OutlineClass::Other) {
            continue;
        }
        pixels += 1;
        tree.add(truth == OutlineClass::Tree, is(Label::Tree));
        open_ground.add(truth.is_open_ground(), is(Label::Ground) || is(Label::Grass));
        if truth != OutlineClass::Open {
            ground.add(truth == OutlineClass::Ground, is(Label::Ground));
            grass.add(truth == OutlineClass::Grass, is(Label::Grass));
        }
        if truth.is_open_ground() {
            open_pixels += 1;
            called_building += usize::from(is(Label::Building));
        }
    }
    JudgedLabels {
        area_m2: scene.area(pixels),
        building: building.iou(),
        tree: tree.iou(),
        open_ground: open_ground.iou(),
        ground: ground.iou(),
        grass: grass.iou(),
        ground_called_building: ratio(called_building as f64, open_pixels as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::super::outlines::tests::{collection, rectangle};
    use super::super::scene::tests::slab;
    use super::*;

    #[test]
    fn figures_of_a_hand_calculation() {
        // Strips of 10 m² from west to east; the last is in no polygon.
        let classes = ["building", "tree", "grass", "ground", "open", "other", "unsure"];
        let strips = classes.iter().enumerate().map(|(k, class)| {
            let id = if *class == "building" { "a" } else { "" };
            rectangle(class, id, [k as f64, 0.0, k as f64 + 1.0, 10.0])
        });
        let outlines = collection(&strips.collect::<Vec<_>>());
        let scene = RealScene::new(outlines, &slab([0.0, 0.0, 8.0, 10.0], 1.0, 0.0)).unwrap();
        // All is right but for the southern parts: of each strip some metres are called building, of the building 2 m ground.
        let label = |p: DVec2| {
            let right = [Label::Building, Label::Tree, Label::Grass, Label::Ground, Label::Ground];
            let strip = p.x as usize;
            let called = [0.0, 1.0, 2.0, 4.0, 3.0, 5.0, 9.0, 9.0][strip];
            match () {
                () if p.y < called => Some(Label::Building),
                () if strip == 0 && p.y < 2.0 => Some(Label::Ground),
                () => right.get(strip).copied(),
            }
        };
        let figures = judged_labels(&scene, &label);
        let close = |found: Option<f64>, wanted: f64| assert!((found.unwrap() - wanted).abs() < 1e-9, "{figures:?}");
        assert!((figures.area_m2 - 50.0).abs() < 1e-9);
        // 8 m² right; the union has 10, and 1 + 2 + 4 + 3 + 5 of the others.
        close(figures.building, 8.0 / 25.0);
        close(figures.tree, 0.9);
        // 8 + 6 + 7 m² right of 30, and 2 of the building.
        close(figures.open_ground, 21.0 / 32.0);
        // 6 m² right of 10, and 2 of the building; the open strip is neither.
        close(figures.ground, 6.0 / 12.0);
        close(figures.grass, 0.8);
        assert!((figures.ground_called_building - 9.0 / 30.0).abs() < 1e-9);
    }

    #[test]
    fn pixels_without_a_label_are_wrong() {
        let outlines = collection(&[rectangle("tree", "", [0.0, 0.0, 2.0, 2.0])]);
        let scene = RealScene::new(outlines, &slab([0.0, 0.0, 2.0, 2.0], 1.0, 0.0)).unwrap();
        let figures = judged_labels(&scene, &|p| (p.x < 1.0).then_some(Label::Tree));
        assert_eq!((figures.tree, figures.building, figures.ground_called_building), (Some(0.5), None, 0.0));
    }
}
