//! Label pictures on disk: those of a truth, and those that a run writes on request.
//!
//! A folder holds pairs of `NAME.png` (8 bit, the number of the class, row 0 north) and `NAME.json` (step, size, lower
//! left corner). A truth counts from its frame's origin and names its classes in `truth.json` beside the folder.

use crate::exit::UsageError;
use anyhow::Context as _;
use serde_json::Value;
use std::path::Path;

/// The classes, in the order of the numbers that are used here.
pub(crate) const CLASSES: [&str; 4] = ["ground", "grass", "tree", "building"];

/// A pixel without a class, or of another one.
pub(crate) const NONE: u8 = u8::MAX;

/// Labels of a rectangle.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LabelMap {
    /// Name of the file without its ending.
    pub(crate) name: String,
    /// World coordinates of the south-western corner.
    pub(crate) corner: [f64; 2],
    /// Edge of a pixel, metres.
    pub(crate) step: f64,
    /// Columns.
    pub(crate) width: usize,
    /// Rows.
    pub(crate) height: usize,
    /// Index into [`CLASSES`] or [`NONE`], row by row from the south.
    pub(crate) labels: Vec<u8>,
}

impl LabelMap {
    /// The label at world coordinates.
    pub(crate) fn at(&self, x: f64, y: f64) -> u8 {
        let (column, row) = (((x - self.corner[0]) / self.step).floor(), ((y - self.corner[1]) / self.step).floor());
        let inside = column >= 0.0 && row >= 0.0 && (column as usize) < self.width && (row as usize) < self.height;
        if inside { self.labels[row as usize * self.width + column as usize] } else { NONE }
    }
}

/// The maps of the folder `labels` in a truth or a result, in the order of their names.
pub(crate) fn read(folder: &Path) -> anyhow::Result<Vec<LabelMap>> {
    let labels = folder.join("labels");
    let truth = folder.join("truth.json");
    let truth = if truth.is_file() { json(&truth)? } else { Value::Null };
    let mut maps = Vec::new();
    for entry in std::fs::read_dir(&labels).with_context(|| labels.display().to_string())? {
        let path = entry.with_context(|| labels.display().to_string())?.path();
        if path.extension().is_some_and(|e| e == "json") {
            maps.push(one(&path, &truth)?);
        }
    }
    maps.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(maps)
}

fn json(path: &Path) -> anyhow::Result<Value> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

fn one(path: &Path, truth: &Value) -> anyhow::Result<LabelMap> {
    let about = json(path)?;
    let wrong = |what: &str| UsageError(format!("{}: {what} is missing or wrong", path.display()));
    let number = |value: &Value| value.as_f64();
    let corner = match (about.get("lower_left_world"), about.get("lower_left")) {
        (Some(world), _) => [number(&world[0]), number(&world[1])],
        (None, Some(local)) => {
            let origin = &truth["frame"]["origin"];
            [0, 1].map(|i| Some(number(&local[i])? + number(&origin[i])?))
        }
        (None, None) => [None; 2],
    };
    let [Some(west), Some(south)] = corner else { return Err(wrong("the lower left corner").into()) };
    let step = number(&about["step"]).filter(|s| *s > 0.0).ok_or_else(|| wrong("the step"))?;
    let codes = about.get("classes").unwrap_or(&truth["classes"]).as_object().ok_or_else(|| wrong("the classes"))?;
    let mut classes = [NONE; 256];
    for (index, name) in CLASSES.iter().enumerate() {
        if let Some(code) = codes.get(*name).and_then(Value::as_u64).and_then(|c| usize::try_from(c).ok()) {
            *classes.get_mut(code).ok_or_else(|| wrong("a class"))? = index as u8;
        }
    }
    let picture = path.with_extension("png");
    let image = image::open(&picture).with_context(|| picture.display().to_string())?.into_luma8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let rows = image.as_raw().chunks_exact(width.max(1)).rev();
    let labels = rows.flatten().map(|&code| classes[usize::from(code)]).collect();
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(LabelMap { name, corner: [west, south], step, width, height, labels })
}

/// The labels of two sets of maps on the pixels of the first: columns, rows, step, and both sets row by row from the
/// south. `None` if the first is empty.
pub(crate) fn together(truth: &[LabelMap], result: &[LabelMap]) -> Option<(usize, usize, f64, [Vec<u8>; 2])> {
    let step = truth.first()?.step;
    let fold = |f: fn(f64, f64) -> f64, of: &dyn Fn(&LabelMap) -> f64| truth.iter().map(of).reduce(f);
    let (west, south) = (fold(f64::min, &|m| m.corner[0])?, fold(f64::min, &|m| m.corner[1])?);
    let east = fold(f64::max, &|m| m.corner[0] + m.width as f64 * m.step)?;
    let north = fold(f64::max, &|m| m.corner[1] + m.height as f64 * m.step)?;
    let (width, height) = (((east - west) / step).round() as usize, ((north - south) / step).round() as usize);
    let draw = |maps: &[LabelMap]| {
        let mut out = vec![NONE; width * height];
        for map in maps {
            // Rounded outwards: whether a pixel's centre is inside is asked below.
            let range = |from: f64, pixels: usize, all: usize| {
                let (first, last) = ((from / step).floor(), ((from + pixels as f64 * map.step) / step).ceil());
                (first.max(0.0) as usize).min(all)..(last.max(0.0) as usize).min(all)
            };
            let columns = range(map.corner[0] - west, map.width, width);
            for y in range(map.corner[1] - south, map.height, height) {
                for x in columns.clone() {
                    let label = map.at(west + (x as f64 + 0.5) * step, south + (y as f64 + 0.5) * step);
                    if label != NONE {
                        out[y * width + x] = label;
                    }
                }
            }
        }
        out
    };
    Some((width, height, step, [draw(truth), draw(result)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(west: f64, step: f64, width: usize, labels: Vec<u8>) -> LabelMap {
        let height = labels.len() / width;
        LabelMap { name: String::new(), corner: [west, 100.0], step, width, height, labels }
    }

    #[test]
    fn maps_are_laid_beside_each_other() {
        let truth = [map(10.0, 1.0, 2, vec![0, 1, 2, 3]), map(12.0, 1.0, 1, vec![3, 3])];
        let result = [map(10.5, 0.5, 4, vec![1; 8])];
        let (width, height, step, [a, b]) = together(&truth, &result).unwrap();
        assert_eq!((width, height, step), (3, 2, 1.0));
        assert_eq!(a, [0, 1, 3, 2, 3, 3]);
        assert_eq!(b, [1, 1, NONE, NONE, NONE, NONE], "pixels are compared at their centres");
        assert!(together(&[], &result).is_none());
    }

    #[test]
    fn a_truth_is_read_in_world_coordinates() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("labels")).unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write(
            "truth.json",
            r#"{"frame": {"origin": [1000, 2000, 0]}, "classes": {"ground": 0, "tree": 7, "clutter": 4}}"#,
        );
        write("labels/a.json", r#"{"step": 0.5, "lower_left": [1, 2]}"#);
        image::GrayImage::from_raw(2, 2, vec![7, 4, 0, 0]).unwrap().save(folder.path().join("labels/a.png")).unwrap();
        let maps = read(folder.path()).unwrap();
        assert_eq!((maps[0].corner, maps[0].labels.clone()), ([1001.0, 2002.0], vec![0, 0, 2, NONE]));
        write("labels/b.json", r#"{"step": 0.5}"#);
        assert!(read(folder.path()).unwrap_err().to_string().contains("lower left corner"));
    }
}
