//! A raster that looks like a city block to the labelling: houses with crisp edges and noisy heights, tree blobs, grass.

use std::f32::consts::TAU;

use gable_graph_cut::GridProblem;

/// Costs of ground, grass, tree and building from height and greenness in [0, 1].
pub(crate) type Costs = fn(f32, f32) -> [f32; 4];

/// Zhu's data term (2018, equation 4).
pub(crate) fn products(h: f32, t: f32) -> [f32; 4] {
    [h * t, h * (1.0 - t), (1.0 - h) * (1.0 - t), (1.0 - h) * t]
}

/// Negative logarithms of independent probabilities.
pub(crate) fn logarithms(h: f32, t: f32) -> [f32; 4] {
    let log = |p: f32| -p.clamp(0.02, 0.98).ln();
    [log(1.0 - h) + log(1.0 - t), log(1.0 - h) + log(t), log(h) + log(t), log(h) + log(1.0 - t)]
}

/// Costs and weights of Zhu's segmentation (2018, section 4.2) on a made scene.
pub(crate) struct Scene {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) unary: Vec<f32>,
    pub(crate) right: Vec<f32>,
    pub(crate) up: Vec<f32>,
}

impl Scene {
    pub(crate) fn problem(&self) -> GridProblem<'_> {
        let Self { width, height, unary, right, up } = self;
        GridProblem { width: *width, height: *height, labels: 4, unary, right, up }
    }
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as f32) / (1_u32 << 24) as f32
    }
}

/// Smooth noise: values on a coarse lattice, interpolated.
fn smooth(random: &mut Random, width: usize, height: usize, cell: usize) -> Vec<f32> {
    let (w, h) = (width / cell + 2, height / cell + 2);
    let lattice: Vec<f32> = (0..w * h).map(|_| random.next() - 0.5).collect();
    let mut out = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let (i, j) = (x / cell, y / cell);
            let (u, v) = ((x % cell) as f32 / cell as f32, (y % cell) as f32 / cell as f32);
            let at = |i: usize, j: usize| lattice[j * w + i];
            out.push(
                (at(i, j) * (1.0 - u) + at(i + 1, j) * u) * (1.0 - v)
                    + (at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u) * v,
            );
        }
    }
    out
}

/// Labels: 0 ground, 1 grass, 2 tree, 3 building.
pub(crate) fn scene(width: usize, height: usize, seed: u64, costs: Costs) -> Scene {
    let mut random = Random(seed);
    let mut z = vec![0.0_f32; width * height];
    let mut tree = vec![0.1_f32; width * height];
    let lawn = smooth(&mut random, width, height, 60);
    for (t, l) in tree.iter_mut().zip(&lawn) {
        if *l > 0.1 {
            *t = 0.85;
        }
    }
    for _ in 0..width * height / 9000 {
        let (cx, cy) = (random.next() * width as f32, random.next() * height as f32);
        let (a, b, turn) = (15.0 + 40.0 * random.next(), 12.0 + 25.0 * random.next(), TAU * random.next());
        let (eave, slope, is_tree) = (3.0 + 9.0 * random.next(), random.next(), random.next() < 0.4);
        let reach = a.max(b) * 1.5;
        for y in (cy - reach).max(0.0) as usize..((cy + reach).max(0.0) as usize).min(height) {
            for x in (cx - reach).max(0.0) as usize..((cx + reach).max(0.0) as usize).min(width) {
                let (dx, dy) = (x as f32 - cx, y as f32 - cy);
                let (u, v) = ((dx * turn.cos() + dy * turn.sin()) / a, (dy * turn.cos() - dx * turn.sin()) / b);
                let at = y * width + x;
                if is_tree && u * u + v * v < 0.4 {
                    z[at] = z[at].max(6.0 * (1.0 - u * u - v * v) + 2.0 * random.next());
                    tree[at] = 0.9;
                } else if !is_tree && u.abs() < 1.0 && v.abs() < 1.0 {
                    z[at] = z[at].max(eave + slope * 0.2 * b * (1.0 - v.abs()));
                    tree[at] = 0.1;
                }
            }
        }
    }
    let coarse = smooth(&mut random, width, height, 6);
    let blotch = smooth(&mut random, width, height, 9);
    for at in 0..z.len() {
        z[at] += 0.4 * coarse[at] + 0.1 * (random.next() - 0.5);
        tree[at] = (tree[at] + 0.9 * blotch[at] + 0.5 * (random.next() - 0.5)).clamp(0.0, 1.0);
    }
    let mut unary = Vec::with_capacity(4 * z.len());
    for at in 0..z.len() {
        unary.extend(costs(1.0 / (1.0 + (-2.0 * (z[at].max(0.0) - 3.0)).exp()), tree[at]));
    }
    let weight = |p: usize, q: usize| 1.0 - (z[p] - z[q]).abs().min(1.0);
    let n = width * height;
    let right = (0..n).map(|p| if !(p + 1).is_multiple_of(width) { weight(p, p + 1) } else { 0.0 }).collect();
    let up = (0..n).map(|p| if p + width < n { weight(p, p + width) } else { 0.0 }).collect();
    Scene { width, height, unary, right, up }
}
