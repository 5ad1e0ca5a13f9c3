//! How well pixels are labelled.

use crate::Error;
use crate::error::positive;
use crate::statistics::{mean, ratio};
use serde::{Deserialize, Serialize};

/// Width of the band along borders of the truth, metres.
const BAND: f64 = 1.0;

/// Two label rasters on the same pixels.
#[derive(Clone, Copy, Debug)]
pub struct LabelRasters<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Edge of a pixel, metres.
    pub step: f64,
    /// Names of the labels 0, 1, …; pixels whose truth has no name are not counted.
    pub classes: &'a [&'a str],
    /// The truth.
    pub truth: &'a [u8],
    /// The labels to judge.
    pub result: &'a [u8],
}

/// Figures of one class.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClassFigures {
    /// Name.
    pub name: String,
    /// Share of the truth's pixels.
    pub share: f64,
    /// Intersection over union; `None` if neither truth nor result has the class.
    pub iou: Option<f64>,
}

/// Figures over a set of pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LabelFigures {
    /// Pixels.
    pub pixels: usize,
    /// Each class.
    pub classes: Vec<ClassFigures>,
    /// Mean of the classes' IoU.
    pub mean_iou: f64,
    /// Share of pixels with the right label.
    pub accuracy: f64,
}

/// Labels everywhere and where it is hard.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Labels {
    /// All pixels.
    pub all: LabelFigures,
    /// Pixels whose centre is within 1 m of the centre of a pixel of another label in the truth.
    pub border: LabelFigures,
}

pub(crate) fn labels(rasters: &LabelRasters<'_>) -> Result<Labels, Error> {
    let LabelRasters { width, height, classes, truth, result, .. } = *rasters;
    for (which, values) in [("truth", truth), ("result", result)] {
        if values.len() != width * height {
            return Err(Error::Labels { which, found: values.len(), width, height });
        }
    }
    positive("step", rasters.step)?;
    let band = border_band(rasters);
    let count = |keep: &dyn Fn(usize) -> bool| {
        let n = classes.len();
        // Rows are the truth; the last column is for labels of the result that have no name.
        let mut confusion = vec![vec![0_usize; n + 1]; n];
        for at in (0..truth.len()).filter(|&at| (truth[at] as usize) < n && keep(at)) {
            confusion[truth[at] as usize][(result[at] as usize).min(n)] += 1;
        }
        figures(classes, &confusion)
    };
    Ok(Labels { all: count(&|_| true), border: count(&|at| band[at]) })
}

fn figures(classes: &[&str], confusion: &[Vec<usize>]) -> LabelFigures {
    let pixels: usize = confusion.iter().flatten().sum();
    let class = |(k, name): (usize, &&str)| {
        let truth: usize = confusion[k].iter().sum();
        let result: usize = confusion.iter().map(|row| row[k]).sum();
        let both = confusion[k][k];
        let union = truth + result - both;
        ClassFigures {
            name: (*name).to_owned(),
            share: ratio(truth as f64, pixels as f64),
            iou: (union > 0).then(|| both as f64 / union as f64),
        }
    };
    let classes: Vec<ClassFigures> = classes.iter().enumerate().map(class).collect();
    let right: usize = (0..confusion.len()).map(|k| confusion[k][k]).sum();
    LabelFigures {
        pixels,
        mean_iou: mean(classes.iter().filter_map(|c| c.iou)),
        accuracy: ratio(right as f64, pixels as f64),
        classes,
    }
}

/// Pixels near a pixel of another label.
fn border_band(rasters: &LabelRasters<'_>) -> Vec<bool> {
    let LabelRasters { width, height, step, truth, .. } = *rasters;
    let reach = (BAND / step + 1e-9).floor() as i64;
    let radius = BAND / step + 1e-9;
    let disc: Vec<(i64, i64)> = (-reach..=reach)
        .flat_map(|y| (-reach..=reach).map(move |x| (x, y)))
        .filter(|&(x, y)| ((x * x + y * y) as f64) <= radius * radius)
        .collect();
    let mut band = vec![false; truth.len()];
    let at = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && x < width as i64 && y < height as i64;
        inside.then(|| y as usize * width + x as usize)
    };
    for y in 0..height as i64 {
        for x in 0..width as i64 {
            let own = truth[y as usize * width + x as usize];
            let sides = [(1, 0), (-1, 0), (0, 1), (0, -1)];
            let edge = sides.iter().filter_map(|(i, j)| at(x + i, y + j)).any(|n| truth[n] != own);
            if !edge {
                continue;
            }
            // Whatever is within reach of this pixel and has another label is in the band.
            for near in disc.iter().filter_map(|(i, j)| at(x + i, y + j)) {
                if truth[near] != own {
                    band[near] = true;
                }
            }
        }
    }
    band
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_a_hand_calculation() {
        // Ten columns of 0.5 m, label 0 left of column 5 and 1 from there on; the result moves the border by a pixel.
        let truth: Vec<u8> = (0..40).map(|at| u8::from(at % 10 >= 5)).collect();
        let result: Vec<u8> = (0..40).map(|at| u8::from(at % 10 >= 6)).collect();
        let rasters = LabelRasters {
            width: 10,
            height: 4,
            step: 0.5,
            classes: &["ground", "roof", "tree"],
            truth: &truth,
            result: &result,
        };
        let figures = labels(&rasters).unwrap();
        assert_eq!(figures.all.classes[0].iou, Some(20.0 / 24.0));
        assert_eq!(figures.all.classes[1].iou, Some(16.0 / 20.0));
        assert_eq!(figures.all.classes[2].iou, None);
        assert!((figures.all.mean_iou - (20.0 / 24.0 + 0.8) / 2.0).abs() < 1e-12);
        assert_eq!(figures.all.accuracy, 0.9);
        // Columns 3 to 6 are within a metre of the other label: 16 pixels, 4 of them wrong.
        assert_eq!((figures.border.pixels, figures.border.accuracy), (16, 0.75));
        assert_eq!(figures.border.classes[1].iou, Some(0.5));
        let same = labels(&LabelRasters { result: &truth, ..rasters }).unwrap();
        assert_eq!((same.all.mean_iou, same.border.accuracy), (1.0, 1.0));
        assert!(labels(&LabelRasters { result: &truth[1..], ..rasters }).is_err());
        assert!(labels(&LabelRasters { step: 0.0, ..rasters }).is_err());
    }

    #[test]
    fn unnamed_labels_are_left_out() {
        let (truth, result) = ([0, 1, 255, 0], [0, 255, 0, 0]);
        let rasters =
            LabelRasters { width: 4, height: 1, step: 1.0, classes: &["a", "b"], truth: &truth, result: &result };
        let figures = labels(&rasters).unwrap().all;
        assert_eq!((figures.pixels, figures.accuracy), (3, 2.0 / 3.0));
        assert_eq!((figures.classes[0].iou, figures.classes[1].iou), (Some(1.0), Some(0.0)));
    }

    /// The band by its definition: every pixel against every other.
    #[test]
    fn band_is_what_its_definition_says() {
        let mut random = gable_geometry::Counter::new(3);
        let (width, height) = (23, 17);
        let truth: Vec<u8> = (0..width * height)
            .map(|at| u8::from((at % width) / 6 % 2 == (at / width) / 5 % 2) * random.index(3).min(1) as u8)
            .collect();
        for step in [0.4, 0.5, 1.0, 2.0] {
            let rasters = LabelRasters { width, height, step, classes: &[], truth: &truth, result: &truth };
            let band = border_band(&rasters);
            for p in 0..truth.len() {
                let near = (0..truth.len()).any(|q| {
                    let (dx, dy) = ((p % width).abs_diff(q % width), (p / width).abs_diff(q / width));
                    truth[p] != truth[q] && ((dx * dx + dy * dy) as f64).sqrt() * step <= 1.0 + 1e-9
                });
                assert_eq!(band[p], near, "step {step}, pixel {p}");
            }
        }
    }
}
