//! The default method, `planes-first`: planes, then the lines that they and the walls imply.
//!
//! Zhu 2018, §5, with these departures:
//!
//! 1. roof planes come before lines, from region growing instead of RANSAC, and are regularised softly;
//! 2. ridges, hips and valleys are the intersections of planes that meet, not detected lines;
//! 3. walls and steps are fitted to the borders of the plane regions, moved to the middle of the step of the height
//!    map, turned to the facade directions and merged;
//! 4. segments slice the plane only as far as the next segment, not without end;
//! 5. the faces are labelled with a ground label and in cubic metres.

use crate::collapse::{SHORTEST, short_edges};
use crate::creases::{Crease, creases};
use crate::eaves;
use crate::facades;
use crate::faces::{Weights, assign};
use crate::input::BuildingInput;
use crate::leaks;
use crate::lods::STRAIGHT;
use crate::methods::Reconstruction;
use crate::model::LOWEST_EAVE;
use crate::reason::Reason;
use crate::roof_partition::RoofPartition;
use crate::steps::{Profile, offset};
use crate::subdivide::{absorb_small, clip_to_ground, dissolve};
use crate::superstructures::{self, Limits};
use crate::surface::{NONE, complete};
use crate::under_trees;
use crate::webs;
use crate::work;
use gable_arrangement::{Arrangement, Extension, Options, extend, link_loose_ends};
use gable_geometry::{Box2, BoxTree, DVec2, Plane};
use gable_lines::{
    LineSegment, LocalGraphParams, PolylineParams, Ring, fit_polyline, merge_collinear, orthogonalise_local_graph,
    snap_directions, trace_outline, trace_regions,
};
use gable_parameters::{Declaration, Parameters as _, Settings, parameters, within};
use gable_planes::Planes;
use gable_raster::Raster;

/// Two planes that differ by less than this where they touch, metres, meet there; otherwise there is a step.
const MEETING: f64 = 0.5;

/// Smaller sets of pixels of one plane are noise of the labelling, m².
const SPECK: f64 = 1.0;

/// How far a segment runs on beyond the place where it hits another, metres.
const OVERSHOOT: f64 = 0.02;

/// The widest gap at a corner that is closed, metres.
const CORNER_GAP: f64 = 1.5;

/// Where the surface lies further than this from its plane, another plane is looked for, metres.
const UNEXPLAINED: f64 = 1.5;

/// The smallest plane that is looked for where the surface lies as far off as a tower rises, m².
const TOWER_AREA: f64 = 2.0;

/// Half the width of the windows in which they are fitted, metres: on top of a tower of 2 m no wider one lies in all
/// directions.
const TOWER_RADIUS: f64 = 0.4;

/// The steepest plane that is looked for there, degrees.
const STEEPEST: f64 = 83.0;

/// Walls within this angle of a facade direction turn to it, radians (8°).
const SNAP: f64 = 0.14;

/// How far the ends of a wall may move while it turns, metres.
const TURNED: f64 = 0.5;

/// How far a line of intersection may lie from the border between its planes, metres.
const CREASE_REACH: f64 = 1.2;

/// The default method.
#[derive(Debug)]
pub struct PlanesFirst;

parameters! {
    /// Parameters of the default method.
    pub(crate) struct PlanesFirstParams {
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
        /// Segments grow by this times their length at most, until they hit another one.
        extension: f64 = 3.0, "", within(0.0, 20.0);
        /// Cells smaller than this join a neighbour.
        min_cell_area: f64 = 0.5, "m²", within(0.0, 50.0);
        /// Parts on a roof that are smaller than this, and set off from it by steps, are left out.
        superstructure_area: f64 = 4.0, "m²", within(0.0, 1000.0);
        /// Weight of smoothness against data (Zhu 2018, Eq. 11): of a metre of border, against cubic metres.
        beta: f64 = 0.4, "m³/m", within(0.0, 1000.0);
    }
}

impl Reconstruction for PlanesFirst {
    fn name(&self) -> &'static str {
        "planes-first"
    }

    fn help(&self) -> &'static str {
        "roof planes first, then the lines that they and the walls imply"
    }

    fn parameters(&self) -> &'static [Declaration] {
        PlanesFirstParams::declarations()
    }

    fn reach_under_crowns(&self) -> f64 {
        under_trees::REACH
    }

    fn completed(&self, input: &BuildingInput) -> Option<BuildingInput> {
        let hangs_over = input.crowns.values().contains(&true);
        if hangs_over { under_trees::complete(input, &facade_frames(&outline(input))) } else { None }
    }

    fn reconstruct(
        &self,
        input: &BuildingInput,
        ground: f64,
        most_work: usize,
        settings: &Settings,
    ) -> Result<RoofPartition, Reason> {
        reconstruct(input, ground, most_work, &settings.typed().map_err(Reason::Settings)?)
    }
}

/// Models one building down to its partition. `base` is the height of the ground.
///
/// Where no plane holds on any face, as on small or ragged buildings, the straightened outline of the mask under one
/// level plane is what remains. Where all planes would take more work than the building may, only the larger half of them is
/// modelled, and so on.
fn reconstruct(
    input: &BuildingInput,
    base: f64,
    most_work: usize,
    params: &PlanesFirstParams,
) -> Result<RoofPartition, Reason> {
    let outline = outline(input);
    let frames = facade_frames(&outline);
    let RoofPlanes { mut planes, labels, found, cut_short } = roof_planes(input, &frames, params, most_work);
    let note = |kept: usize| match (kept < found, cut_short) {
        (true, _) => {
            let limit = if kept < params.max_planes { "modeling.work" } else { "modeling.max_planes" };
            Some(format!("only {kept} of {found} roof planes are modelled, as {limit} allows"))
        }
        (false, true) => {
            Some("roof planes may be divided: to compare all is more work than modeling.work allows".to_owned())
        }
        (false, false) => None,
    };
    while !planes.is_empty() {
        let kept = planes.len() as u16;
        let labels = labels.map(|&label| if label < kept { label } else { NONE });
        let mut surface = complete(&labels, &planes, &input.height, &input.mask);
        let left = webs::without(input, &mut surface, &planes);
        let seen = left.as_ref().unwrap_or(input);
        match with_planes(seen, &planes, surface, &frames, base, params, most_work)? {
            Attempt::Made(made) => return Ok(RoofPartition { note: note(planes.len()), ..made }),
            Attempt::NoRoof => break,
            Attempt::TooMuchWork => planes.truncate(planes.len() / 2),
        }
    }
    let note =
        planes.is_empty().then(|| "no roof plane is modelled: each is more work than modeling.work allows".to_owned());
    let level = [Plane::horizontal(median_height(input))];
    let all = input.mask.map(|&m| if m { 0 } else { NONE });
    let coarse = PlanesFirstParams { collinear: 0.0, beta: 0.0, min_cell_area: 0.0, ..params.clone() };
    // The outline under one plane is no more work than its pixels.
    match with_planes(input, &level, all, &[], base, &coarse, usize::MAX)? {
        Attempt::Made(made) => Ok(RoofPartition { note, ..made }),
        Attempt::NoRoof | Attempt::TooMuchWork => Err(Reason::NoRoof),
    }
}

/// What comes of modelling a building with given planes.
enum Attempt {
    /// Its partition.
    Made(RoofPartition),
    /// No plane covers any face.
    NoRoof,
    /// It was given up, for it would take more work than the building may.
    TooMuchWork,
}

/// The partition for given planes, and which of them each pixel of the mask lies on, with `most_work` for each step.
fn with_planes(
    input: &BuildingInput,
    planes: &[Plane],
    mut surface: Raster<u16>,
    frames: &[f64],
    base: f64,
    params: &PlanesFirstParams,
    most_work: usize,
) -> Result<Attempt, Reason> {
    let limits = Limits { area: params.superstructure_area, speck: SPECK, step: MEETING };
    superstructures::remove(&mut surface, planes, limits);
    let creases = creases(&surface, planes, MEETING, CREASE_REACH, 0.5 * params.line_length);
    let mut walls = walls(input, &surface, planes, frames, params);
    let weights = Weights { beta: params.beta, truncation: 1.0, stranger: 0.1 };
    let Some(mut arrangement) = arrange(&walls, &creases, params, most_work) else { return Ok(Attempt::TooMuchWork) };
    let label = |arrangement: &Arrangement| {
        assign(arrangement, planes, &surface, &input.height, weights, most_work)
            .map_err(|e| Reason::GraphCut(e.to_string()))
    };
    let Some(mut faces) = label(&arrangement)? else { return Ok(Attempt::TooMuchWork) };
    let roof: Vec<bool> = faces.iter().map(Option::is_some).collect();
    let missing = leaks::missing_walls(outline(input), &arrangement, &roof, &input.mask);
    if !missing.is_empty() {
        walls.extend(missing);
        // Without room for the walls that are missing, the faces stay as they are.
        if let Some(better) = arrange(&walls, &creases, params, most_work)
            && let Some(labels) = label(&better)?
        {
            (arrangement, faces) = (better, labels);
        }
    }
    let (partition, regions) = dissolve(&arrangement, &faces);
    let (partition, regions) = absorb_small(partition, regions, params.min_cell_area);
    let planes = regions.iter().map(|&r| planes[r as usize]).collect();
    let (partition, planes) = clip_to_ground(partition, planes, base + LOWEST_EAVE);
    let partition = short_edges(&partition.straightened(STRAIGHT), SHORTEST);
    let made = RoofPartition { partition, planes, note: None };
    Ok(if made.planes.is_empty() { Attempt::NoRoof } else { Attempt::Made(made) })
}

/// The outline of the mask as straight segments.
fn outline(input: &BuildingInput) -> Vec<LineSegment> {
    let fit = |ring: &Ring| fit_polyline(&ring.middles(), &PolylineParams::default());
    trace_outline(&input.mask).iter().flat_map(fit).collect()
}

/// The planes of a roof, the largest first, regularised.
struct RoofPlanes {
    planes: Vec<Plane>,
    /// The plane that each pixel supports.
    labels: Raster<u16>,
    /// How many were found, those that are left out among them.
    found: usize,
    /// Whether the search ended before its time.
    cut_short: bool,
}

/// The planes of the roof. A building without any plane gets a level one at its median height.
fn roof_planes(input: &BuildingInput, frames: &[f64], params: &PlanesFirstParams, most_work: usize) -> RoofPlanes {
    let all = |planes: Vec<Plane>, labels| RoofPlanes { found: planes.len(), planes, labels, cut_short: false };
    if let Some(known) = &input.roof {
        return all(known.planes.clone(), known.labels.clone());
    }
    let detection = gable_planes::Params {
        distance: params.plane_distance,
        angle: params.plane_angle,
        min_area: params.plane_area,
        most_pairs: most_work / work::PAIR,
        ..Default::default()
    };
    let mut found = gable_planes::detect(&input.height, Some(&input.normal), &input.mask, &detection);
    if found.planes.is_empty() {
        return all(vec![Plane::horizontal(median_height(input))], input.mask.map(|&m| if m { 0 } else { NONE }));
    }
    let spires = gable_planes::Params { max_slope: STEEPEST, ..detection.clone() };
    let towers =
        gable_planes::Params { radius: TOWER_RADIUS, min_area: detection.min_area.min(TOWER_AREA), ..detection };
    let mut off = deviation(input, &found);
    if explain_rest(input, &mut found, &off, UNEXPLAINED, &spires) {
        off = deviation(input, &found);
    }
    explain_rest(input, &mut found, &off, superstructures::TALL, &towers);
    gable_planes::regularise(&mut found, &input.height, frames, &Default::default());
    let planes = found.planes.iter().map(|p| p.plane).take(params.max_planes.min(usize::from(NONE))).collect();
    RoofPlanes { planes, labels: found.labels, found: found.planes.len(), cut_short: found.cut_short }
}

/// How far the surface lies off the planes that were found, continued over the whole building, metres; NaN outside of it.
fn deviation(input: &BuildingInput, found: &Planes) -> Raster<f32> {
    let planes: Vec<Plane> = found.planes.iter().map(|p| p.plane).collect();
    let surface = complete(&found.labels, &planes, &input.height, &input.mask);
    let window = input.window();
    let mut off = input.height.clone();
    for (p, (off, &label)) in off.values_mut().iter_mut().zip(surface.values()).enumerate() {
        *off = if label == NONE {
            f32::NAN
        } else {
            let at = window.centre(p % window.width, p / window.width);
            (f64::from(*off) - planes[label as usize].height(at)).abs() as f32
        };
    }
    off
}

/// Looks for planes once more where the surface lies further than `from`, metres, off what was found: the storeys of a
/// pagoda and the sides of a steep spire are no roofs at first sight, but they are even less a part of the roof beside them.
/// Returns whether there are any.
fn explain_rest(
    input: &BuildingInput,
    found: &mut Planes,
    off: &Raster<f32>,
    from: f64,
    detection: &gable_planes::Params,
) -> bool {
    let rest = off.map(|&off| f64::from(off) > from);
    if !rest.values().contains(&true) {
        return false;
    }
    let more = gable_planes::detect(&input.height, None, &rest, detection);
    let first = found.planes.len() as u16;
    for (to, &label) in found.labels.values_mut().iter_mut().zip(more.labels.values()) {
        if label != NONE {
            *to = first + label;
        }
    }
    found.planes.extend(more.planes);
    found.cut_short |= more.cut_short;
    found.planes.len() > usize::from(first)
}

fn median_height(input: &BuildingInput) -> f64 {
    let inside = input.height.values().iter().zip(input.mask.values()).filter(|&(z, &m)| m && !z.is_nan());
    let mut heights: Vec<f32> = inside.map(|(&z, _)| z).collect();
    heights.sort_by(f32::total_cmp);
    heights.get(heights.len() / 2).map_or(0.0, |&z| f64::from(z))
}

/// Walls and steps: the borders of the plane regions as straight segments with the higher side to their left,
/// without those that planes meet in.
fn walls(
    input: &BuildingInput,
    surface: &Raster<u16>,
    planes: &[Plane],
    frames: &[f64],
    params: &PlanesFirstParams,
) -> Vec<LineSegment> {
    let mut found = Vec::new();
    let mut rings = trace_regions(surface, NONE);
    rings.sort_by_key(|(plane, _)| *plane);
    for (_, ring) in &rings {
        found.extend(fit_polyline(&ring.middles(), &PolylineParams::default()));
    }
    found.retain(|s| s.length() >= 0.75 * params.line_length && is_step(s, surface, planes));
    for segment in &mut found {
        // A long wall knows its direction better than the frame does.
        let most = (2.0 * TURNED / segment.length()).atan();
        snap_directions(std::slice::from_mut(segment), frames, SNAP.min(most));
        if let Some((shift, share)) = offset(segment, &input.height, Profile { reach: 1.2, step: 0.5 }) {
            move_across(segment, shift);
            segment.weight *= 0.5 + share;
        }
        if is_outer(segment, surface)
            && let Some(shift) = facades::offset(segment, &input.walls)
        {
            move_across(segment, shift);
        }
    }
    if params.collinear <= 0.0 {
        return found;
    }
    let found = orthogonalise_local_graph(found, &ALIGNMENT);
    let mut found = merge_collinear(found, params.collinear);
    eaves::level(&mut found, surface, planes);
    found
}

/// Moves a segment to its left, metres.
fn move_across(segment: &mut LineSegment, shift: f64) {
    let across = segment.vector().normalize_or_zero().perp() * shift;
    segment.a += across;
    segment.b += across;
}

/// Walls on both sides of a gap, too far apart to be merged, come to lie on one line; so do those that no facade
/// direction takes. The published angle of 15° would turn walls that are meant to be oblique.
const ALIGNMENT: LocalGraphParams = LocalGraphParams { distance: 0.3, angle: 0.03, max_drift: 0.35, radius: 30.0 };

/// Whether a wall has nothing of the building to its right, along most of its length.
fn is_outer(segment: &LineSegment, surface: &Raster<u16>) -> bool {
    let Some(unit) = segment.vector().try_normalize() else { return false };
    let beyond = -BEYOND * unit.perp();
    let count = (segment.length() / surface.window().step).ceil().max(1.0);
    let outside = (0..count as usize).filter(|&i| {
        let at = segment.a + segment.vector() * ((i as f64 + 0.5) / count) + beyond;
        surface.at(at).is_none_or(|&label| label == NONE)
    });
    outside.count() as f64 > 0.5 * count
}

/// How far beyond a wall its other side is looked at, metres.
const BEYOND: f64 = 0.6;

/// Whether a border segment is a wall or a step down: the label to its right lies outside or is a lower plane. (Seen
/// from the lower plane, the same step is a segment of the higher one.)
fn is_step(segment: &LineSegment, surface: &Raster<u16>, planes: &[Plane]) -> bool {
    let along = segment.b - segment.a;
    let Some(unit) = along.try_normalize() else { return false };
    let left = unit.perp();
    let pixel = surface.window().step;
    let count = ((along.length() / pixel) as usize).max(2);
    let mut steps = 0;
    for i in 0..count {
        let at = segment.a + along * ((i as f64 + 0.5) / count as f64);
        let label = |side: f64| surface.at(at + left * side * 1.5 * pixel).copied().unwrap_or(NONE);
        steps += usize::from(match (label(1.0), label(-1.0)) {
            (a, b) if a == b => false,
            (_, NONE) => true,
            (NONE, _) => false,
            (a, b) => planes[a as usize].height(at) - planes[b as usize].height(at) >= MEETING,
        });
    }
    2 * steps > count
}

/// Facade directions (radians, modulo 90°), the strongest first, from the lengths of the wall segments.
fn facade_frames(walls: &[LineSegment]) -> Vec<f64> {
    let normals = walls.iter().map(|s| (s.vector().to_angle(), s.length()));
    let frames = gable_planes::facade_directions::histogram(normals, &Default::default());
    frames.into_iter().map(|f| f.angle).collect()
}

/// The subdivision of the plane by walls and creases; `None` if so many of them come near each other that it would take
/// more than `most_work`.
fn arrange(
    walls: &[LineSegment],
    creases: &[Crease],
    params: &PlanesFirstParams,
    most_work: usize,
) -> Option<Arrangement> {
    let ends: Vec<(DVec2, DVec2)> =
        walls.iter().map(|s| (s.a, s.b)).chain(creases.iter().map(|c| (c.a, c.b))).collect();
    let rule = Extension::UntilHit { ratio: params.extension, limit: 2.0, touch: 1e-3 };
    // Ends that only just touch may miss each other by rounding: overshoot, and let the loose ends be pruned.
    let overshoot = |(a, b): (DVec2, DVec2)| {
        let along = (b - a).normalize_or_zero() * OVERSHOOT;
        (a - along, b + along)
    };
    let mut lines: Vec<(DVec2, DVec2)> = extend(&ends, rule).into_iter().map(overshoot).collect();
    // A jog too short to be a wall leaves a corner open, and all behind it would be outside.
    let links = link_loose_ends(&lines, walls.len(), CORNER_GAP, 2.0 * OVERSHOOT);
    lines.extend(links);
    // Nothing snaps to more than a lattice of a millimetre: planes must still meet in their creases.
    has_pairs_up_to(&lines, most_work / work::PAIR).then(|| Arrangement::build(&lines, &Options::default()))
}

/// Whether no more than `most` pairs of lines have boxes that meet: only they can cross.
fn has_pairs_up_to(lines: &[(DVec2, DVec2)], most: usize) -> bool {
    let boxes: Vec<Box2> = lines.iter().map(|&(a, b)| Box2::of([a, b])).collect();
    let tree = BoxTree::new(&boxes);
    let mut pairs = 0;
    for own in &boxes {
        // Each line meets itself, and each pair is seen from both sides.
        tree.visit(own, |_| pairs += 1);
        if pairs > most.saturating_mul(2).saturating_add(lines.len()) {
            return false;
        }
    }
    true
}
