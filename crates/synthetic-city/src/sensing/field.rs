//! The signed distance field that a multi-view reconstruction would have found.
//!
//! 1. Occupancy of voxels of 0.4 m from the columns, with exact coverage in height.
//! 2. Free space that too few cameras see stays partly filled: courtyards melt, webs grow between
//!    trees and walls, the undersides of crowns and the feet of hidden facades vanish.
//! 3. A blur, which rounds corners.
//! 4. Distance: near a plane, occupancy blurred with a Gaussian of deviation σ is Φ(d/σ), so
//!    d = σ·Φ⁻¹(occupancy).
//! 5. Correlated noise is added to the distance; it is stronger where few cameras see.

use super::columns::Columns;
use super::horizon::{Heights, horizon};
use super::{COLUMN, VOXEL};
use crate::noise::noise3;
use gable_geometry::{DVec3, dvec3};

/// Deviation of the blur in metres, voxel and column averaging included.
pub(crate) const SIGMA: f64 = 0.20;
/// How much of the unseen is taken for solid with 0, 1 and 2 views; from 3 views on, nothing.
const FILL: [f32; 3] = [0.9, 0.55, 0.2];
/// Lattice pitches (metres) and amplitudes (metres) of the noise.
const NOISE: [(f64, f64); 2] = [(0.92, 0.165), (5.0, 0.11)];
/// How unevenly noise lies over the city: smooth where the surface has texture, rough where it has none.
const UNEVEN: f64 = 3.3;

/// Samples of the field at the centres of voxels; positive inside.
pub(crate) struct Field {
    /// Absolute index of the first voxel along x, y and z.
    pub(crate) origin: [i64; 3],
    /// Voxels along x, y and z; z runs fastest.
    pub(crate) size: [usize; 3],
    pub(crate) distance: Vec<f32>,
    /// For each column of voxels the heights above which 1, 2 and 3 cameras see.
    pub(crate) seen: Vec<[f32; 3]>,
}

impl Field {
    pub(crate) fn index(&self, i: usize, j: usize, l: usize) -> usize {
        (j * self.size[0] + i) * self.size[2] + l
    }

    /// Centre of a voxel, local metres.
    pub(crate) fn centre(&self, i: usize, j: usize, l: usize) -> DVec3 {
        let o = self.origin;
        dvec3((o[0] + i as i64) as f64 + 0.5, (o[1] + j as i64) as f64 + 0.5, (o[2] + l as i64) as f64 + 0.5) * VOXEL
    }

    /// Share of a place taken for solid because too few cameras see it, 0 to 0.9.
    pub(crate) fn hidden(&self, p: DVec3) -> f32 {
        let clamp = |v: f64, o: i64, n: usize| (((v / VOXEL).floor() as i64 - o).max(0) as usize).min(n - 1);
        let (i, j) = (clamp(p.x, self.origin[0], self.size[0]), clamp(p.y, self.origin[1], self.size[1]));
        fill(&self.seen[j * self.size[0] + i], p.z as f32)
    }
}

fn fill(seen: &[f32; 3], z: f32) -> f32 {
    let views = seen.iter().filter(|h| z > **h).count();
    FILL.get(views).copied().unwrap_or(0.0)
}

/// Computes the field of voxels `x0..x0+nx`, `y0..y0+ny` (absolute indices); the columns must reach the
/// margin of view around it.
pub(crate) fn sense(columns: &Columns, seed: u64, noise: f64, x0: i64, y0: i64, nx: usize, ny: usize) -> Field {
    let seen = visibility(columns, x0, y0, nx, ny);
    let (low, high) = range(columns, x0, y0, nx, ny);
    let l0 = (f64::from(low) / VOXEL).floor() as i64 - 5;
    let nz = ((f64::from(high) / VOXEL).ceil() as i64 + 5 - l0) as usize;
    let mut field = Field { origin: [x0, y0, l0], size: [nx, ny, nz], distance: vec![0.0; nx * ny * nz], seen };
    occupancy(columns, &mut field);
    blur(&mut field);
    let probit = probit_table();
    let mut k = 0;
    for j in 0..ny {
        for i in 0..nx {
            for l in 0..nz {
                let occupied = field.distance[k];
                let mut d = probit[(occupied.clamp(0.0, 1.0) * 1024.0) as usize];
                if noise > 0.0 && occupied > 0.015 && occupied < 0.985 {
                    let p = field.centre(i, j, l);
                    let weak = f64::from(fill(&field.seen[j * nx + i], p.z as f32));
                    let leafy = if columns.at(p.truncate()).crown.1 > p.z as f32 - 0.6 { 1.8 } else { 0.0 };
                    let wet = if columns.is_water(p) { 2.0 } else { 0.0 };
                    d += (noise * (1.0 + 1.5 * weak + leafy + wet) * correlated(seed, p)) as f32;
                }
                field.distance[k] = d;
                k += 1;
            }
        }
    }
    field
}

/// Noise of several wavelengths, metres.
pub(crate) fn correlated(seed: u64, p: DVec3) -> f64 {
    let texture = (UNEVEN * noise3(seed ^ 0xaf, 8.0, p)).clamp(-2.0, 0.6).exp();
    texture
        * NOISE
            .iter()
            .enumerate()
            .map(|(n, (pitch, gain))| gain * noise3(seed ^ (0xa0 + n as u64), *pitch, p))
            .sum::<f64>()
}

/// Heights above which at least 1, 2 and 3 of eight cameras see (four at 45°, four at 73°).
fn visibility(columns: &Columns, x0: i64, y0: i64, nx: usize, ny: usize) -> Vec<[f32; 3]> {
    let (w, h) = (columns.width / 2, columns.height / 2);
    let mut top = Heights { width: w, height: h, data: Vec::with_capacity(w * h) };
    for j in 0..h {
        for i in 0..w {
            let at = |di: usize, dj: usize| columns.data[(2 * j + dj) * columns.width + 2 * i + di].opaque_top();
            top.data.push(at(0, 0).max(at(1, 0)).max(at(0, 1)).max(at(1, 1)));
        }
    }
    let mut seen = vec![[f32::INFINITY; 3]; nx * ny];
    let (di, dj) = ((x0 - columns.x0 / 2) as usize, (y0 - columns.y0 / 2) as usize);
    for side in 0..4 {
        for drop in [VOXEL as f32, VOXEL as f32 / 0.3] {
            let level = horizon(&top, side, drop);
            for j in 0..ny {
                for i in 0..nx {
                    let own = &mut seen[j * nx + i];
                    let z = level[(j + dj) * w + i + di];
                    if z < own[2] {
                        own[2] = z;
                        own.sort_by(f32::total_cmp);
                    }
                }
            }
        }
    }
    seen
}

fn range(columns: &Columns, x0: i64, y0: i64, nx: usize, ny: usize) -> (f32, f32) {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    let (ci, cj) = ((2 * x0 - columns.x0) as usize, (2 * y0 - columns.y0) as usize);
    for j in cj..cj + 2 * ny {
        for column in &columns.data[j * columns.width + ci..j * columns.width + ci + 2 * nx] {
            low = low.min(column.ground);
            high = high.max(column.top());
        }
    }
    (low, high)
}

fn occupancy(columns: &Columns, field: &mut Field) {
    let [nx, ny, nz] = field.size;
    let base = (field.origin[2] as f64 * VOXEL) as f32;
    let inverse = (1.0 / VOXEL) as f32;
    for j in 0..ny {
        for i in 0..nx {
            let start = (j * nx + i) * nz;
            let voxels = &mut field.distance[start..start + nz];
            for quarter in 0..4 {
                let ci = (2 * (field.origin[0] + i as i64) - columns.x0) as usize + quarter % 2;
                let cj = (2 * (field.origin[1] + j as i64) - columns.y0) as usize + quarter / 2;
                let column = &columns.data[cj * columns.width + ci];
                let solid = (column.solid - base) * inverse;
                let full = solid.floor().max(0.0) as usize;
                voxels[..full.min(nz)].iter_mut().for_each(|v| *v += 0.25);
                if full < nz {
                    voxels[full] += 0.25 * (solid - full as f32);
                }
                for (low, high) in [column.slab, column.crown] {
                    let (a, b) = ((low.max(column.solid) - base) * inverse, (high - base) * inverse);
                    if b > a {
                        for l in (a.floor().max(0.0) as usize)..(b.ceil() as usize).min(nz) {
                            voxels[l] += 0.25 * (b.min(l as f32 + 1.0) - a.max(l as f32)).max(0.0);
                        }
                    }
                }
            }
            let seen = field.seen[j * nx + i];
            let hidden = ((seen[2] - base) * inverse).ceil().clamp(0.0, nz as f32) as usize;
            for (l, v) in voxels[..hidden].iter_mut().enumerate() {
                *v = v.max(fill(&seen, base + (l as f32 + 0.5) * VOXEL as f32));
            }
            voxels.iter_mut().for_each(|v| *v = v.min(1.0));
        }
    }
}

/// Three taps along each axis, twice along none: the variance of the taps and of the two averages
/// (column of 0.2 m, voxel of 0.4 m) add up to σ².
fn blur(field: &mut Field) {
    let averaged = VOXEL * VOXEL / 12.0 + COLUMN * COLUMN / 12.0;
    let side = (((SIGMA * SIGMA - averaged) / (2.0 * VOXEL * VOXEL)) as f32).clamp(0.0, 0.25);
    let [nx, ny, nz] = field.size;
    let mut line = vec![0.0_f32; nz];
    for row in field.distance.chunks_exact_mut(nz) {
        line.copy_from_slice(row);
        for l in 1..nz - 1 {
            row[l] = line[l] + side * (line[l - 1] + line[l + 1] - 2.0 * line[l]);
        }
    }
    sweep(&mut field.distance, ny, nx * nz, nx, nz, side);
    sweep(&mut field.distance, nx, nz, ny, nx * nz, side);
}

/// Three taps along the axis whose neighbours are `stride` apart, for blocks of `stride`-contiguous lines.
fn sweep(data: &mut [f32], length: usize, stride: usize, lines: usize, line_stride: usize, side: f32) {
    let run = stride.min(line_stride);
    let mut before = vec![0.0_f32; run];
    let mut here = vec![0.0_f32; run];
    for line in 0..lines {
        let at = |k: usize| line * line_stride + k * stride;
        before.copy_from_slice(&data[at(0)..at(0) + run]);
        for k in 1..length.saturating_sub(1) {
            here.copy_from_slice(&data[at(k)..at(k) + run]);
            let (low, after) = data.split_at_mut(at(k + 1));
            let target = &mut low[at(k)..at(k) + run];
            for n in 0..run {
                target[n] = here[n] + side * (before[n] + after[n] - 2.0 * here[n]);
            }
            std::mem::swap(&mut before, &mut here);
        }
    }
}

/// σ·Φ⁻¹ at 1,025 steps of occupancy, by bisection of an integral of the normal density.
fn probit_table() -> Vec<f32> {
    const STEPS: usize = 6000;
    let mut cumulative = Vec::with_capacity(STEPS + 1);
    let mut sum = 0.0;
    let at = |n: usize| -3.0 + 6.0 * n as f64 / STEPS as f64;
    let density = |x: f64| (-0.5 * x * x).exp();
    cumulative.push(0.0);
    for n in 0..STEPS {
        sum += density(f64::midpoint(at(n), at(n + 1)));
        cumulative.push(sum);
    }
    (0..=1024)
        .map(|k| {
            let share = k as f64 / 1024.0;
            let n = cumulative.partition_point(|c| c / sum < share);
            (SIGMA * at(n.min(STEPS))) as f32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probit_inverts_the_normal_distribution() {
        let table = probit_table();
        assert!(table[512].abs() < 1e-3);
        // Φ(1) = 0.8413.
        assert!((f64::from(table[861]) / SIGMA - 1.0).abs() < 0.02);
        assert!(table.windows(2).all(|w| w[0] <= w[1]));
    }
}
