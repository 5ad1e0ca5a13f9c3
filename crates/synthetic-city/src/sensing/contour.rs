//! Dual contouring (Ju et al. 2002): one vertex for each cell that the surface passes, near the tangent
//! planes at the crossings of its edges; one quad for each lattice edge that the surface crosses. Plain
//! surface nets (the mean of the crossings) cut corners by half as much again as real meshes do.
//!
//! A quad belongs to the tile that owns the lower end of its edge, so the tiles of a city cover the
//! surface once. Linear in the voxels.

use super::TriMesh;
use super::VOXEL;
use super::field::Field;
use gable_geometry::DVec3;
use glam::DMat3;

/// Weight of the distance to the mean of the crossings.
const PULL: f64 = 0.03;

/// Triangles of the zero level whose edges begin in the voxels `core` (absolute: x from, x to, y from, y to).
pub(crate) fn surface(field: &Field, core: [i64; 4]) -> TriMesh {
    let [nx, ny, nz] = field.size;
    let mut mesh = TriMesh::default();
    let mut vertex = vec![u32::MAX; nx * ny * nz];
    let step = [nz, nx * nz, 1];
    let inside = |k: usize| field.distance[k] > 0.0;
    for j in 1..ny - 1 {
        if !(core[2]..core[3]).contains(&(field.origin[1] + j as i64)) {
            continue;
        }
        for i in 1..nx - 1 {
            if !(core[0]..core[1]).contains(&(field.origin[0] + i as i64)) {
                continue;
            }
            for l in 1..nz - 1 {
                let k = field.index(i, j, l);
                for axis in 0..3 {
                    let other = k + step[axis];
                    if inside(k) == inside(other) {
                        continue;
                    }
                    let (u, v) = (step[(axis + 1) % 3], step[(axis + 2) % 3]);
                    let mut quad = [k - u - v, k - v, k, k - u].map(|cell| {
                        if vertex[cell] == u32::MAX {
                            vertex[cell] = mesh.vertices.len() as u32;
                            mesh.vertices.push(crossing(field, cell));
                        }
                        vertex[cell]
                    });
                    if !inside(k) {
                        quad.reverse();
                    }
                    let p = quad.map(|v| mesh.vertices[v as usize]);
                    if p[0].distance_squared(p[2]) <= p[1].distance_squared(p[3]) {
                        mesh.faces.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
                    } else {
                        mesh.faces.extend([[quad[0], quad[1], quad[3]], [quad[1], quad[2], quad[3]]]);
                    }
                }
            }
        }
    }
    mesh
}

/// Vertex of the cell whose lower corner is sample `cell`: the place nearest to the tangent planes at the
/// zero crossings on its edges, drawn to their mean by [`PULL`].
fn crossing(field: &Field, cell: usize) -> DVec3 {
    let [nx, _, nz] = field.size;
    let step = [nz, nx * nz, 1];
    let unit = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut points = [(DVec3::ZERO, DVec3::ZERO); 12];
    let mut count = 0;
    let mut mean = DVec3::ZERO;
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for corner in 0..4 {
            let (a, b) = (corner & 1, corner >> 1);
            let k = cell + a * step[u] + b * step[v];
            let other = k + step[axis];
            let (from, to) = (field.distance[k], field.distance[other]);
            if (from > 0.0) != (to > 0.0) {
                let t = f64::from(from / (from - to));
                let place = unit[u] * a as f64 + unit[v] * b as f64 + unit[axis] * t;
                let normal = gradient(field, k).lerp(gradient(field, other), t).normalize_or_zero();
                points[count] = (place, normal);
                mean += place;
                count += 1;
            }
        }
    }
    mean /= count as f64;
    let place = mean + towards_planes(&points[..count], mean).clamp_length_max(0.7);
    let l = cell % nz;
    let column = cell / nz;
    field.centre(column % nx, column / nx, l) + place * VOXEL
}

/// Step from the mean that makes Σ (n·(x − p))² + PULL·|x − mean|² least.
fn towards_planes(points: &[(DVec3, DVec3)], mean: DVec3) -> DVec3 {
    let mut m = DMat3::from_diagonal(DVec3::splat(PULL));
    let mut r = DVec3::ZERO;
    for &(p, n) in points {
        m += DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        r += n * n.dot(p - mean);
    }
    m.inverse() * r
}

/// Differences across a sample; the field's border counts as flat.
fn gradient(field: &Field, k: usize) -> DVec3 {
    let [nx, _, nz] = field.size;
    let d = |step: usize| {
        let (low, high) = (k.saturating_sub(step), (k + step).min(field.distance.len() - 1));
        f64::from(field.distance[high] - field.distance[low])
    };
    DVec3::new(d(nz), d(nx * nz), d(1))
}
