//! Charts of a mesh and their places in one picture.
//!
//! Faces that look up or down go to one chart, an orthophoto of the tile. Steep faces go to charts of
//! connected faces with about the same azimuth, seen from the side. Charts are packed on shelves.

use crate::sensing::TriMesh;
use gable_geometry::{DVec2, DVec3, dvec2};
use std::collections::BTreeMap;

/// Faces whose normal has a smaller |z| are steep.
const STEEP: f64 = 0.42;
/// Texels left free around a chart.
const GAP: usize = 2;

/// A set of faces projected along one direction.
pub(crate) struct Chart {
    pub(crate) faces: Vec<u32>,
    /// `None`: from above. Else the sector of 45° of the outward azimuth.
    pub(crate) side: Option<u8>,
    /// Projected place of the chart's lower left texel, metres.
    low: DVec2,
    size: (usize, usize),
    /// Texel of the picture where the chart begins.
    at: (usize, usize),
    /// Edge of a texel, metres.
    texel: f64,
}

impl Chart {
    /// Outward direction of a sector.
    pub(crate) fn direction(sector: u8) -> DVec2 {
        DVec2::from_angle(f64::from(sector) * std::f64::consts::FRAC_PI_4)
    }

    /// Texel coordinates (x right, y down) of a place.
    pub(crate) fn texel(&self, p: DVec3) -> DVec2 {
        let flat = project(self.side, p);
        let local = (flat - self.low) / self.texel;
        dvec2(self.at.0 as f64 + local.x, (self.at.1 + self.size.1) as f64 - local.y)
    }
}

fn project(side: Option<u8>, p: DVec3) -> DVec2 {
    match side {
        None => p.truncate(),
        Some(sector) => dvec2(p.truncate().dot(Chart::direction(sector).perp()), p.z),
    }
}

/// The atlas of a tile.
pub(crate) struct Atlas {
    pub(crate) charts: Vec<Chart>,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

/// Cuts the mesh into charts with texels of the given edge, metres, and packs them.
pub(crate) fn unwrap(mesh: &TriMesh, texel: f64) -> Atlas {
    let sides: Vec<Option<u8>> = (0..mesh.faces.len()).map(|f| side(mesh.area_normal(f))).collect();
    let mut charts: Vec<Chart> = components(mesh, &sides)
        .into_iter()
        .map(|faces| {
            let side = sides[faces[0] as usize];
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            for &f in &faces {
                for p in mesh.corners(f as usize) {
                    low = low.min(project(side, p));
                    high = high.max(project(side, p));
                }
            }
            let low = (low / texel).floor() * texel - GAP as f64 * texel;
            let texels = |from: f64, to: f64| ((to - from) / texel).ceil() as usize + GAP;
            Chart { faces, side, low, size: (texels(low.x, high.x), texels(low.y, high.y)), at: (0, 0), texel }
        })
        .collect();
    let widest = charts.iter().map(|c| c.size.0).max().unwrap_or(1);
    let width = widest.max(512);
    // From above first, then by height: shelves stay tight.
    charts.sort_by_key(|c| (c.side.is_some(), std::cmp::Reverse(c.size.1), c.faces[0]));
    let (mut x, mut y, mut shelf) = (0, 0, 0);
    for chart in &mut charts {
        if x + chart.size.0 > width {
            (x, y, shelf) = (0, y + shelf, 0);
        }
        chart.at = (x, y);
        x += chart.size.0;
        shelf = shelf.max(chart.size.1);
    }
    Atlas { charts, width, height: y + shelf.max(1) }
}

fn side(normal: DVec3) -> Option<u8> {
    let n = normal.try_normalize()?;
    if n.z.abs() >= STEEP {
        return None;
    }
    let sector = (n.truncate().to_angle() / std::f64::consts::FRAC_PI_4).round() as i64;
    Some(sector.rem_euclid(8) as u8)
}

/// Faces from above as one list, the others by connected components of the same sector.
fn components(mesh: &TriMesh, sides: &[Option<u8>]) -> Vec<Vec<u32>> {
    let mut parent: Vec<u32> = (0..mesh.faces.len() as u32).collect();
    let mut first_flat = None;
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.faces.len());
    for (f, face) in mesh.faces.iter().enumerate() {
        let f = f as u32;
        if sides[f as usize].is_none() {
            let flat = *first_flat.get_or_insert(f);
            parent[f as usize] = flat;
            continue;
        }
        for k in 0..3 {
            let (u, v) = (face[k], face[(k + 1) % 3]);
            edges.push((u.min(v), u.max(v), f));
        }
    }
    edges.sort_unstable();
    for pair in edges.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        if (a.0, a.1) == (b.0, b.1) && sides[a.2 as usize] == sides[b.2 as usize] {
            let (x, y) = (root(&mut parent, a.2), root(&mut parent, b.2));
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    let mut lists: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for f in 0..mesh.faces.len() as u32 {
        lists.entry(root(&mut parent, f)).or_default().push(f);
    }
    lists.into_values().collect()
}

fn root(parent: &mut [u32], mut f: u32) -> u32 {
    while parent[f as usize] != f {
        parent[f as usize] = parent[parent[f as usize] as usize];
        f = parent[f as usize];
    }
    f
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    #[test]
    fn charts_of_a_box_lie_apart_and_hold_their_faces() {
        let p = |k: u32| dvec3(f64::from(k & 1) * 4.0, f64::from(k >> 1 & 1) * 6.0, f64::from(k >> 2) * 3.0);
        let quads = [[0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6], [4, 5, 7, 6]];
        let faces = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        let mesh = TriMesh { vertices: (0..8).map(p).collect(), faces };
        let atlas = unwrap(&mesh, 0.1);
        assert_eq!(atlas.charts.len(), 5);
        for (n, a) in atlas.charts.iter().enumerate() {
            let (x, y) = a.at;
            assert!(x + a.size.0 <= atlas.width && y + a.size.1 <= atlas.height);
            for b in &atlas.charts[n + 1..] {
                let apart = |p: usize, s: usize, q: usize, t: usize| p + s <= q || q + t <= p;
                assert!(apart(x, a.size.0, b.at.0, b.size.0) || apart(y, a.size.1, b.at.1, b.size.1));
            }
            for &f in &a.faces {
                for corner in mesh.corners(f as usize) {
                    let t = a.texel(corner);
                    assert!(t.x >= x as f64 && t.x <= (x + a.size.0) as f64);
                    assert!(t.y >= y as f64 && t.y <= (y + a.size.1) as f64);
                }
            }
        }
    }
}
