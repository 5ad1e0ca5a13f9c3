//! Where a mesh ends: cut along any curve, with skirts that hang down, and webs of long triangles beyond it.

use crate::noise::{hash, noise2, unit};
use crate::scene::site::Site;
use crate::sensing::TriMesh;
use gable_geometry::{Counter, DVec2, DVec3, dvec2};
use std::collections::{BTreeMap, BTreeSet};

/// Side of the squares of which one draw each decides what hangs at the rim, metres.
const PIECE: f64 = 13.0;

#[derive(Debug)]
pub(crate) struct Rim {
    seed: u64,
    centre: DVec2,
    /// Half the size of what is left, metres.
    half: DVec2,
    /// How far the curve swings inward, as a share of the size.
    swing: f64,
    /// How deep skirts hang at most, metres.
    deepest: f64,
    /// Shares of the rim with skirts and with webs.
    skirts: f64,
    webs: f64,
}

impl Rim {
    pub(super) fn draw(site: &Site, c: &mut Counter) -> Self {
        Self {
            seed: c.bits(),
            centre: site.middle(),
            half: site.size() / 2.0 * c.range(0.88, 0.99),
            swing: c.range(0.05, 0.5),
            deepest: c.range(4.0, 30.0),
            skirts: c.range(0.1, 0.7),
            webs: c.range(0.1, 0.5),
        }
    }

    /// Whether a place lies inside of the curve.
    pub(super) fn contains(&self, p: DVec2) -> bool {
        let d = (p - self.centre) / self.half;
        let reach = d.abs().max_element();
        let way = d.normalize_or(DVec2::X) * 2.3;
        let wide = noise2(self.seed, 1.0, way.x, way.y).max(-0.2);
        let fine = noise2(self.seed ^ 1, 2.1, p.x, p.y);
        reach < 1.0 - self.swing * (0.2 + 0.8 * wide) - fine * 1.5 / self.half.min_element()
    }

    /// Cuts a mesh and hangs skirts and webs at the new border.
    pub(super) fn cut(&self, mesh: &mut TriMesh) {
        let before: BTreeSet<(u32, u32)> = border(&mesh.faces).into_iter().collect();
        let inside = |f: &[u32; 3]| {
            let sum: DVec3 = f.iter().map(|&v| mesh.vertices[v as usize]).sum();
            self.contains((sum / 3.0).truncate())
        };
        mesh.faces = mesh.faces.iter().filter(|f| inside(f)).copied().collect();
        let cut: Vec<(u32, u32)> = border(&mesh.faces).into_iter().filter(|edge| !before.contains(edge)).collect();
        let mut hanging: BTreeMap<u32, u32> = BTreeMap::new();
        for (a, b) in cut {
            let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
            let middle = ((p + q) / 2.0).truncate();
            let cell = (middle / PIECE).floor();
            let draw = |k: i64| unit(hash(self.seed ^ 0x5c, cell.x as i64, cell.y as i64, k));
            let own = unit(hash(self.seed ^ 0x5d, (middle.x * 100.0) as i64, (middle.y * 100.0) as i64, 0));
            if draw(0) < self.skirts {
                let depth = self.deepest * draw(1) * (0.4 + 0.6 * own);
                let [low_a, low_b] = [a, b].map(|v| {
                    *hanging.entry(v).or_insert_with(|| {
                        mesh.vertices.push(mesh.vertices[v as usize] - dvec2(0.0, 0.0).extend(depth));
                        mesh.vertices.len() as u32 - 1
                    })
                });
                mesh.faces.extend([[b, a, low_a], [b, low_a, low_b]]);
            } else if draw(0) < self.skirts + self.webs && own < 0.3 {
                // A tooth: one corner far outside, a little lower.
                let along = (q - p).truncate().normalize_or(DVec2::X);
                let out = -along.perp() * (2.0 + 14.0 * draw(2) * own / 0.3);
                let tip = middle + out + along * (6.0 * (draw(3) - 0.5));
                mesh.vertices.push(tip.extend(p.z.min(q.z) - 6.0 * draw(4) * own));
                mesh.faces.push([b, a, mesh.vertices.len() as u32 - 1]);
            }
        }
    }
}

/// Edges with a face on one side only, as that face turns around them.
fn border(faces: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let edges: BTreeSet<(u32, u32)> = faces.iter().flat_map(|f| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])]).collect();
    edges.iter().filter(|(a, b)| !edges.contains(&(*b, *a))).copied().collect()
}
