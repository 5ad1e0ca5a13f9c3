//! Which roof plane covers each face of the arrangement: an MRF over the faces.
//!
//! Zhu 2018, §5.4, Eq. 9–11. Departures of the default: the data term is a volume (m³), so that the balance does not
//! depend on the pixel size; distances are vertical and truncated; there is a ground label; and a plane may only
//! cover faces near its own inliers.

use crate::surface::NONE;
use gable_arrangement::Arrangement;
use gable_geometry::Plane;
use gable_graph_cut::{GraphProblem, Options, expand};
use gable_ortho::Raster;

/// Weights of the labelling.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    /// Cost of a metre of border between two labels, m³.
    pub(crate) beta: f64,
    /// Distance at which a residual is cut off, metres: the cost of a pixel that no label explains.
    pub(crate) truncation: f64,
    /// What a pixel pays for a plane that is not its own in the pixel labelling, metres.
    pub(crate) stranger: f64,
}

/// A label for each face of the arrangement: an index into `planes`, or `None` for ground. The unbounded face is
/// ground. `surface` is the pixel labelling, whose `NONE` lies outside the building.
pub(crate) fn assign(
    arrangement: &Arrangement,
    planes: &[Plane],
    surface: &Raster<u16>,
    height: &Raster<f32>,
    weights: Weights,
) -> Result<Vec<Option<u16>>, gable_graph_cut::Error> {
    let window = surface.window();
    let count = arrangement.faces().len();
    let labels = planes.len() + 1;
    let ground = planes.len();
    let pixel_area = window.step * window.step;
    let owner = arrangement.face_raster(window.x0, window.y0, window.width, window.height, window.step);

    let mut pixels = vec![0usize; count];
    let mut present = vec![false; count * planes.len()];
    for (p, &face) in owner.iter().enumerate() {
        pixels[face as usize] += 1;
        let plane = surface.values()[p];
        if plane != NONE {
            present[face as usize * planes.len() + plane as usize] = true;
        }
    }
    let near = spread(arrangement, &present, planes.len());

    let mut unary = vec![0.0; count * labels];
    let mut add = |face: usize, pixel: usize, area: f64| {
        let own = surface.values()[pixel];
        let z = height.values()[pixel];
        let at = window.centre(pixel % window.width, pixel / window.width);
        let costs = &mut unary[face * labels..(face + 1) * labels];
        let inside = own != NONE;
        costs[ground] += if inside { area * weights.truncation } else { 0.0 };
        for (plane, cost) in planes.iter().zip(costs) {
            let residual = match (inside, z.is_nan()) {
                (false, _) => weights.truncation,
                (true, true) => 0.0,
                (true, false) => (f64::from(z) - plane.height(at)).abs().min(weights.truncation),
            };
            *cost += area * residual;
        }
        if inside {
            // Everything but the pixel's own plane and the ground pays.
            for cost in &mut unary[face * labels..face * labels + ground] {
                *cost += area * weights.stranger;
            }
            unary[face * labels + own as usize] -= area * weights.stranger;
        }
    };
    for (p, &face) in owner.iter().enumerate() {
        if face != 0 {
            add(face as usize, p, pixel_area);
        }
    }
    for (f, face) in arrangement.faces().iter().enumerate().skip(1) {
        if pixels[f] == 0
            && let Some((x, y)) = arrangement.point_inside(f as u32).and_then(|at| window.pixel(at))
        {
            add(f, y * window.width + x, face.area);
        }
    }
    // Large against any sum of costs, small enough to keep f64 sums exact to a millilitre.
    let forbidden = 1e7;
    for f in 0..count {
        for l in 0..planes.len() {
            if f == 0 || !near[f * planes.len() + l] {
                unary[f * labels + l] = forbidden;
            }
        }
    }
    let edges =
        arrangement.edges().filter(|e| e.left != e.right).map(|e| (e.left, e.right, weights.beta * e.length)).collect();
    let problem = GraphProblem { labels, unary, edges };
    let start = gable_graph_cut::data_optimum(labels, &problem.unary);
    let (labelling, _) = expand(&problem, start, &Options::default())?;
    Ok(labelling.into_iter().map(|l| (usize::from(l) != ground).then_some(l)).collect())
}

/// A plane may cover the faces that hold its pixels and those that touch one of them.
fn spread(arrangement: &Arrangement, present: &[bool], planes: usize) -> Vec<bool> {
    let mut near = present.to_vec();
    for e in arrangement.edges() {
        for (a, b) in [(e.left, e.right), (e.right, e.left)] {
            for l in 0..planes {
                if present[a as usize * planes + l] {
                    near[b as usize * planes + l] = true;
                }
            }
        }
    }
    near
}
