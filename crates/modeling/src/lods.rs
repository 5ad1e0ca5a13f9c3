//! The levels of detail of one building from its partition (Zhu 2018, §5.4).

use crate::collapse::short_edges;
use crate::mend::mend;
use crate::partition::{Partition, Region};
use crate::{extrude, junctions, roof};
use gable_city_model::validate::validate_surfaces;
use gable_city_model::{Face, Lods, Semantic, Shell, Tolerances, quantised, validate_solid};
use gable_geometry::{DVec2, DisjointSets, Plane};

/// Length of the cut that parts a non-manifold junction, metres.
const CUT: f64 = 0.05;

/// How far a vertex may leave a straight line and still be dropped, metres.
const STRAIGHT: f64 = 2e-3;

/// Two roofs whose heights differ by less than this along an edge belong to one block of LOD1, metres.
const SAME_BLOCK: f64 = 1.0;

/// The LODs of a building, and why the best one is missing.
pub(crate) struct Levels {
    pub(crate) lods: Lods,
    pub(crate) reason: Option<String>,
}

/// Builds all LODs from a partition with a plane for each region and an underside at `base`. What does not pass
/// validation is left out, and the reason is kept.
pub(crate) fn build(partition: &Partition, planes: &[Plane], base: f64, tolerances: &Tolerances) -> Levels {
    let mut reason = None;
    let mut note = |lod: &str, issue: String| {
        reason.get_or_insert(format!("{lod}: {issue}"));
    };
    let lod2 = solids(partition, planes, base, tolerances).unwrap_or_else(|issue| {
        note("LOD2", issue);
        Vec::new()
    });
    let (blocks, heights) = blocks(partition, planes);
    let lod1 = solids(&blocks, &heights, base, tolerances)
        .or_else(|_| {
            // One block at the mean height has no inner walls, in which a step could fail.
            let (whole, mean) = whole(partition, planes);
            solids(&whole, &mean, base, tolerances)
        })
        .unwrap_or_else(|issue| {
            note("LOD1", issue);
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
        note("LOD0", "the outline is no valid polygon".to_owned());
    }
    Levels { lods: Lods { footprint, roof_edge: flat(eaves, true), lod1, lod2 }, reason }
}

/// Edges shorter than these (metres) are collapsed in turn until a shape is valid.
const COARSER: [f64; 3] = [0.0, 0.25, 0.6];

/// Most places that are mended before the whole shape is made coarser.
const MOST_MENDS: usize = 100;

/// One closed shell for each connected part, validated as it will be written. Where one is not valid, the shape is made
/// coarser there; if that does not help, it is made coarser everywhere.
fn solids(partition: &Partition, planes: &[Plane], base: f64, tolerances: &Tolerances) -> Result<Vec<Shell>, String> {
    let mut first = None;
    let (mut part, mut heights) = (partition.clone(), planes.to_vec());
    for _ in 0..MOST_MENDS {
        let defect = match solids_of(prepared(&part, &heights, 0.0), &heights, base, tolerances) {
            Ok(shells) => return Ok(shells),
            Err(defect) => defect,
        };
        let mended = mend(&part, &heights, &defect.outline);
        // What is wrong with the full shape says more than what is wrong with a coarser one.
        first.get_or_insert(defect.message);
        match mended {
            Some(next) => (part, heights) = next,
            None => break,
        }
    }
    for shortest in &COARSER[1..] {
        if let Ok(shells) = solids_of(prepared(partition, planes, *shortest), planes, base, tolerances) {
            return Ok(shells);
        }
    }
    Err(first.unwrap_or_default())
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

fn solids_of(part: Partition, planes: &[Plane], base: f64, tolerances: &Tolerances) -> Result<Vec<Shell>, Defect> {
    let mut out = Vec::new();
    for group in connected(&part) {
        let keep: Vec<Option<Region>> = (0..part.regions).map(|r| group[r].then_some(r)).collect();
        let (mut shell, regions) = extrude::extrude(&part.joined(&keep), planes, base);
        for (face, region) in shell.faces.iter_mut().zip(regions) {
            face.attributes = roof::surface_attributes(&planes[region]);
        }
        let shell = quantised(&shell);
        if let Some(issue) = validate_solid(&shell, tolerances).first() {
            let message = format!("{} (of {} faces)", issue.message, shell.faces.len());
            let corners =
                issue.face.and_then(|f| shell.faces.get(f)).into_iter().flat_map(|f| f.rings.iter().flatten());
            let outline = corners.filter_map(|&v| shell.vertices.get(v as usize)).map(|v| v.truncate()).collect();
            return Err(Defect { message, outline });
        }
        out.push(shell);
    }
    if out.is_empty() {
        let message = "no roof is left above the ground".to_owned();
        return Err(Defect { message, outline: Vec::new() });
    }
    Ok(out)
}

/// Groups of regions that share edges, as flags by region.
fn connected(partition: &Partition) -> Vec<Vec<bool>> {
    let neighbours = neighbours(partition, |_, _| true);
    groups(partition.regions, &neighbours)
        .into_iter()
        .map(|members| {
            let mut flags = vec![false; partition.regions];
            members.into_iter().for_each(|r| flags[r] = true);
            flags
        })
        .collect()
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
        let levels = build(&pair(), &planes, 0.0, &Tolerances::default());
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
        let levels = build(&pair(), &planes, 0.0, &Tolerances::default());
        assert_eq!(levels.lods.lod1[0].faces.len(), 8);
        assert!((levels.lods.lod1[0].volume() - 16.0 * 13.0).abs() < 1e-9);
    }
}
