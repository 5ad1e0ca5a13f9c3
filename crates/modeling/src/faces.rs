//! Which roof plane covers each face of the arrangement: an MRF over the faces.
//!
//! Zhu 2018, §5.4, Eq. 9–11. Departures of the default: the data term is a volume (m³), so that the balance does not
//! depend on the pixel size; distances are vertical and truncated; there is a ground label; and a plane may only
//! cover faces near its own inliers.

use crate::surface::NONE;
use gable_arrangement::Arrangement;
use gable_geometry::Plane;
use gable_graph_cut::{GraphProblem, Options, expand};
use gable_raster::Raster;

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
/// ground. `surface` is the pixel labelling, whose `NONE` lies outside the building. Nothing if holding pixels against the
/// planes near their faces would be done more than `most_work` times.
pub(crate) fn assign(
    arrangement: &Arrangement,
    planes: &[Plane],
    surface: &Raster<u16>,
    height: &Raster<f32>,
    weights: Weights,
    most_work: usize,
) -> Result<Option<Vec<Option<u16>>>, gable_graph_cut::Error> {
    let window = surface.window();
    let count = arrangement.faces().len();
    let labels = planes.len() + 1;
    let ground = planes.len();
    let pixel_area = window.step * window.step;
    let owner = arrangement.face_raster(window.x0, window.y0, window.width, window.height, window.step);

    let mut pixels = vec![0usize; count];
    let mut present: Vec<Vec<u16>> = vec![Vec::new(); count];
    for (p, &face) in owner.iter().enumerate() {
        pixels[face as usize] += 1;
        let plane = surface.values()[p];
        let own = &mut present[face as usize];
        if plane != NONE && own.last() != Some(&plane) {
            own.push(plane);
            // Rows of pixels name the same planes again and again.
            if own.len().is_power_of_two() {
                own.sort_unstable();
                own.dedup();
            }
        }
    }
    let near = spread(arrangement, present);
    let work: usize = pixels.iter().zip(&near).map(|(pixels, planes)| pixels * planes.len()).sum();
    if work.max(count * labels) > most_work {
        return Ok(None);
    }

    // Large against any sum of costs, small enough to keep f64 sums exact to a millilitre.
    let forbidden = 1e7;
    let mut unary = vec![forbidden; count * labels];
    for (face, planes) in near.iter().enumerate() {
        unary[face * labels + ground] = 0.0;
        for &plane in planes {
            unary[face * labels + usize::from(plane)] = 0.0;
        }
    }
    let mut add = |face: usize, pixel: usize, area: f64| {
        let own = surface.values()[pixel];
        let z = height.values()[pixel];
        let at = window.centre(pixel % window.width, pixel / window.width);
        let costs = &mut unary[face * labels..(face + 1) * labels];
        let inside = own != NONE;
        costs[ground] += if inside { area * weights.truncation } else { 0.0 };
        for &plane in &near[face] {
            let residual = match (inside, z.is_nan()) {
                (false, _) => weights.truncation,
                (true, true) => 0.0,
                (true, false) => (f64::from(z) - planes[usize::from(plane)].height(at)).abs().min(weights.truncation),
            };
            let cost = &mut costs[usize::from(plane)];
            *cost += area * residual;
            // Everything but the pixel's own plane and the ground pays.
            if inside {
                *cost += area * weights.stranger;
            }
            if plane == own {
                *cost -= area * weights.stranger;
            }
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
    let edges =
        arrangement.edges().filter(|e| e.left != e.right).map(|e| (e.left, e.right, weights.beta * e.length)).collect();
    let problem = GraphProblem { labels, unary, edges };
    let start = gable_graph_cut::data_optimum(labels, &problem.unary);
    let (labelling, _) = expand(&problem, start, &Options::default())?;
    Ok(Some(labelling.into_iter().map(|l| (usize::from(l) != ground).then_some(l)).collect()))
}

/// The planes that may cover each face, ascending: those that have pixels in it or in a face that touches it; none for the
/// unbounded one.
fn spread(arrangement: &Arrangement, mut present: Vec<Vec<u16>>) -> Vec<Vec<u16>> {
    for own in &mut present {
        own.sort_unstable();
        own.dedup();
    }
    let near = |(face, around): (usize, &Vec<(u32, f64)>)| {
        let mut planes = Vec::new();
        if face > 0 {
            planes.extend_from_slice(&present[face]);
            around.iter().for_each(|&(other, _)| planes.extend_from_slice(&present[other as usize]));
        }
        planes.sort_unstable();
        planes.dedup();
        planes
    };
    arrangement.adjacency().iter().enumerate().map(near).collect()
}
