//! How far a mesh stays away from the lines in which its planes meet.

use super::regions::Region;
use crate::sensing::TriMesh;
use gable_geometry::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Regions smaller than this have no reliable plane, m².
const LEAST_AREA: f64 = 12.0;
/// Both regions must come this near to a place of their line, metres.
const REACH: f64 = 0.9;
/// Distance between places on a line, metres.
const STEP: f64 = 0.5;
/// Pitch of the search grid, metres.
const CELL: f64 = 1.0;

/// Distances from places on the lines of two planes to the mesh, metres.
pub(crate) fn cut_backs(mesh: &TriMesh, regions: &[Region]) -> Vec<f64> {
    let large: Vec<&Region> = regions.iter().filter(|r| r.area >= LEAST_AREA).collect();
    let cells: Vec<BTreeMap<[i64; 3], Vec<DVec3>>> = large.iter().map(|r| vertices_by_cell(mesh, r)).collect();
    let triangles = Triangles::new(mesh);
    let mut out = Vec::new();
    for i in 0..large.len() {
        for j in i + 1..large.len() {
            let (a, b) = (large[i], large[j]);
            if a.normal.dot(b.normal) > 0.643 || a.normal.dot(b.normal) < -0.5 {
                continue;
            }
            let Some((at, along)) = line(a, b) else { continue };
            // Places near which both regions have vertices.
            let mut places: BTreeSet<i64> = BTreeSet::new();
            for p in cells[i].values().flatten() {
                let t = (*p - at).dot(along);
                if (at + along * t).distance(*p) < REACH {
                    places.insert((t / STEP).round() as i64);
                }
            }
            for t in places {
                let p = at + along * (t as f64 * STEP);
                if !near(&cells[j], p) || !near(&cells[i], p) {
                    continue;
                }
                out.extend(triangles.distance(p).filter(|d| *d < REACH));
            }
        }
    }
    out
}

fn cell(p: DVec3) -> [i64; 3] {
    (p / CELL).floor().to_array().map(|v| v as i64)
}

fn around(p: DVec3) -> impl Iterator<Item = [i64; 3]> {
    let c = cell(p);
    (0..27).map(move |k| [c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1])
}

fn vertices_by_cell(mesh: &TriMesh, region: &Region) -> BTreeMap<[i64; 3], Vec<DVec3>> {
    let mut out: BTreeMap<[i64; 3], Vec<DVec3>> = BTreeMap::new();
    for &f in &region.faces {
        for p in mesh.corners(f as usize) {
            out.entry(cell(p)).or_default().push(p);
        }
    }
    out
}

fn near(cells: &BTreeMap<[i64; 3], Vec<DVec3>>, p: DVec3) -> bool {
    around(p).any(|c| cells.get(&c).is_some_and(|list| list.iter().any(|q| q.distance(p) < REACH)))
}

fn line(a: &Region, b: &Region) -> Option<(DVec3, DVec3)> {
    let along = a.normal.cross(b.normal).try_normalize()?;
    let (da, db) = (a.normal.dot(a.centre), b.normal.dot(b.centre));
    let dot = a.normal.dot(b.normal);
    let scale = 1.0 - dot * dot;
    let at = a.normal * ((da - db * dot) / scale) + b.normal * ((db - da * dot) / scale);
    Some((at, along))
}

struct Triangles<'a> {
    mesh: &'a TriMesh,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
}

impl<'a> Triangles<'a> {
    fn new(mesh: &'a TriMesh) -> Self {
        let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
        for f in 0..mesh.faces.len() {
            let [a, b, c] = mesh.corners(f);
            let (low, high) = (cell(a.min(b).min(c)), cell(a.max(b).max(c)));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        cells.entry([x, y, z]).or_default().push(f as u32);
                    }
                }
            }
        }
        Self { mesh, cells }
    }

    /// Distance to the nearest triangle within one cell.
    fn distance(&self, p: DVec3) -> Option<f64> {
        let faces = around(p).filter_map(|c| self.cells.get(&c)).flatten();
        faces.map(|&f| point_triangle(p, self.mesh.corners(f as usize))).min_by(f64::total_cmp)
    }
}

/// Distance from a point to a triangle: to its plane if the foot is inside, else to its nearest side.
fn point_triangle(p: DVec3, t: [DVec3; 3]) -> f64 {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    let inside = (0..3).all(|k| (t[(k + 1) % 3] - t[k]).cross(p - t[k]).dot(normal) >= 0.0);
    if inside && normal.length_squared() > 0.0 {
        return (p - t[0]).dot(normal.normalize()).abs();
    }
    let side = |k: usize| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        let d = b - a;
        let s = ((p - a).dot(d) / d.length_squared().max(1e-18)).clamp(0.0, 1.0);
        p.distance(a + d * s)
    };
    side(0).min(side(1)).min(side(2))
}
