//! Small scenes that all methods are tried on.

use super::*;
use crate::Label;
use crate::stumps::Stump;
use gable_geometry::Counter;
use gable_raster::GridWindow;

const WINDOW: GridWindow = GridWindow { step: 0.25, x0: -40, y0: 12, width: 240, height: 200 };

// Green is a tree: one stump on a*.
fn green() -> Model {
    let stump = Stump { feature: 1, threshold: -10.0, below: 3.0, above: -3.0 };
    Model::new(FeatureSet::Zhu27, vec![stump], None, String::new())
}

struct Scene {
    colour: Raster<[u8; 3]>,
    height: Raster<f32>,
    normal: Raster<[f32; 3]>,
    ground: Raster<f32>,
    truth: Raster<u8>,
}

// A slope with a house that a tree touches, a lawn, a car and a hole in the data on the roof.
fn scene(slope: f32) -> Scene {
    let mut random = Counter::new(5);
    let truth_at = |x: usize, y: usize| match (x, y) {
        (40..=120, 50..=130) => Label::Building,
        (121..=150, 70..=100) => Label::Tree,
        (20..=100, 150..=185) => Label::Grass,
        _ => Label::Ground,
    };
    let mut scene = Scene {
        colour: Raster::filled(WINDOW, [150, 145, 140]),
        height: Raster::filled(WINDOW, 0.0),
        normal: Raster::filled(WINDOW, [0.0, 0.0, 1.0]),
        ground: Raster::filled(WINDOW, 0.0),
        truth: Raster::filled(WINDOW, 0),
    };
    for y in 0..WINDOW.height {
        for x in 0..WINDOW.width {
            let at = (x, y);
            let label = truth_at(x, y);
            let car = (180..196).contains(&x) && (40..48).contains(&y);
            scene.ground[at] = 100.0 + slope * x as f32 * 0.25;
            let above = match label {
                Label::Building => 6.0,
                Label::Tree => 5.0,
                _ if car => 1.6,
                _ => 0.0,
            };
            scene.height[at] = scene.ground[at] + above + random.range(-0.1, 0.1) as f32;
            if matches!(label, Label::Tree | Label::Grass) {
                scene.colour[at] = [60, 110, 50];
            }
            // Noise of the classifier: single green pixels anywhere.
            if random.unit() < 0.05 {
                scene.colour[at] = [60, 110, 50];
            }
            if (60..66).contains(&x) && (80..86).contains(&y) {
                scene.height[at] = f32::NAN;
            }
            scene.truth[at] = label as u8;
        }
    }
    scene
}

impl Scene {
    fn labelled(&self, method: &dyn Labeller) -> Segmentation {
        let maps = Orthograph { colour: Some(&self.colour), height: &self.height, normal: &self.normal };
        let classifier = green();
        let input = LabelInput { maps, terrain: &self.ground, classifier: &classifier, noise: 1.0, min_area: 10.0 };
        method.label(&input, &Settings::default()).unwrap()
    }
}

fn right(scene: &Scene, method: &dyn Labeller) -> f64 {
    let found = scene.labelled(method);
    let same = found.labels.values().iter().zip(scene.truth.values()).filter(|(a, b)| a == b).count();
    same as f64 / scene.truth.values().len() as f64
}

#[test]
fn labels_a_small_scene() {
    for slope in [0.0, 0.15] {
        let share = right(&scene(slope), &Likelihood);
        assert!(share > 0.995, "slope {slope}: {share}");
    }
}

#[test]
fn the_published_rule_works_on_flat_ground_and_fails_on_a_slope() {
    let flat = right(&scene(0.0), &Zhu2018);
    assert!(flat > 0.92, "{flat}");
    let slope = right(&scene(0.15), &Zhu2018);
    assert!(slope < flat - 0.02, "{slope} {flat}");
}

#[test]
fn nothing_as_high_as_a_tower_block_is_a_tree() {
    // A green roof garden, too rough to be flat, 6 m and 60 m over the ground.
    for (rise, expected) in [(0.0, Label::Tree), (54.0, Label::Building)] {
        let mut scene = scene(0.0);
        let mut random = Counter::new(8);
        for y in 50..=130 {
            for x in 40..=120 {
                let rough = 2.0 * random.unit() as f32;
                scene.height[(x, y)] = 106.0 + rise + rough;
                scene.colour[(x, y)] = [60, 110, 50];
            }
        }
        let found = scene.labelled(&Likelihood);
        assert_eq!(found.labels[(100, 110)], expected as u8, "{rise}");
    }
}

#[test]
fn windows_have_to_agree() {
    let scene = scene(0.0);
    let other = Raster::filled(WINDOW.grown(1), 0.0);
    let maps = Orthograph { colour: None, height: &scene.height, normal: &scene.normal };
    let classifier = green();
    for method in LABELLERS {
        let input = LabelInput { maps, terrain: &other, classifier: &classifier, noise: 1.0, min_area: 10.0 };
        let error = method.label(&input, &Settings::default()).unwrap_err();
        assert!(matches!(error, Error::WindowMismatch { what: "terrain" }), "{}", method.name());
        let input = LabelInput { terrain: &scene.ground, ..input };
        let error = method.label(&input, &Settings::default()).unwrap_err();
        assert!(matches!(error, Error::ColourMissing { .. }), "{}", method.name());
    }
}

#[test]
fn a_setting_of_another_method_is_refused() {
    let mut settings = Settings::default();
    settings.insert("tree_weight", "1");
    assert!(Likelihood.regions(&settings).is_ok());
    let scene = scene(0.0);
    let maps = Orthograph { colour: Some(&scene.colour), height: &scene.height, normal: &scene.normal };
    let classifier = green();
    let input = LabelInput { maps, terrain: &scene.ground, classifier: &classifier, noise: 1.0, min_area: 10.0 };
    let error = Zhu2018.label(&input, &settings).unwrap_err();
    assert!(error.to_string().contains("tree_weight"), "{error}");
}
