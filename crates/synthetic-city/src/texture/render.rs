//! Fills an atlas: each texel gets the colour of its place on the mesh, then the picture is blurred.

use super::atlas::{Atlas, Chart};
use super::paint::{Painter, exposure};
use crate::noise::{hash, unit};
use crate::sensing::TriMesh;
use gable_geometry::{DVec2, DVec3, dvec2};

/// An RGB picture, row 0 on top.
pub(crate) struct Picture {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<u8>,
}

/// Paints all charts.
pub(crate) fn render(mesh: &TriMesh, atlas: &Atlas, painter: &Painter<'_>, seed: u64) -> Picture {
    let (width, height) = (atlas.width, atlas.height);
    let mut owner = vec![u32::MAX; width * height];
    let mut depth = vec![f32::NEG_INFINITY; width * height];
    for chart in &atlas.charts {
        for &f in &chart.faces {
            let corners = mesh.corners(f as usize);
            let towards = |p: DVec3| chart.side.map_or(p.z, |s| p.truncate().dot(Chart::direction(s)));
            scan(corners.map(|p| chart.texel(p)), width, height, |k, w| {
                let d = (0..3).map(|i| w[i] * towards(corners[i])).sum::<f64>() as f32;
                if d > depth[k] {
                    depth[k] = d;
                    owner[k] = f;
                }
            });
        }
    }
    drop(depth);
    let mut colours = vec![[0.0_f32; 3]; width * height];
    let normals = smooth_normals(mesh);
    for chart in &atlas.charts {
        for &f in &chart.faces {
            let corners = mesh.corners(f as usize);
            let face = mesh.faces[f as usize];
            let image = exposure(seed, (corners[0] + corners[1] + corners[2]) / 3.0, chart.side);
            scan(corners.map(|p| chart.texel(p)), width, height, |k, w| {
                if owner[k] == f {
                    let p = corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
                    let n: DVec3 = (0..3).map(|i| normals[face[i] as usize] * w[i]).sum();
                    colours[k] = painter.colour(p, n.normalize_or(DVec3::Z), image);
                }
            });
        }
    }
    let mut filled: Vec<bool> = owner.iter().map(|&f| f != u32::MAX).collect();
    drop(owner);
    for _ in 0..3 {
        spread(&mut colours, &mut filled, width, height);
    }
    finish(&colours, width, height, seed)
}

/// Calls `f` with each texel whose centre is in the triangle (a texel's half more) and its weights.
fn scan(t: [DVec2; 3], width: usize, height: usize, mut f: impl FnMut(usize, [f64; 3])) {
    let low = t[0].min(t[1]).min(t[2]);
    let high = t[0].max(t[1]).max(t[2]);
    let twice = (t[1] - t[0]).perp_dot(t[2] - t[0]);
    if twice.abs() < 1e-9 {
        return;
    }
    let clamp = |v: f64, n: usize| (v.max(0.0) as usize).min(n);
    let slack = -0.35 * (t[1] - t[0]).length().max((t[2] - t[1]).length()).max((t[0] - t[2]).length()) / twice.abs();
    for y in clamp(low.y - 0.5, height)..clamp(high.y + 1.5, height) {
        for x in clamp(low.x - 0.5, width)..clamp(high.x + 1.5, width) {
            let p = dvec2(x as f64 + 0.5, y as f64 + 0.5);
            let w0 = (t[1] - p).perp_dot(t[2] - p) / twice;
            let w1 = (t[2] - p).perp_dot(t[0] - p) / twice;
            let w2 = 1.0 - w0 - w1;
            if w0 >= slack && w1 >= slack && w2 >= slack {
                f(y * width + x, [w0, w1, w2]);
            }
        }
    }
}

fn smooth_normals(mesh: &TriMesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.vertices.len()];
    for f in 0..mesh.faces.len() {
        let n = mesh.area_normal(f);
        for &v in &mesh.faces[f] {
            normals[v as usize] += n;
        }
    }
    normals
}

/// Gives empty texels beside filled ones the mean of these.
fn spread(colours: &mut [[f32; 3]], filled: &mut [bool], width: usize, height: usize) {
    let before = filled.to_vec();
    for y in 0..height {
        for x in 0..width {
            let k = y * width + x;
            if before[k] {
                continue;
            }
            let mut sum = [0.0_f32; 4];
            let mut add = |n: usize| {
                if before[n] {
                    (0..3).for_each(|c| sum[c] += colours[n][c]);
                    sum[3] += 1.0;
                }
            };
            if x > 0 {
                add(k - 1);
            }
            if x + 1 < width {
                add(k + 1);
            }
            if y > 0 {
                add(k - width);
            }
            if y + 1 < height {
                add(k + width);
            }
            if sum[3] > 0.0 {
                colours[k] = [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]];
                filled[k] = true;
            }
        }
    }
}

/// The lens and the sensor: a blur of three texels and noise of a few grey levels.
fn finish(colours: &[[f32; 3]], width: usize, height: usize, seed: u64) -> Picture {
    let mut data = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        let (up, down) = (y.saturating_sub(1), (y + 1).min(height - 1));
        for x in 0..width {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let grain = (unit(hash(seed ^ 0x9a, x as i64, y as i64, 0)) as f32 - 0.5) * 9.0;
            for c in 0..3 {
                let row = |y: usize| {
                    let at = |x: usize| colours[y * width + x][c];
                    0.22 * at(left) + 0.56 * at(x) + 0.22 * at(right)
                };
                let v = 0.22 * row(up) + 0.56 * row(y) + 0.22 * row(down);
                data.push((v + grain).clamp(0.0, 255.0) as u8);
            }
        }
    }
    Picture { width, height, data }
}
