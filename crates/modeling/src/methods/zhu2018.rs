//! The published method, `zhu2018`, as a baseline: Zhu et al. 2018, §5, with the figures of the paper.
//!
//! What the paper leaves open is decided as plainly as possible and said at the place: the angle thresholds (20°), how
//! far segments extend (each end by three times their length: the authors' next paper, Han 2021, §V, calls a ratio of 2 to 4
//! usual, and whole lines cut a hall of 200 m into millions of cells), RANSAC's parameters, and the ground, which is
//! whatever lies mostly outside the building's mask. Cells under the smallest area and edges under a decimetre are removed, as
//! in the default method: long lines leave slivers that no validator passes.

use crate::collapse::{SHORTEST, short_edges};
use crate::input::BuildingInput;
use crate::lods::STRAIGHT;
use crate::methods::{Needs, Reconstruction};
use crate::model::LOWEST_EAVE;
use crate::reason::Reason;
use crate::roof_partition::RoofPartition;
use crate::subdivide::{absorb_small, clip_to_ground, dissolve};
use gable_arrangement::{Arrangement, Extension, Options, extend};
use gable_geometry::{Covariance3, DVec2, DVec3, Plane};
use gable_graph_cut::{GraphProblem, expand};
use gable_lines::{LineSegment, LsdParams, Source, detect_segments, grey, merge_collinear, snap_directions};
use gable_parameters::{Declaration, Parameters as _, Settings, parameters, within};
use gable_planes::{facade_directions, facade_segments, ransac, roof_directions, vsa};
use gable_raster::Raster;

/// Hypotheses of each RANSAC.
const ITERATIONS: usize = 400;

/// Seed of everything random.
const SEED: u64 = 2018;

/// The published method.
#[derive(Debug)]
pub struct Zhu2018;

parameters! {
    /// Parameters of the published method.
    pub(crate) struct Zhu2018Params {
        /// Faces within this angle of the vertical are facades.
        facade_angle: f64 = 20.0, "°", within(1.0, 60.0);
        /// How far a roof point may lie from its plane.
        plane_distance: f64 = 0.3, "m", within(0.02, 5.0);
        /// How far a roof point's normal may turn from its plane's.
        plane_angle: f64 = 20.0, "°", within(1.0, 60.0);
        /// Smallest area of a roof plane.
        plane_area: f64 = 3.0, "m²", within(0.1, 100.0);
        /// Most planes of one building.
        max_planes: usize = 200, "", within(1.0, 10_000.0);
        /// Shortest line segment that is kept.
        line_length: f64 = 1.0, "m", within(0.1, 50.0);
        /// Parallel segments closer than this become one (Zhu 2018, §5.2).
        collinear: f64 = 0.5, "m", within(0.0, 5.0);
        /// Segments grow by this times their length at each end before they slice the plane.
        extension: f64 = 3.0, "", within(0.0, 20.0);
        /// Cells smaller than this join a neighbour.
        min_cell_area: f64 = 0.5, "m²", within(0.0, 50.0);
        /// Weight of smoothness against data (Zhu 2018, Eq. 11), where data is summed over pixels.
        beta_pixel: f64 = 10.0, "m/m", within(0.0, 100_000.0);
    }
}

impl Reconstruction for Zhu2018 {
    fn name(&self) -> &'static str {
        "zhu2018"
    }

    fn help(&self) -> &'static str {
        "the published rules of Zhu et al. 2018, §5, as a baseline"
    }

    fn parameters(&self) -> &'static [Declaration] {
        Zhu2018Params::declarations()
    }

    fn needs(&self) -> Needs {
        Needs { facets: true }
    }

    // The published method knows no limit of work: its steps are what they are.
    fn reconstruct(
        &self,
        input: &BuildingInput,
        ground: f64,
        _most_work: usize,
        settings: &Settings,
    ) -> Result<RoofPartition, Reason> {
        reconstruct(input, ground, &settings.typed().map_err(Reason::Settings)?)
    }
}

/// Models one building down to its partition. `base` is the height of the ground.
fn reconstruct(input: &BuildingInput, base: f64, params: &Zhu2018Params) -> Result<RoofPartition, Reason> {
    let frames = facade_frame(input, params);
    let mut segments = line_segments(input, &frames, params);
    // Regularisation: turn to the facade directions, then merge what is collinear.
    snap_directions(&mut segments, &frames, params.facade_angle.to_radians());
    let mut segments = merge_collinear(segments, params.collinear);
    segments.retain(|s| s.length() >= params.line_length);
    let planes = roof_planes(input, &frames, params);
    if planes.is_empty() {
        return Err(Reason::NoPlanes);
    }
    let ends: Vec<(DVec2, DVec2)> = segments.iter().map(|s| (s.a, s.b)).collect();
    let lines = extend(&ends, Extension::Factor(params.extension));
    let arrangement = Arrangement::build(&lines, &Options::default());
    let faces = assign(&arrangement, &planes, input, params)?;
    let (partition, regions) = dissolve(&arrangement, &faces);
    let (partition, regions) = absorb_small(partition, regions, params.min_cell_area);
    let planes = regions.iter().map(|&r| planes[r as usize]).collect();
    let (partition, planes) = clip_to_ground(partition, planes, base + LOWEST_EAVE);
    let partition = short_edges(&partition.straightened(STRAIGHT), SHORTEST);
    if planes.is_empty() {
        return Err(Reason::NoFaces);
    }
    Ok(RoofPartition { partition, planes, note: None })
}

/// Facade directions (§5.1, Eq. 7): one frame of two orthogonal axes, from the horizontal projections of the normals
/// of nearly vertical faces.
fn facade_frame(input: &BuildingInput, params: &Zhu2018Params) -> Vec<f64> {
    let normals: Vec<DVec2> =
        input.facets.iter().filter_map(|[a, b, c]| (*b - *a).cross(*c - *a).truncate().try_normalize()).collect();
    facade_directions::ransac(&normals, params.facade_angle, ITERATIONS, SEED).map(|f| f.angle).into_iter().collect()
}

/// Segments of image, facades, height map and the two maps of directional normal variation, stacked (§5.2). Those
/// outside the building's surroundings are left out.
fn line_segments(input: &BuildingInput, frames: &[f64], params: &Zhu2018Params) -> Vec<LineSegment> {
    let mut out = Vec::new();
    let mut detect = |raster: &Raster<f32>, source: Source, lsd: LsdParams| {
        out.extend(detect_segments(raster, source, &lsd).into_iter().map(|d| d.segment));
    };
    if let Some(colour) = &input.colour {
        let seen = |p: usize| input.height.values()[p].is_finite();
        detect(&grey(colour, seen), Source::Image, LsdParams::image());
    }
    detect(&input.height, Source::Height, LsdParams::height(input.window().step));
    for axis in frames.iter().flat_map(|&a| [DVec2::from_angle(a), DVec2::from_angle(a).perp()]) {
        let (x, y) = (axis.x as f32, axis.y as f32);
        let variation = input.normal.map(|n| if *n == [0.0; 3] { f32::NAN } else { n[0] * x + n[1] * y });
        detect(&variation, Source::Normal, LsdParams::normal());
    }
    let proxies = vsa::approximate(&input.facets, &vsa::Params { seed: SEED, ..Default::default() });
    let walls = facade_segments(&input.facets, &proxies, params.facade_angle);
    out.extend(walls.into_iter().map(|(a, b, weight)| LineSegment { a, b, weight, source: Source::Facade }));
    let near = grown(&input.mask, (1.0 / input.window().step).ceil() as usize);
    out.retain(|s| near.at(s.middle()).copied().unwrap_or(false));
    out
}

/// The mask with all pixels within `reach` rows and columns.
fn grown(mask: &Raster<bool>, reach: usize) -> Raster<bool> {
    let (w, h) = (mask.width(), mask.height());
    let mut out = mask.clone();
    for pass in 0..2 {
        let from = out.clone();
        for y in 0..h {
            for x in 0..w {
                let (i, n) = if pass == 0 { (x, w) } else { (y, h) };
                let span = i.saturating_sub(reach)..=(i + reach).min(n - 1);
                out[(x, y)] = span.into_iter().any(|k| if pass == 0 { from[(k, y)] } else { from[(x, k)] });
            }
        }
    }
    out
}

/// Roof directions (Eq. 8) and, along them, roof planes by RANSAC on the height map (§5.3).
fn roof_planes(input: &BuildingInput, frames: &[f64], params: &Zhu2018Params) -> Vec<Plane> {
    let inside = input.normal.values().iter().zip(input.mask.values()).filter(|(n, m)| **m && n[2] > 0.3);
    let normals: Vec<DVec3> = inside.map(|(n, _)| DVec3::from_array(n.map(f64::from))).collect();
    let directions = roof_directions::ransac(&normals, frames, params.facade_angle, 0.05, ITERATIONS, SEED);
    let detection = ransac::Params {
        distance: params.plane_distance,
        angle: params.plane_angle,
        min_area: params.plane_area,
        seed: SEED,
        ..Default::default()
    };
    let mut found = ransac::detect(&input.height, &input.mask, &directions, &detection).planes;
    found.truncate(params.max_planes);
    found.into_iter().map(|p| p.plane).collect()
}

/// The MRF over the faces (§5.4, Eq. 9–11): sums of point–plane distances over the pixels, smoothness by length
/// and planarity of the points of both faces. Faces of which less than half lies in the mask are ground.
fn assign(
    arrangement: &Arrangement,
    planes: &[Plane],
    input: &BuildingInput,
    params: &Zhu2018Params,
) -> Result<Vec<Option<u16>>, Reason> {
    let window = input.window();
    let count = arrangement.faces().len();
    let owner = arrangement.face_raster(window.x0, window.y0, window.width, window.height, window.step);
    let mut points = vec![Covariance3::default(); count];
    let mut inside = vec![(0usize, 0usize); count];
    let mut unary = vec![0.0; count * planes.len()];
    for (p, &face) in owner.iter().enumerate() {
        let face = face as usize;
        inside[face].1 += 1;
        inside[face].0 += usize::from(input.mask.values()[p]);
        let z = input.height.values()[p];
        if face == 0 || !z.is_finite() {
            continue;
        }
        let point = window.centre(p % window.width, p / window.width).extend(f64::from(z));
        points[face].add(point, 1.0);
        for (cost, plane) in unary[face * planes.len()..].iter_mut().zip(planes) {
            *cost += plane.distance(point).abs();
        }
    }
    let smoothness = |a: u32, b: u32| {
        let mut both = points[a as usize];
        both.merge(&points[b as usize]);
        let l = both.eigen().0;
        let sum: f64 = l.iter().sum();
        if sum > 0.0 { 1.0 - 3.0 * l[0] / sum } else { 1.0 }
    };
    let edges = arrangement
        .edges()
        .filter(|e| e.left != 0 && e.right != 0)
        .map(|e| (e.left, e.right, params.beta_pixel * e.length * smoothness(e.left, e.right)))
        .collect();
    let start = gable_graph_cut::data_optimum(planes.len(), &unary);
    let problem = GraphProblem { labels: planes.len(), unary, edges };
    let (labels, _) = expand(&problem, start, &Default::default()).map_err(|e| Reason::GraphCut(e.to_string()))?;
    let is_ground = |f: usize| f == 0 || 2 * inside[f].0 <= inside[f].1;
    Ok(labels.into_iter().enumerate().map(|(f, l)| (!is_ground(f)).then_some(l)).collect())
}
