//! The levels of detail of one building from its partition (Zhu 2018, §5.4).

use crate::collapse::short_edges;
use crate::mend::mend;
use crate::partition::{Partition, Region};
use crate::reason::Reason;
use crate::{extrude, junctions, roof, work};
use gable_city_model::validate::validate_surfaces;
use gable_city_model::{Face, Lods, Semantic, Shell, Tolerances, quantised, validate_solid};
use gable_geometry::{Box2, DVec2, DisjointSets, Plane};

/// Length of the cut that parts a non-manifold junction, metres.
const CUT: f64 = 0.05;

/// How far a vertex may leave a straight line and still be dropped, metres.
pub(crate) const STRAIGHT: f64 = 2e-3;

/// Two roofs whose heights differ by less than this along an edge belong to one block of LOD1, metres.
const SAME_BLOCK: f64 = 1.0;

/// The LODs of a building, and why the best one is missing.
pub(crate) struct Levels {
    pub(crate) lods: Lods,
    pub(crate) reason: Option<Reason>,
}

/// Builds all LODs from a partition with a plane for each region and an underside at `base`. What does not pass
/// validation is left out, and the reason is kept; so is what would have to be mended with more than `most_work`.
pub(crate) fn build(
    partition: &Partition,
    planes: &[Plane],
    base: f64,
    tolerances: &Tolerances,
    most_work: usize,
) -> Levels {
    let mut reason = None;
    let lod2 = solids(partition, planes, base, tolerances, most_work).unwrap_or_else(|unsound| {
        reason.get_or_insert(unsound.reason("LOD2"));
        Vec::new()
    });
    let (blocks, heights) = blocks(partition, planes);
    let lod1 = solids(&blocks, &heights, base, tolerances, most_work)
        .or_else(|_| {
            // One block at the mean height has no inner walls, in which a step could fail.
            let (whole, mean) = whole(partition, planes);
            solids(&whole, &mean, base, tolerances, most_work)
        })
        .unwrap_or_else(|unsound| {
            reason.get_or_insert(unsound.reason("LOD1"));
            Vec::new()
        });
    let (outline, _) = whole(partition, planes);
    let eaves = eave_height(partition, planes);
    let flat = |z: f64, up: bool| {
        COARSER.into_iter().find_map(|shortest| {
            let shell = quantised(&flat_faces(&outline, z, up, shortest));
            (!shell.faces.is_empty() && validate_surfaces(&shell, tolerances).is_empty()).then_some(shell)
        })
    };
    let footprint = flat(base, false);
    if footprint.is_none() {
        let defect = "the outline is no valid polygon".to_owned();
        reason.get_or_insert(Reason::Invalid { lod: "LOD0", defect });
    }
    Levels { lods: Lods { footprint, roof_edge: flat(eaves, true), lod1, lod2 }, reason }
}

/// Edges shorter than these (metres) are collapsed in turn until a shape is valid.
const COARSER: [f64; 3] = [0.0, 0.25, 0.6];

/// Most times that places are mended before the whole shape is made coarser, and most places each time.
const MOST_ROUNDS: usize = 100;
const MOST_PLACES: usize = 100;

/// Places as near as this to one that was just mended are looked at anew before they are mended too, metres.
const APART: f64 = 3.0;

/// Why no valid shells were found.
struct Unsound {
    /// The first defect of the full shape.
    defect: String,
    /// Whether more of it could have been mended with more work.
    is_beyond_work: bool,
}

impl Unsound {
    fn reason(self, lod: &'static str) -> Reason {
        let Self { defect, is_beyond_work } = self;
        if is_beyond_work { Reason::InvalidBeyondWork { lod, defect } } else { Reason::Invalid { lod, defect } }
    }
}

/// One closed shell for each connected part, validated as it will be written. Where one is not valid, the shape is made
/// coarser there; if that does not help, it is made coarser everywhere. Given up when all that is raised and validated weighs
/// more than `most_work`.
fn solids(
    partition: &Partition,
    planes: &[Plane],
    base: f64,
    tolerances: &Tolerances,
    most_work: usize,
) -> Result<Vec<Shell>, Unsound> {
    let mut first = None;
    let mut work = 0;
    let mut may_raise = |part: &Partition| {
        // The first is raised whatever it weighs: that much is linear.
        let may = work == 0 || work <= most_work;
        work += work::EDGE * part.edges.len();
        may
    };
    let (mut part, mut heights) = (partition.clone(), planes.to_vec());
    for _ in 0..MOST_ROUNDS {
        if !may_raise(&part) {
            return Err(Unsound { defect: first.unwrap_or_default(), is_beyond_work: true });
        }
        let defects = match solids_of(prepared(&part, &heights, 0.0), &heights, base, tolerances) {
            Ok(shells) => return Ok(shells),
            Err(defects) => defects,
        };
        // What is wrong with the full shape says more than what is wrong with a coarser one.
        first = first.or_else(|| defects.first().map(|defect| defect.message.clone()));
        let mended = mend_all(&part, &heights, &defects);
        match mended {
            Some(next) => (part, heights) = next,
            None => break,
        }
    }
    for shortest in &COARSER[1..] {
        if may_raise(partition)
            && let Ok(shells) = solids_of(prepared(partition, planes, *shortest), planes, base, tolerances)
        {
            return Ok(shells);
        }
    }
    Err(Unsound { defect: first.unwrap_or_default(), is_beyond_work: false })
}

/// Mends the first of some defects, and those that are far enough from each other to have nothing to do with it; `None` if
/// the first cannot be mended.
fn mend_all(partition: &Partition, planes: &[Plane], defects: &[Defect]) -> Option<(Partition, Vec<Plane>)> {
    let mut mended: Option<(Partition, Vec<Plane>)> = None;
    let mut places: Vec<Box2> = Vec::new();
    for defect in defects.iter().take(MOST_PLACES) {
        let place = Box2::of(defect.outline.iter().copied()).grown(APART);
        if places.iter().any(|other| other.intersects(&place)) {
            continue;
        }
        let (part, heights) = mended.as_ref().map_or((partition, planes), |(part, heights)| (part, heights));
        match mend(part, heights, &defect.outline) {
            Some(next) => mended = Some(next),
            // It will be the first of those that remain.
            None if mended.is_some() => continue,
            None => return None,
        }
        places.push(place);
    }
    mended
}

/// Why a shell is not valid, and the outline of the face that is to blame, on the ground.
struct Defect {
    message: String,
    outline: Vec<DVec2>,
}

/// A partition without needless vertices, edges shorter than `shortest` and non-manifold junctions.
fn prepared(partition: &Partition, planes: &[Plane], shortest: f64) -> Partition {
    let mut part = partition.straightened(STRAIGHT);
    if shortest > 0.0 {
        part = short_edges(&part, shortest).straightened(STRAIGHT);
    }
    junctions::split(&mut part, planes, extrude::WELD, CUT);
    part
}

/// A shell for each connected part, or all that is wrong with any of them.
fn solids_of(part: Partition, planes: &[Plane], base: f64, tolerances: &Tolerances) -> Result<Vec<Shell>, Vec<Defect>> {
    let mut out = Vec::new();
    let mut defects = Vec::new();
    let groups = groups(part.regions, &neighbours(&part, |_, _| true));
    for (group, part) in groups.iter().zip(part.parts(&groups)) {
        let planes: Vec<Plane> = group.iter().map(|&r| planes[r]).collect();
        let (mut shell, regions) = extrude::extrude(&part, &planes, base);
        for (face, region) in shell.faces.iter_mut().zip(regions) {
            face.attributes = roof::surface_attributes(&planes[region]);
        }
        let shell = quantised(&shell);
        for issue in validate_solid(&shell, tolerances) {
            let message = format!("{} (of {} faces)", issue.message, shell.faces.len());
            let corners =
                issue.face.and_then(|f| shell.faces.get(f)).into_iter().flat_map(|f| f.rings.iter().flatten());
            let outline = corners.filter_map(|&v| shell.vertices.get(v as usize)).map(|v| v.truncate()).collect();
            defects.push(Defect { message, outline });
        }
        out.push(shell);
    }
    if out.is_empty() {
        let message = "no roof is left above the ground".to_owned();
        defects.push(Defect { message, outline: Vec::new() });
    }
    if defects.is_empty() { Ok(out) } else { Err(defects) }
}

/// Pairs of regions that share an edge for which `joins` holds, each once as (smaller, larger).
fn neighbours(partition: &Partition, joins: impl Fn(usize, usize) -> bool) -> Vec<(Region, Region)> {
    let index = partition.index();
    let mut out = Vec::new();
    for (i, e) in partition.edges.iter().enumerate() {
        if let Some(&twin) = index.get(&(e.to, e.from))
            && i < twin
            && joins(i, twin)
        {
            let other = partition.edges[twin].region;
            out.push((e.region.min(other), e.region.max(other)));
        }
    }
    out
}

fn groups(count: usize, pairs: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let mut sets = DisjointSets::new(count);
    for &(a, b) in pairs {
        sets.join(a, b);
    }
    sets.sets()
}

/// Mean height of each region's plane, as the height at its centroid, and its area.
fn means(partition: &Partition, planes: &[Plane]) -> Vec<(f64, f64)> {
    let mut sums = vec![(DVec2::ZERO, 0.0); partition.regions];
    for (region, ring) in partition.rings() {
        let points = partition.points(&partition.ring_vertices(&ring));
        let (moment, area) = moment(&points);
        sums[region].0 += moment;
        sums[region].1 += area;
    }
    sums.into_iter().zip(planes).map(|((m, area), plane)| (plane.height(m / area.max(1e-12)), area)).collect()
}

/// Area and area times centroid of a ring, signed.
fn moment(ring: &[DVec2]) -> (DVec2, f64) {
    let o = ring[0];
    let (mut m, mut area) = (DVec2::ZERO, 0.0);
    for i in 1..ring.len() - 1 {
        let (a, b) = (ring[i] - o, ring[i + 1] - o);
        let t = 0.5 * a.perp_dot(b);
        m += t * ((a + b) / 3.0 + o);
        area += t;
    }
    (m, area)
}

/// The blocks of LOD1: roofs that meet without a step become one block at their mean height. (The paper raises each
/// face to its own plane's mean, which puts steps between the sides of one hipped roof.)
fn blocks(partition: &Partition, planes: &[Plane]) -> (Partition, Vec<Plane>) {
    let meets = |a: usize, b: usize| {
        let (e, f) = (&partition.edges[a], &partition.edges[b]);
        [e.from, e.to].into_iter().all(|v| {
            let at = partition.vertices[v as usize];
            (planes[e.region].height(at) - planes[f.region].height(at)).abs() < SAME_BLOCK
        })
    };
    let groups = groups(partition.regions, &neighbours(partition, meets));
    join(partition, planes, &groups)
}

/// All regions as one block.
fn whole(partition: &Partition, planes: &[Plane]) -> (Partition, Vec<Plane>) {
    join(partition, planes, &[(0..partition.regions).collect()])
}

fn join(partition: &Partition, planes: &[Plane], groups: &[Vec<usize>]) -> (Partition, Vec<Plane>) {
    let means = means(partition, planes);
    let mut group = vec![None; partition.regions];
    let mut heights = Vec::new();
    for (g, members) in groups.iter().enumerate() {
        let area: f64 = members.iter().map(|&r| means[r].1).sum();
        let height = members.iter().map(|&r| means[r].0 * means[r].1).sum::<f64>() / area.max(1e-12);
        heights.push(Plane::horizontal(height));
        members.iter().for_each(|&r| group[r] = Some(g));
    }
    (partition.joined(&group), heights)
}

/// Horizontal faces over the outline at height `z`.
fn flat_faces(outline: &Partition, z: f64, up: bool, shortest: f64) -> Shell {
    let level = vec![Plane::horizontal(z); outline.regions];
    let part = prepared(outline, &level, shortest);
    let turn = |mut ring: Vec<u32>| {
        if !up {
            ring.reverse();
        }
        ring
    };
    let semantic = if up { Semantic::RoofSurface } else { Semantic::GroundSurface };
    let faces = part
        .region_faces()
        .into_iter()
        .flatten()
        .map(|rings| Face { rings: rings.into_iter().map(turn).collect(), semantic, attributes: Default::default() })
        .collect();
    Shell { vertices: part.vertices.iter().map(|v| v.extend(z)).collect(), faces }
}

/// Mean height of the roof along the outline, weighted by length.
pub(crate) fn eave_height(partition: &Partition, planes: &[Plane]) -> f64 {
    let index = partition.index();
    let (mut sum, mut length) = (0.0, 0.0);
    for e in partition.edges.iter().filter(|e| !index.contains_key(&(e.to, e.from))) {
        let (a, b) = (partition.vertices[e.from as usize], partition.vertices[e.to as usize]);
        let l = a.distance(b);
        sum += l * planes[e.region].height(0.5 * (a + b));
        length += l;
    }
    sum / length.max(1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::tests::pair;

    #[test]
    fn a_gable_house_in_all_lods() {
        let planes = [Plane { a: 0.5, b: 0.0, c: 3.0 }, Plane { a: -0.5, b: 0.0, c: 7.0 }];
        let levels = build(&pair(), &planes, 0.0, &Tolerances::default(), usize::MAX);
        assert_eq!(levels.reason, None);
        let lods = levels.lods;
        assert_eq!((lods.lod2.len(), lods.lod2[0].faces.len()), (1, 7));
        assert_eq!((lods.lod1.len(), lods.lod1[0].faces.len()), (1, 6));
        assert!((lods.lod1[0].volume() - lods.lod2[0].volume()).abs() < 1e-9, "the mean height keeps the volume");
        assert_eq!(lods.footprint.unwrap().vertices.len(), 4);
    }

    #[test]
    fn a_step_gives_two_blocks() {
        let planes = [Plane::horizontal(9.0), Plane::horizontal(4.0)];
        let levels = build(&pair(), &planes, 0.0, &Tolerances::default(), usize::MAX);
        assert_eq!(levels.lods.lod1[0].faces.len(), 8);
        assert!((levels.lods.lod1[0].volume() - 16.0 * 13.0).abs() < 1e-9);
    }
}
