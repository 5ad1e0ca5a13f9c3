//! What is uppermost in each place of a made scene, from the label pictures of its truth.

use anyhow::Context as _;
use gable_evaluation::real::OutlineClass;
use gable_geometry::DVec2;
use serde_json::Value;
use std::path::Path;

/// A label picture.
struct Picture {
    /// World coordinates of its south-western corner.
    corner: [f64; 2],
    step: f64,
    pixels: image::GrayImage,
}

/// All label pictures of a truth.
pub(super) struct Truth {
    pictures: Vec<Picture>,
}

/// The classes by the numbers of `truth.json`; other numbers are not judged.
const CLASSES: [OutlineClass; 5] =
    [OutlineClass::Ground, OutlineClass::Grass, OutlineClass::Tree, OutlineClass::Building, OutlineClass::Other];

impl Truth {
    /// Reads the folder `truth` of what `gable synth` made.
    pub(super) fn read(folder: &Path) -> anyhow::Result<Self> {
        let about = json(&folder.join("truth.json"))?;
        let names = ["ground", "grass", "tree", "building", "clutter"];
        for (number, name) in names.iter().enumerate() {
            anyhow::ensure!(about["classes"][name] == number, "{}: other numbers of classes", folder.display());
        }
        let origin = pair(&about["frame"]["origin"]).context("the origin in truth.json")?;
        let mut pictures = Vec::new();
        for tile in about["tiles"].as_array().into_iter().flatten() {
            let file = folder.join("labels").join(tile["name"].as_str().unwrap_or_default());
            let place = json(&file.with_extension("json"))?;
            let low = pair(&place["lower_left"]).with_context(|| file.display().to_string())?;
            let step = super::super::number(&place, &["step"])?;
            let picture = file.with_extension("png");
            let pixels = image::open(&picture).with_context(|| picture.display().to_string())?.to_luma8();
            pictures.push(Picture { corner: [origin[0] + low[0], origin[1] + low[1]], step, pixels });
        }
        Ok(Self { pictures })
    }

    /// The class at a place, world coordinates; `None` where nothing is to be judged.
    pub(super) fn class(&self, p: DVec2) -> Option<OutlineClass> {
        self.pictures.iter().find_map(|picture| {
            let column = ((p.x - picture.corner[0]) / picture.step).floor();
            let row = f64::from(picture.pixels.height()) - 1.0 - ((p.y - picture.corner[1]) / picture.step).floor();
            let inside = column >= 0.0
                && row >= 0.0
                && column < f64::from(picture.pixels.width())
                && row < f64::from(picture.pixels.height());
            let number = inside.then(|| picture.pixels.get_pixel(column as u32, row as u32).0[0])?;
            CLASSES.get(usize::from(number)).copied()
        })
    }
}

fn json(path: &Path) -> anyhow::Result<Value> {
    let text = std::fs::read(path).with_context(|| path.display().to_string())?;
    serde_json::from_slice(&text).with_context(|| path.display().to_string())
}

fn pair(value: &Value) -> Option<[f64; 2]> {
    Some([value[0].as_f64()?, value[1].as_f64()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    #[test]
    fn pictures_lie_where_they_say() {
        let folder = tempfile::tempdir().unwrap();
        let truth = serde_json::json!({
            "frame": { "origin": [1000.0, 2000.0, 0.0] }, "tiles": [{ "name": "T" }],
            "classes": { "ground": 0, "grass": 1, "tree": 2, "building": 3, "clutter": 4 },
        });
        std::fs::write(folder.path().join("truth.json"), truth.to_string()).unwrap();
        std::fs::create_dir(folder.path().join("labels")).unwrap();
        let place = serde_json::json!({ "lower_left": [10.0, 20.0], "step": 0.5 });
        std::fs::write(folder.path().join("labels/T.json"), place.to_string()).unwrap();
        // The northern row first: building, clutter; then ground, unknown.
        let pixels = image::GrayImage::from_raw(2, 2, vec![3, 4, 0, 255]).unwrap();
        pixels.save(folder.path().join("labels/T.png")).unwrap();
        let truth = Truth::read(folder.path()).unwrap();
        let at = |x: f64, y: f64| truth.class(dvec2(1010.0 + x, 2020.0 + y));
        assert_eq!((at(0.2, 0.7), at(0.7, 0.7)), (Some(OutlineClass::Building), Some(OutlineClass::Other)));
        assert_eq!((at(0.2, 0.2), at(0.7, 0.2), at(1.2, 0.2)), (Some(OutlineClass::Ground), None, None));
    }
}
