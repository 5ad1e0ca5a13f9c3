//! Variational shape approximation of a triangle soup (Cohen-Steiner, Alliez & Desbrun 2004), the way Zhu 2018,
//! §5.2, uses it for facades.

use crate::facade_segments::Region;
use crate::soup::{Mesh, Triangle};
use gable_geometry::{Counter, DVec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Parameters of [`approximate`].
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Area per proxy, m²; the number of proxies is the soup's area divided by it (Zhu: 10).
    pub area: f64,
    /// Most rounds of flooding and fitting.
    pub iterations: usize,
    /// Seed of the random first triangles.
    pub seed: u64,
}

impl Default for Params {
    fn default() -> Self {
        Self { area: 10.0, iterations: 20, seed: 1 }
    }
}

/// The proxies of a triangle soup and the triangles of each, by Lloyd's iteration with the metric L²·¹:
///
/// 1. seeds: random triangles (seeded; every component without one gets its first triangle);
/// 2. flooding: triangles join the neighbouring region whose normal N is nearest, in the order of area·|n − N|²;
/// 3. fitting: N becomes the area-weighted mean normal, and the triangle nearest to it the next seed;
///
/// repeated until no triangle changes. O(iterations · n log n).
#[must_use]
pub fn approximate(triangles: &[Triangle], params: &Params) -> Vec<Region> {
    let mesh = Mesh::weld(triangles);
    let total: f64 = mesh.areas.iter().sum();
    if mesh.len() == 0 || total <= 0.0 {
        return Vec::new();
    }
    let count = ((total / params.area).ceil() as usize).clamp(1, mesh.len());
    let mut rng = Counter::new(params.seed);
    let mut order: Vec<u32> = (0..mesh.len() as u32).collect();
    for i in 0..count {
        order.swap(i, i + rng.index(mesh.len() - i));
    }
    let mut seeds: Vec<u32> = order[..count].to_vec();
    let mut normals: Vec<DVec3> = seeds.iter().map(|&t| mesh.normals[t as usize]).collect();
    let mut labels = vec![u32::MAX; mesh.len()];
    for _ in 0..params.iterations.max(1) {
        let before = std::mem::replace(&mut labels, flood(&mesh, &mut seeds, &mut normals));
        fit(&mesh, &labels, &mut seeds, &mut normals);
        if before == labels {
            break;
        }
    }
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); seeds.len()];
    for (t, &label) in labels.iter().enumerate() {
        members[label as usize].push(t as u32);
    }
    members.into_iter().filter(|m| !m.is_empty()).map(|m| Region::of(&mesh, m)).collect()
}

fn error(mesh: &Mesh, triangle: usize, normal: DVec3) -> f64 {
    mesh.areas[triangle] * (mesh.normals[triangle] - normal).length_squared()
}

/// Grows all regions at once; components that hold no seed get a region of their own.
fn flood(mesh: &Mesh, seeds: &mut Vec<u32>, normals: &mut Vec<DVec3>) -> Vec<u32> {
    let mut labels = vec![u32::MAX; mesh.len()];
    // Errors are not negative, so their bits sort like the numbers.
    let mut queue: BinaryHeap<Reverse<(u64, u32, u32)>> = BinaryHeap::new();
    for (region, &t) in seeds.iter().enumerate() {
        queue.push(Reverse((0, t, region as u32)));
    }
    let mut first = 0;
    loop {
        while let Some(Reverse((_, t, region))) = queue.pop() {
            if labels[t as usize] != u32::MAX {
                continue;
            }
            labels[t as usize] = region;
            for &n in mesh.neighbours(t as usize) {
                if labels[n as usize] == u32::MAX {
                    let e = error(mesh, n as usize, normals[region as usize]);
                    queue.push(Reverse((e.to_bits(), n, region)));
                }
            }
        }
        while first < labels.len() && labels[first] != u32::MAX {
            first += 1;
        }
        if first == labels.len() {
            return labels;
        }
        queue.push(Reverse((0, first as u32, seeds.len() as u32)));
        seeds.push(first as u32);
        normals.push(mesh.normals[first]);
    }
}

fn fit(mesh: &Mesh, labels: &[u32], seeds: &mut [u32], normals: &mut [DVec3]) {
    let mut sums = vec![DVec3::ZERO; seeds.len()];
    for (t, &label) in labels.iter().enumerate() {
        sums[label as usize] += mesh.normals[t] * mesh.areas[t];
    }
    for (normal, sum) in normals.iter_mut().zip(&sums) {
        *normal = sum.try_normalize().unwrap_or(*normal);
    }
    let mut best = vec![f64::INFINITY; seeds.len()];
    for (t, &label) in labels.iter().enumerate() {
        let e = (mesh.normals[t] - normals[label as usize]).length_squared();
        if e < best[label as usize] {
            best[label as usize] = e;
            seeds[label as usize] = t as u32;
        }
    }
}
