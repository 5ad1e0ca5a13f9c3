//! The energy of a labelling and its minimum: smoothness between neighbours and the graph cut (Zhu 2018, §4.2, Eq. 5–6).

use crate::{Error, Label};
use gable_graph_cut::{GridProblem, Options, expand_grid};
use gable_raster::Raster;

/// Pixel for which the paper gives its weight of smoothness, metres.
const PAPER_STEP: f64 = 0.2;

/// Cost of any class but ground where there is no surface: holes inside a region go with it, the outside is ground.
const NO_DATA_COST: f32 = 0.25;

/// Costs of the four classes where there is no surface.
pub(crate) const NO_DATA: [f32; 4] = [0.0, NO_DATA_COST, NO_DATA_COST, NO_DATA_COST];

/// Weights of the smoothness between each pixel and its eastern and its northern neighbour.
pub(crate) struct Smoothness {
    right: Vec<f32>,
    up: Vec<f32>,
}

impl Smoothness {
    /// `weight · max(1 − |Δh|, floor)` between neighbours (Eq. 5, made symmetric). The weight holds for a pixel of 0.2 m; it
    /// is scaled to other pixels, as a border's pixels grow with its length and a region's with its area.
    pub(crate) fn of(height: &Raster<f32>, weight: f64, floor: f64) -> Self {
        let (width, rows) = (height.width(), height.height());
        let weight = (weight * PAPER_STEP / height.window().step) as f32;
        let floor = floor as f32;
        let between = |a: f32, b: f32| {
            let step = (a - b).abs();
            // Where there is no height, the border between classes may lie anywhere.
            weight * if step.is_nan() { 0.5 } else { (1.0 - step).max(floor) }
        };
        let mut right = vec![0.0; width * rows];
        let mut up = vec![0.0; width * rows];
        for y in 0..rows {
            let row = height.row(y);
            for (out, pair) in right[y * width..].iter_mut().zip(row.windows(2)) {
                *out = between(pair[0], pair[1]);
            }
            if y + 1 < rows {
                for ((out, a), b) in up[y * width..][..width].iter_mut().zip(row).zip(height.row(y + 1)) {
                    *out = between(*a, *b);
                }
            }
        }
        Self { right, up }
    }
}

/// The labels of least energy, by α-expansion from the best class of each pixel, and their energy. `costs` has those of the four
/// classes, pixel by pixel.
///
/// # Errors
/// If a cost is no number.
pub(crate) fn least_energy(
    width: usize,
    height: usize,
    costs: &[f32],
    smoothness: &Smoothness,
) -> Result<(Vec<u8>, f64), Error> {
    let labels = Label::ALL.len();
    let best = |costs: &[f32]| (0..labels).fold(0, |best, l| if costs[l] < costs[best] { l } else { best }) as u8;
    let start: Vec<u8> = costs.chunks_exact(labels).map(best).collect();
    let problem = GridProblem { width, height, labels, unary: costs, right: &smoothness.right, up: &smoothness.up };
    let (labels, report) =
        expand_grid(problem, start, &Options::default()).map_err(|e| Error::GraphCut(e.to_string()))?;
    Ok((labels, report.energy))
}
