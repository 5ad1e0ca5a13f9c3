//! Faults of the mesh itself, found city-wide whatever the grid: duplicate faces, slivers, floating parts.

use crate::codec::Seen;
use crate::spill::{Cell, Segment, Spill};
use crate::triangle::{BlockTriangle, UNITS_PER_METRE};
use gable_geometry::DisjointSets;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

/// A part that measures more than this along any axis is no floater, metres.
const FLOATER: f64 = 5.0;
/// A floater keeps at least this far from everything else, metres.
const CLEARANCE: f64 = 0.5;
/// Floaters that are nearer to one another than that are one, of at most this size, metres.
const SWARM: f64 = 2.0 * FLOATER;

/// Floaters that together hold a larger share of the triangles are none: the mesh is a soup, and all of it stays.
const SOUP: f64 = 0.01;

/// What is wrong with a mesh and was left out of its blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Defects {
    /// Triangles whose corners fall onto a line on the coordinate lattice.
    pub slivers: u64,
    /// Triangles with the same three corners as an earlier one, in whatever order.
    pub duplicates: u64,
    /// Small parts that hang in the air, clear of everything.
    pub floating_parts: u64,
    /// Their triangles, without slivers and duplicates among them.
    pub floating_triangles: u64,
    /// Parts of the mesh that share no corner with one another, floating or not.
    pub parts: u64,
}

/// What a look through the spilled mesh gave.
#[derive(Debug, Default)]
pub(crate) struct Inspection {
    pub(crate) defects: Defects,
    left_out: Places,
}

impl Inspection {
    /// Whether the triangle at a place of the scene's stream is to be left out.
    pub(crate) fn leaves_out(&self, place: u64) -> bool {
        self.left_out.contains(place)
    }
}

/// A set of places, one bit each.
#[derive(Debug, Default)]
struct Places(Vec<u64>);

impl Places {
    fn insert(&mut self, place: u64) {
        let at = (place / 64) as usize;
        if self.0.len() <= at {
            self.0.resize(at + 1, 0);
        }
        self.0[at] |= 1 << (place % 64);
    }

    fn contains(&self, place: u64) -> bool {
        self.0.get((place / 64) as usize).is_some_and(|word| word >> (place % 64) & 1 == 1)
    }
}

/// A box on the lattice.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: [i32; 3],
    max: [i32; 3],
}

impl Bounds {
    fn join(&mut self, other: &Self) {
        self.min = [0, 1, 2].map(|i| self.min[i].min(other.min[i]));
        self.max = [0, 1, 2].map(|i| self.max[i].max(other.max[i]));
    }

    /// Longest side, metres.
    fn side(&self) -> f64 {
        let side = |i: usize| (i64::from(self.max[i]) - i64::from(self.min[i])) as f64;
        side(0).max(side(1)).max(side(2)) / UNITS_PER_METRE
    }

    /// Whether the gap along some axis is at least the clearance.
    fn is_clear_of(&self, other: &Self) -> bool {
        let gap = (CLEARANCE * UNITS_PER_METRE) as i64;
        (0..3).any(|i| {
            i64::from(self.min[i]) - i64::from(other.max[i]) >= gap
                || i64::from(other.min[i]) - i64::from(self.max[i]) >= gap
        })
    }

    /// The level-0 cells within reach of the box in plan.
    fn homes(&self) -> impl Iterator<Item = Cell> + use<> {
        let gap = (CLEARANCE * UNITS_PER_METRE) as i32;
        let low = Cell::home([self.min[0].saturating_sub(gap), self.min[1].saturating_sub(gap), 0]);
        let high = Cell::home([self.max[0].saturating_add(gap), self.max[1].saturating_add(gap), 0]);
        (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| Cell { level: 0, x, y }))
    }
}

/// Triangles that hang together.
#[derive(Clone, Copy, Debug)]
struct Part {
    bounds: Bounds,
    triangles: u64,
}

/// The triangles of one cell, sorted by what hangs together.
struct CellParts {
    triangles: Vec<(u64, BlockTriangle)>,
    /// Distinct corners, in the order of their first use, and those of each triangle.
    corners: Seen<3>,
    corners_of: Vec<[u32; 3]>,
    /// For each corner the number of its part.
    part_of: Vec<u32>,
    parts: Vec<Part>,
}

impl CellParts {
    /// Parts are numbered by their first triangle. O(n).
    fn read(spill: &Spill, segments: &[&Segment]) -> io::Result<Self> {
        let mut triangles = Vec::with_capacity(segments.iter().map(|s| s.count as usize).sum());
        for segment in segments {
            triangles.extend(spill.read(segment)?);
        }
        let mut corners = Seen::for_values(3 * triangles.len());
        let corners_of: Vec<[u32; 3]> =
            triangles.iter().map(|(_, triangle)| triangle.corners.map(|corner| corners.index(corner))).collect();
        let mut sets = DisjointSets::new(corners.values.len());
        for [a, b, c] in corners_of.iter().map(|ids| ids.map(|id| id as usize)) {
            sets.join(a, b);
            sets.join(a, c);
        }
        let mut numbers = vec![u32::MAX; corners.values.len()];
        let mut parts: Vec<Part> = Vec::new();
        for ((_, triangle), ids) in triangles.iter().zip(&corners_of) {
            let root = sets.find(ids[0] as usize);
            let (min, max) = triangle.bounds();
            let bounds = Bounds { min, max };
            if numbers[root] == u32::MAX {
                numbers[root] = parts.len() as u32;
                parts.push(Part { bounds, triangles: 0 });
            }
            let part = &mut parts[numbers[root] as usize];
            part.bounds.join(&bounds);
            part.triangles += 1;
        }
        let part_of = (0..corners.values.len()).map(|i| numbers[sets.find(i)]).collect();
        Ok(Self { triangles, corners, corners_of, part_of, parts })
    }

    /// The part that has a corner.
    fn part_at(&self, corner: [i32; 3]) -> Option<u32> {
        self.corners.find(corner).map(|i| self.part_of[i as usize])
    }

    /// Places of slivers, and of all but the first of the triangles with the same corners.
    fn repeated(&self) -> (Vec<u64>, Vec<u64>) {
        let mut keys: Vec<([u32; 3], u64)> = Vec::with_capacity(self.triangles.len());
        let mut slivers = Vec::new();
        for ((place, triangle), ids) in self.triangles.iter().zip(&self.corners_of) {
            if triangle.is_sliver() {
                slivers.push(*place);
            } else {
                let mut ids = *ids;
                ids.sort_unstable();
                keys.push((ids, *place));
            }
        }
        keys.sort_unstable();
        let twins = keys.windows(2).filter(|pair| pair[0].0 == pair[1].0);
        (slivers, twins.map(|pair| pair[1].1).collect())
    }
}

/// What a cell tells of itself when it has left the memory.
struct CellReport {
    parts: Vec<Part>,
    /// Corners that lie in another cell, with their part: (the cell that they lie in, corner, part).
    abroad: Vec<(Cell, [i32; 3], u32)>,
    slivers: Vec<u64>,
    twins: Vec<u64>,
}

/// Looks a spilled mesh through for what is to be left out of all blocks.
///
/// 1. Triangles with the same corners have the same middle and size, so the same spill cell: twins are found
///    cell by cell. Of twins (also such that face opposite ways) the first in the scene stays.
/// 2. Corners in common unite the triangles of a cell to parts; a corner that lies in another cell than its triangle
///    unites parts across cells.
/// 3. Parts of at most 5 m that keep 0.5 m from all others, box against box, are floaters; several that are near to
///    one another count as one, if together they measure at most 10 m. The largest part never floats, and nothing
///    does where floaters would hold more than 1 % of the triangles: such a mesh is a soup that cannot be judged.
///
/// The cells hang on the scene, not on the grid, so what is found does not depend on it, nor on the threads. In
/// memory stand the triangles of one cell (32 m) for each thread, a bit for each triangle, and 32 bytes for each part
/// of a cell and each corner across a cell's border. Every segment is read two or three times. O(n log n).
pub(crate) fn inspect(spill: &Spill, segments: &[Segment]) -> io::Result<Inspection> {
    let mut cells: BTreeMap<Cell, Vec<&Segment>> = BTreeMap::new();
    for segment in segments {
        cells.entry(segment.cell).or_default().push(segment);
    }
    let cells: Vec<(Cell, Vec<&Segment>)> = cells.into_iter().collect();
    let reports: Vec<CellReport> =
        cells.par_iter().map(|(cell, segments)| report(spill, *cell, segments)).collect::<io::Result<_>>()?;

    let mut inspection = Inspection::default();
    let Inspection { defects, left_out } = &mut inspection;
    let mut firsts = Vec::with_capacity(cells.len());
    let mut parts: Vec<Part> = Vec::new();
    let mut abroad: Vec<(Cell, [i32; 3], usize)> = Vec::new();
    for report in reports {
        firsts.push(parts.len());
        abroad
            .extend(report.abroad.into_iter().map(|(home, corner, part)| (home, corner, parts.len() + part as usize)));
        parts.extend(report.parts);
        defects.slivers += report.slivers.len() as u64;
        defects.duplicates += report.twins.len() as u64;
        report.slivers.iter().chain(&report.twins).for_each(|place| left_out.insert(*place));
    }
    abroad.par_sort_unstable();

    let roots = unite(spill, &cells, &firsts, &abroad, parts.len())?;
    drop(abroad);
    let mut wholes: BTreeMap<usize, Part> = BTreeMap::new();
    for (part, root) in parts.iter().zip(&roots) {
        let whole = wholes.entry(*root).or_insert(Part { bounds: part.bounds, triangles: 0 });
        whole.bounds.join(&part.bounds);
        whole.triangles += part.triangles;
    }
    defects.parts = wholes.len() as u64;
    let floating = floaters(spill, &cells, &firsts, &roots, &wholes)?;
    defects.floating_parts = floating.swarms;
    let affected = |at: usize| {
        let end = firsts.get(at + 1).copied().unwrap_or(roots.len());
        roots[firsts[at]..end].iter().any(|root| floating.roots.contains(root))
    };
    for (at, (_, segments)) in cells.iter().enumerate().filter(|(at, _)| affected(*at)) {
        let cell = CellParts::read(spill, segments)?;
        for (place, triangle) in &cell.triangles {
            let root = cell.part_at(triangle.corners[0]).map(|part| roots[firsts[at] + part as usize]);
            if root.is_some_and(|root| floating.roots.contains(&root)) && !left_out.contains(*place) {
                defects.floating_triangles += 1;
                left_out.insert(*place);
            }
        }
    }
    Ok(inspection)
}

fn report(spill: &Spill, cell: Cell, segments: &[&Segment]) -> io::Result<CellReport> {
    let content = CellParts::read(spill, segments)?;
    let (slivers, twins) = content.repeated();
    let abroad = content.corners.values.iter().zip(&content.part_of).filter_map(|(corner, part)| {
        let home = Cell::home(*corner);
        (home != cell).then_some((home, *corner, *part))
    });
    Ok(CellReport { abroad: abroad.collect(), parts: content.parts, slivers, twins })
}

/// For each part of a cell the first part that hangs together with it over all cells.
fn unite(
    spill: &Spill,
    cells: &[(Cell, Vec<&Segment>)],
    firsts: &[usize],
    abroad: &[(Cell, [i32; 3], usize)],
    count: usize,
) -> io::Result<Vec<usize>> {
    let mut sets = DisjointSets::new(count);
    for pair in abroad.windows(2).filter(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1)) {
        sets.join(pair[0].2, pair[1].2);
    }
    let visits: Vec<&[(Cell, [i32; 3], usize)]> = abroad.chunk_by(|a, b| a.0 == b.0).collect();
    let links: Vec<Vec<(usize, usize)>> = visits
        .par_iter()
        .map(|visits| {
            let Ok(at) = cells.binary_search_by_key(&visits[0].0, |(cell, _)| *cell) else { return Ok(Vec::new()) };
            let home = CellParts::read(spill, &cells[at].1)?;
            let link = |(_, corner, part): &(Cell, [i32; 3], usize)| {
                home.part_at(*corner).map(|own| (firsts[at] + own as usize, *part))
            };
            let mut links: Vec<_> = visits.iter().filter_map(link).collect();
            links.sort_unstable();
            links.dedup();
            Ok(links)
        })
        .collect::<io::Result<_>>()?;
    for (a, b) in links.into_iter().flatten() {
        sets.join(a, b);
    }
    Ok((0..count).map(|i| sets.find(i)).collect())
}

/// Parts that float.
struct Floating {
    /// By their first part of a cell.
    roots: BTreeSet<usize>,
    /// How many, those near to one another as one.
    swarms: u64,
}

fn floaters(
    spill: &Spill,
    cells: &[(Cell, Vec<&Segment>)],
    firsts: &[usize],
    roots: &[usize],
    wholes: &BTreeMap<usize, Part>,
) -> io::Result<Floating> {
    let largest = wholes.iter().max_by_key(|(root, part)| (part.triangles, usize::MAX - **root)).map(|(root, _)| *root);
    let small: Vec<(usize, Bounds)> = wholes
        .iter()
        .filter(|(root, part)| Some(**root) != largest && part.bounds.side() <= FLOATER)
        .map(|(root, part)| (*root, part.bounds))
        .collect();
    let number: BTreeMap<usize, usize> = small.iter().enumerate().map(|(at, (root, _))| (*root, at)).collect();
    let mut near: BTreeMap<Cell, Vec<usize>> = BTreeMap::new();
    for (at, (_, bounds)) in small.iter().enumerate() {
        bounds.homes().for_each(|home| near.entry(home).or_default().push(at));
    }
    let mut sets = DisjointSets::new(small.len());
    for list in near.values() {
        for (i, &a) in list.iter().enumerate() {
            for &b in &list[i + 1..] {
                if !small[a].1.is_clear_of(&small[b].1) {
                    sets.join(a, b);
                }
            }
        }
    }
    // Only ever set, so the order of the threads does not matter.
    let touched: Vec<AtomicBool> = small.iter().map(|_| AtomicBool::new(false)).collect();
    cells.par_iter().enumerate().try_for_each(|(at, (_, segments))| {
        let around = segments.iter().flat_map(|s| Bounds { min: s.min, max: s.max }.homes());
        if !around.into_iter().any(|home| near.contains_key(&home)) {
            return Ok(());
        }
        let cell = CellParts::read(spill, segments)?;
        for (_, triangle) in &cell.triangles {
            let Some(part) = cell.part_at(triangle.corners[0]) else { continue };
            if number.contains_key(&roots[firsts[at] + part as usize]) {
                continue;
            }
            let (min, max) = triangle.bounds();
            let bounds = Bounds { min, max };
            for &other in bounds.homes().filter_map(|home| near.get(&home)).flatten() {
                if !bounds.is_clear_of(&small[other].1) {
                    touched[other].store(true, Ordering::Relaxed);
                }
            }
        }
        Ok::<(), io::Error>(())
    })?;
    let roots_of: Vec<usize> = (0..small.len()).map(|at| sets.find(at)).collect();
    let mut swarms: BTreeMap<usize, (Bounds, bool)> = BTreeMap::new();
    for (at, (_, bounds)) in small.iter().enumerate() {
        let swarm = swarms.entry(roots_of[at]).or_insert((*bounds, false));
        swarm.0.join(bounds);
        swarm.1 |= touched[at].load(Ordering::Relaxed);
    }
    swarms.retain(|_, (bounds, touched)| !*touched && bounds.side() <= SWARM);
    let all: u64 = wholes.values().map(|part| part.triangles).sum();
    let floats = |at: &usize| swarms.contains_key(&roots_of[*at]);
    let held: u64 = (0..small.len()).filter(floats).map(|at| wholes[&small[at].0].triangles).sum();
    if held as f64 > SOUP * all as f64 {
        swarms.clear();
    }
    let floating = small.iter().enumerate().filter(|(at, _)| swarms.contains_key(&roots_of[*at]));
    let roots = floating.map(|(_, (root, _))| *root).collect();
    Ok(Floating { roots, swarms: swarms.len() as u64 })
}
