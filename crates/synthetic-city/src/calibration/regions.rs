//! Planar regions of a noisy mesh, grown over faces.

use crate::sensing::TriMesh;
use gable_geometry::{Covariance3, DVec3};
use std::collections::{BTreeMap, VecDeque};

/// Faces whose smoothed normal is within this angle (cosine of 14°) of the region's may join.
const ALIGNED: f64 = 0.970;
/// Largest distance of a face from the region's plane, metres.
const NEAR: f64 = 0.4;
/// Rounds of smoothing of face normals over neighbours.
const ROUNDS: usize = 5;

/// A planar region.
pub(crate) struct Region {
    pub(crate) faces: Vec<u32>,
    /// Area, m².
    pub(crate) area: f64,
    /// Unit normal, outward.
    pub(crate) normal: DVec3,
    /// A point of the plane.
    pub(crate) centre: DVec3,
}

impl Region {
    pub(crate) fn is_roof(&self) -> bool {
        (0.26..0.99).contains(&self.normal.z)
    }

    /// Inner vertices (all their faces belong to the region) with their distances from the plane.
    pub(crate) fn residuals(&self, mesh: &TriMesh) -> Vec<(DVec3, f64)> {
        // Around an inner vertex the faces of the region close: every neighbour is once next and once last.
        let mut balance: BTreeMap<u32, i64> = BTreeMap::new();
        for &f in &self.faces {
            let face = mesh.faces[f as usize];
            for k in 0..3 {
                *balance.entry(face[k]).or_default() += i64::from(face[(k + 1) % 3]) - i64::from(face[(k + 2) % 3]);
            }
        }
        let mut out: Vec<(DVec3, f64)> = balance
            .iter()
            .filter(|(_, b)| **b == 0)
            .map(|(&v, _)| mesh.vertices[v as usize])
            .map(|p| (p, (p - self.centre).dot(self.normal)))
            .filter(|(_, d)| d.abs() < NEAR)
            .collect();
        let mean = out.iter().map(|(_, d)| d).sum::<f64>() / out.len().max(1) as f64;
        out.iter_mut().for_each(|(_, d)| *d -= mean);
        out
    }
}

/// Grows regions from the smoothest faces; each face is in at most one.
pub(crate) fn grow(mesh: &TriMesh) -> Vec<Region> {
    let neighbours = neighbours(mesh);
    let raw: Vec<DVec3> = (0..mesh.faces.len()).map(|f| mesh.area_normal(f)).collect();
    let normals = smooth(&raw, &neighbours);
    let mut order: Vec<u32> = (0..mesh.faces.len() as u32).collect();
    let flatness = |f: u32| {
        let own = normals[f as usize];
        neighbours[f as usize].iter().map(|&g| own.dot(normals[g as usize])).fold(1.0, f64::min)
    };
    let keys: Vec<f64> = order.iter().map(|&f| flatness(f)).collect();
    order.sort_by(|&a, &b| keys[b as usize].total_cmp(&keys[a as usize]).then(a.cmp(&b)));
    let mut taken = vec![false; mesh.faces.len()];
    let mut regions = Vec::new();
    for seed in order {
        if taken[seed as usize] {
            continue;
        }
        let mut plane = (normals[seed as usize], middle(mesh, seed));
        let mut faces = Vec::new();
        // The plane is fitted again to what was grown, and the region grown again from the seed.
        for _ in 0..3 {
            faces = flood(mesh, seed, plane, &normals, &neighbours, &taken);
            if faces.len() < 12 {
                break;
            }
            plane = fit(mesh, &faces, plane.0);
        }
        if faces.len() < 12 {
            continue;
        }
        faces.iter().for_each(|&f| taken[f as usize] = true);
        let area = faces.iter().map(|&f| raw[f as usize].length() / 2.0).sum();
        regions.push(Region { faces, area, normal: plane.0, centre: plane.1 });
    }
    regions
}

fn middle(mesh: &TriMesh, f: u32) -> DVec3 {
    let [a, b, c] = mesh.corners(f as usize);
    (a + b + c) / 3.0
}

fn flood(
    mesh: &TriMesh,
    seed: u32,
    (normal, centre): (DVec3, DVec3),
    normals: &[DVec3],
    neighbours: &[Vec<u32>],
    taken: &[bool],
) -> Vec<u32> {
    let mut seen = std::collections::BTreeSet::from([seed]);
    let mut queue = VecDeque::from([seed]);
    let mut faces = Vec::new();
    while let Some(f) = queue.pop_front() {
        faces.push(f);
        for &g in &neighbours[f as usize] {
            let fits = !taken[g as usize]
                && normals[g as usize].dot(normal) > ALIGNED
                && (middle(mesh, g) - centre).dot(normal).abs() < NEAR;
            if fits && seen.insert(g) {
                queue.push_back(g);
            }
        }
    }
    faces
}

/// Least-squares plane of the face centres, weighted by area.
fn fit(mesh: &TriMesh, faces: &[u32], towards: DVec3) -> (DVec3, DVec3) {
    let mut sum = Covariance3::default();
    for &f in faces {
        sum.add(middle(mesh, f), mesh.area_normal(f as usize).length());
    }
    let normal = sum.eigen().1[0];
    (if normal.dot(towards) < 0.0 { -normal } else { normal }, sum.centroid())
}

fn smooth(raw: &[DVec3], neighbours: &[Vec<u32>]) -> Vec<DVec3> {
    let mut normals = raw.to_vec();
    for _ in 0..ROUNDS {
        let before = normals.clone();
        for (f, n) in normals.iter_mut().enumerate() {
            *n = neighbours[f].iter().fold(before[f], |sum, &g| sum + before[g as usize]);
        }
    }
    normals.iter().map(|n| n.normalize_or_zero()).collect()
}

/// Faces that share an edge with each face.
fn neighbours(mesh: &TriMesh) -> Vec<Vec<u32>> {
    let mut sides: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.faces.len());
    for (f, face) in mesh.faces.iter().enumerate() {
        for k in 0..3 {
            let (u, v) = (face[k], face[(k + 1) % 3]);
            sides.push((u.min(v), u.max(v), f as u32));
        }
    }
    sides.sort_unstable();
    let mut out = vec![Vec::new(); mesh.faces.len()];
    for pair in sides.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            out[pair[0].2 as usize].push(pair[1].2);
            out[pair[1].2 as usize].push(pair[0].2);
        }
    }
    out
}
