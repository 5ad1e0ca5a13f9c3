//! The extent of a city without the far-off bits that would blow up its grid.

use crate::spill::{Cell, Segment};
use crate::triangle::UNITS_PER_METRE;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A part with a smaller share of the triangles may be an outlier.
const SMALL_SHARE: f64 = 0.005;
/// Share of the triangles that the parts which are not small must hold for there to be outliers.
const MAIN_SHARE: f64 = 0.5;
/// A small part may stick out of the main extent by this much whatever that measures, metres.
const ALWAYS_NEAR: f64 = 100.0;

/// Triangles that were left out because they lie far off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outliers {
    /// Parts that do not hang together with the city.
    pub parts: u64,
    /// Their triangles.
    pub triangles: u64,
    /// How far the farthest reaches beyond the rest of the city, metres.
    pub reach: f64,
    /// Triangles beyond the coordinate lattice, 262 km from the scene's first vertex.
    pub beyond_lattice: u64,
}

/// A box on the coordinate lattice, and the triangles in it.
#[derive(Clone, Copy, Debug)]
struct Part {
    min: [i32; 3],
    max: [i32; 3],
    triangles: u64,
}

impl Part {
    fn join(&mut self, other: &Self) {
        self.min = [0, 1, 2].map(|i| self.min[i].min(other.min[i]));
        self.max = [0, 1, 2].map(|i| self.max[i].max(other.max[i]));
        self.triangles += other.triangles;
    }

    /// How far the box reaches beyond another in plan, metres.
    fn beyond(&self, other: &Self) -> f64 {
        let over = |i: usize| {
            let low = i64::from(other.min[i]) - i64::from(self.min[i]);
            low.max(i64::from(self.max[i]) - i64::from(other.max[i])).max(0)
        };
        over(0).max(over(1)) as f64 / UNITS_PER_METRE
    }

    /// The longer side in plan, metres.
    fn side(&self) -> f64 {
        let width = |i: usize| i64::from(self.max[i]) - i64::from(self.min[i]);
        width(0).max(width(1)) as f64 / UNITS_PER_METRE
    }
}

/// What the grid is to cover.
#[derive(Debug)]
pub(crate) struct Extent {
    /// Bounds of the triangles that are kept, on the spill's lattice.
    pub(crate) min: [i32; 3],
    pub(crate) max: [i32; 3],
    pub(crate) outliers: Outliers,
    /// For each segment, whether it is kept.
    pub(crate) kept: Vec<bool>,
}

/// Finds the extent of a scene from its segments; `None` if there are none.
///
/// 1. Cells of the same level that touch, also at a corner, hang together and make a part.
/// 2. The parts with at least 0.5 % of the triangles are the city, if they hold half of them; if
///    not, the scene is too scattered to be judged and all of it is kept.
/// 3. A smaller part is left out if it reaches beyond the city's extent by more than the longer
///    side of that (at least 100 m): so no small part makes the grid more than three times as wide.
pub(crate) fn extent(segments: &[Segment]) -> Option<Extent> {
    let mut cells: BTreeMap<Cell, Part> = BTreeMap::new();
    for segment in segments {
        let part = Part { min: segment.min, max: segment.max, triangles: u64::from(segment.count) };
        cells.entry(segment.cell).and_modify(|p| p.join(&part)).or_insert(part);
    }
    let parts = connect(&cells);
    let joined = |keep: &dyn Fn(&Part) -> bool| {
        parts.values().filter(|p| keep(p)).copied().reduce(|mut a, b| {
            a.join(&b);
            a
        })
    };
    let all = joined(&|_| true)?;
    let small = |part: &Part| (part.triangles as f64) < SMALL_SHARE * all.triangles as f64;
    let city = joined(&|part| !small(part)).filter(|c| c.triangles as f64 >= MAIN_SHARE * all.triangles as f64);
    let city = city.unwrap_or(all);
    let limit = city.side().max(ALWAYS_NEAR);
    let keep = |part: &Part| !small(part) || part.beyond(&city) <= limit;
    let kept = joined(&keep).unwrap_or(city);

    let mut outliers = Outliers::default();
    let mut kept_cells: BTreeMap<Cell, bool> = BTreeMap::new();
    let roots = roots(&cells);
    for (cell, root) in &roots {
        kept_cells.insert(*cell, parts.get(root).is_none_or(keep));
    }
    for part in parts.values().filter(|part| !keep(part)) {
        outliers.parts += 1;
        outliers.triangles += part.triangles;
        outliers.reach = outliers.reach.max(part.beyond(&kept));
    }
    let kept_segments = segments.iter().map(|s| kept_cells.get(&s.cell).copied().unwrap_or(true)).collect();
    Some(Extent { min: kept.min, max: kept.max, outliers, kept: kept_segments })
}

/// The parts, by their first cell.
fn connect(cells: &BTreeMap<Cell, Part>) -> BTreeMap<Cell, Part> {
    let mut parts: BTreeMap<Cell, Part> = BTreeMap::new();
    for (cell, root) in roots(cells) {
        let part = cells[&cell];
        parts.entry(root).and_modify(|p| p.join(&part)).or_insert(part);
    }
    parts
}

/// For each cell the first one of its part.
fn roots(cells: &BTreeMap<Cell, Part>) -> BTreeMap<Cell, Cell> {
    let mut roots: BTreeMap<Cell, Cell> = BTreeMap::new();
    for start in cells.keys() {
        if roots.contains_key(start) {
            continue;
        }
        let mut open = vec![*start];
        roots.insert(*start, *start);
        while let Some(cell) = open.pop() {
            for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
                let next = Cell { x: cell.x.saturating_add(dx), y: cell.y.saturating_add(dy), ..cell };
                if cells.contains_key(&next) && !roots.contains_key(&next) {
                    roots.insert(next, *start);
                    open.push(next);
                }
            }
        }
    }
    roots
}
