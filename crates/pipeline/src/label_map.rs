//! Label pictures on disk: those of a truth, and those that a run writes on request.
//!
//! A folder holds pairs of `NAME.png` (8 bit, the number of the class, row 0 north) and `NAME.json` (step, size, lower
//! left corner). A truth counts from its frame's origin and names its classes in `truth.json` beside the folder.

use crate::{PipelineError, budget};
use gable_files::{FileError, Reach};
use gable_geometry::{Frame, dvec2};
use gable_raster::{GridWindow, Raster};
use gable_scene::decode_image;
use image::{ImageFormat, ImageReader};
use serde_json::Value;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The classes, in the order of the numbers that are used here.
pub const CLASSES: [&str; 4] = ["ground", "grass", "tree", "building"];

/// Most pixels on which labels are compared.
const MOST_PIXELS: f64 = 4_294_967_296.0;

/// A pixel without a class, or of another one.
pub const NONE: u8 = u8::MAX;

/// Labels of a rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelMap {
    /// Name of the file without its ending.
    pub name: String,
    /// World coordinates of the south-western corner.
    pub corner: [f64; 2],
    /// Edge of a pixel, metres.
    pub step: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Index into [`CLASSES`] or [`NONE`], row by row from the south.
    pub labels: Vec<u8>,
}

impl LabelMap {
    /// The label at world coordinates.
    #[must_use]
    pub fn at(&self, x: f64, y: f64) -> u8 {
        let (column, row) = (((x - self.corner[0]) / self.step).floor(), ((y - self.corner[1]) / self.step).floor());
        let inside = column >= 0.0 && row >= 0.0 && (column as usize) < self.width && (row as usize) < self.height;
        if inside { self.labels[row as usize * self.width + column as usize] } else { NONE }
    }
}

/// The maps of the folder `labels` in a truth or a result, in the order of their names; files within `reach` are read.
///
/// # Errors
/// If a file cannot be read, or does not say where it lies and what its numbers mean.
pub fn read(folder: &Path, reach: &Reach) -> Result<Vec<LabelMap>, PipelineError> {
    LabelFolder::open(folder, reach)?.maps.iter().map(Described::load).collect()
}

/// A folder of label pictures of which only the descriptions have been read.
#[derive(Clone, Debug)]
pub(crate) struct LabelFolder {
    maps: Vec<Described>,
}

/// A picture that has not been read.
#[derive(Clone, Debug)]
struct Described {
    picture: PathBuf,
    reach: Reach,
    name: String,
    corner: [f64; 2],
    step: f64,
    /// Index into [`CLASSES`] or [`NONE`], for each number in the picture.
    classes: [u8; 256],
}

impl LabelFolder {
    /// Reads the descriptions.
    pub(crate) fn open(folder: &Path, reach: &Reach) -> Result<Self, PipelineError> {
        let folder = base(folder, reach);
        let labels = folder.join("labels");
        let truth = folder.join("truth.json");
        let truth = if reach.is_file(&truth) { json(&truth, reach)? } else { Value::Null };
        let mut maps = Vec::new();
        for path in reach.list(&labels, budget::LABEL_FILES).map_err(input)? {
            if path.extension().is_some_and(|e| e == "json") {
                maps.push(Described::read(&path, &truth, reach)?);
            }
        }
        if maps.is_empty() {
            return Err(PipelineError::Input(format!("{}: there are no labels in this folder", labels.display())));
        }
        maps.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self { maps })
    }

    /// The files that [`LabelFolder::open`] and what follows from it read, with their names in a folder that can be opened
    /// as this one.
    pub(crate) fn files(folder: &Path, reach: &Reach) -> Result<Vec<(PathBuf, String)>, PipelineError> {
        let maps = Self::open(folder, reach)?.maps;
        let truth = base(folder, reach).join("truth.json");
        let mut files: Vec<(PathBuf, String)> =
            reach.is_file(&truth).then(|| (truth, "truth.json".to_owned())).into_iter().collect();
        for map in maps {
            for (path, ending) in [(map.picture.with_extension("json"), "json"), (map.picture, "png")] {
                files.push((path, format!("labels/{}.{ending}", map.name)));
            }
        }
        Ok(files)
    }

    /// Labels at the centres of the pixels of a window; [`NONE`] where none are given.
    pub(crate) fn on(&self, window: GridWindow, frame: &Frame) -> Result<Raster<u8>, PipelineError> {
        let [west, south, _] = frame.origin;
        let mut out = Raster::filled(window, NONE);
        let bounds = window.bounds();
        for described in &self.maps {
            let corner = dvec2(described.corner[0] - west, described.corner[1] - south);
            // Pictures are not read to learn their size where their corner alone tells that they lie elsewhere.
            if corner.x >= bounds.max.x || corner.y >= bounds.max.y {
                continue;
            }
            let (width, height) = described.size()?;
            let far = corner + dvec2(f64::from(width), f64::from(height)) * described.step;
            if far.x <= bounds.min.x || far.y <= bounds.min.y {
                continue;
            }
            let map = described.load()?;
            for row in 0..window.height {
                for column in 0..window.width {
                    let at = window.centre(column, row);
                    let label = map.at(at.x + west, at.y + south);
                    if label != NONE {
                        out[(column, row)] = label;
                    }
                }
            }
        }
        Ok(out)
    }
}

/// The folder of a truth inside what `gable synth` made; else the folder itself.
fn base(folder: &Path, reach: &Reach) -> PathBuf {
    let inner = folder.join("truth");
    if reach.is_folder(&inner.join("labels")) { inner } else { folder.to_owned() }
}

fn input(error: FileError) -> PipelineError {
    PipelineError::Input(error.to_string())
}

fn json(path: &Path, reach: &Reach) -> Result<Value, PipelineError> {
    let text = reach.read_text(path, budget::LABEL_TEXT).map_err(input)?;
    serde_json::from_str(&text).map_err(|e| PipelineError::Input(format!("{}: {e}", path.display())))
}

impl Described {
    fn read(path: &Path, truth: &Value, reach: &Reach) -> Result<Self, PipelineError> {
        let about = json(path, reach)?;
        let wrong = |what: &str| PipelineError::Input(format!("{}: {what} is missing or wrong", path.display()));
        let number = |value: &Value| value.as_f64();
        let corner = match (about.get("lower_left_world"), about.get("lower_left")) {
            (Some(world), _) => [number(&world[0]), number(&world[1])],
            (None, Some(local)) => {
                let origin = &truth["frame"]["origin"];
                [0, 1].map(|i| Some(number(&local[i])? + number(&origin[i])?))
            }
            (None, None) => [None; 2],
        };
        let [Some(west), Some(south)] = corner else { return Err(wrong("the lower left corner")) };
        let step = number(&about["step"]).filter(|s| *s > 0.0).ok_or_else(|| wrong("the step"))?;
        let codes = about.get("classes").unwrap_or(&truth["classes"]).as_object();
        let codes = codes.ok_or_else(|| wrong("the classes"))?;
        let mut classes = [NONE; 256];
        for (index, name) in CLASSES.iter().enumerate() {
            if let Some(code) = codes.get(*name).and_then(Value::as_u64).and_then(|c| usize::try_from(c).ok()) {
                *classes.get_mut(code).ok_or_else(|| wrong("a class"))? = index as u8;
            }
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self {
            picture: path.with_extension("png"),
            reach: reach.clone(),
            name,
            corner: [west, south],
            step,
            classes,
        })
    }

    fn wrong(&self, reason: impl std::fmt::Display) -> PipelineError {
        PipelineError::Input(format!("{}: {reason}", self.picture.display()))
    }

    fn size(&self) -> Result<(u32, u32), PipelineError> {
        let file = self.reach.open(&self.picture).map_err(input)?;
        let reader = ImageReader::with_format(BufReader::new(file), ImageFormat::Png);
        reader.into_dimensions().map_err(|e| self.wrong(e))
    }

    fn load(&self) -> Result<LabelMap, PipelineError> {
        let bytes = self.reach.read(&self.picture, budget::LABEL_FILE).map_err(input)?;
        let image = decode_image(&self.picture, &bytes).map_err(|e| PipelineError::Input(e.to_string()))?.into_luma8();
        let (width, height) = (image.width() as usize, image.height() as usize);
        let rows = image.as_raw().chunks_exact(width.max(1)).rev();
        let labels = rows.flatten().map(|&code| self.classes[usize::from(code)]).collect();
        Ok(LabelMap { name: self.name.clone(), corner: self.corner, step: self.step, width, height, labels })
    }
}

/// The labels of two sets of maps on the pixels of the first: columns, rows, step, and both sets row by row from the
/// south. `None` if the first is empty.
///
/// # Errors
/// If the first lie so far apart that there would be more than 2³² pixels.
pub fn together(
    truth: &[LabelMap],
    result: &[LabelMap],
) -> Result<Option<(usize, usize, f64, [Vec<u8>; 2])>, PipelineError> {
    let Some(first) = truth.first() else { return Ok(None) };
    let step = first.step;
    let fold = |f: fn(f64, f64) -> f64, start: f64, of: &dyn Fn(&LabelMap) -> f64| truth.iter().map(of).fold(start, f);
    let (west, south) =
        (fold(f64::min, f64::INFINITY, &|m| m.corner[0]), fold(f64::min, f64::INFINITY, &|m| m.corner[1]));
    let east = fold(f64::max, f64::NEG_INFINITY, &|m| m.corner[0] + m.width as f64 * m.step);
    let north = fold(f64::max, f64::NEG_INFINITY, &|m| m.corner[1] + m.height as f64 * m.step);
    let (width, height) = (((east - west) / step).round(), ((north - south) / step).round());
    let pixels = width * height;
    if pixels > MOST_PIXELS || pixels.is_nan() {
        let what =
            format!("the label pictures cover {width:e} × {height:e} pixels of {step} m: are their corners right?");
        return Err(PipelineError::Input(what));
    }
    let (width, height) = (width as usize, height as usize);
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
    Ok(Some((width, height, step, [draw(truth), draw(result)])))
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
        let (width, height, step, [a, b]) = together(&truth, &result).unwrap().unwrap();
        assert_eq!((width, height, step), (3, 2, 1.0));
        assert_eq!(a, [0, 1, 3, 2, 3, 3]);
        assert_eq!(b, [1, 1, NONE, NONE, NONE, NONE], "pixels are compared at their centres");
        assert!(together(&[], &result).unwrap().is_none());
        let far = [map(10.0, 1.0, 2, vec![0, 1]), map(1e12, 1.0, 2, vec![0, 1]), map(f64::MAX, 1e300, 2, vec![0, 1])];
        for apart in [&far[..2], &far, &[map(0.0, f64::MIN_POSITIVE, 1, vec![0]), map(9.0, 1.0, 1, vec![0])]] {
            assert!(together(apart, &result).unwrap_err().to_string().contains("are their corners right"));
        }
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
        let maps = read(folder.path(), &Reach::everything()).unwrap();
        // A raster of another step and origin takes what lies under the centres of its pixels.
        let frame = Frame { origin: [1000.5, 2000.0, 0.0], crs: gable_geometry::Crs::Unknown };
        let window = GridWindow { step: 0.25, x0: 1, y0: 7, width: 4, height: 4 };
        let on = LabelFolder::open(folder.path(), &Reach::everything()).unwrap().on(window, &frame).unwrap();
        assert_eq!(on.row(0), [NONE; 4], "below the picture");
        assert_eq!(on.row(1), [NONE, 0, 0, 0], "left of it");
        assert_eq!(on.row(3), [NONE, 2, 2, NONE], "its upper row, of which one pixel is clutter");
        assert_eq!((maps[0].corner, maps[0].labels.clone()), ([1001.0, 2002.0], vec![0, 0, 2, NONE]));
        write("labels/b.json", r#"{"step": 0.5}"#);
        assert!(read(folder.path(), &Reach::everything()).unwrap_err().to_string().contains("lower left corner"));
    }
}
