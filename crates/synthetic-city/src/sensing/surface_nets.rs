//! Naive surface nets (Gibson 1998): one vertex for each cell that the surface passes, at the mean of
//! the crossings of its edges; one quad for each lattice edge that the surface crosses.
//!
//! A quad belongs to the tile that owns the lower end of its edge, so the tiles of a city cover the
//! surface once. Linear in the voxels.

use super::TriMesh;
use super::VOXEL;
use super::field::Field;
use gable_geometry::DVec3;

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

/// Mean of the zero crossings on the twelve edges of a cell whose lower corner is sample `cell`.
fn crossing(field: &Field, cell: usize) -> DVec3 {
    let [nx, _, nz] = field.size;
    let step = [nz, nx * nz, 1];
    let unit = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut sum = DVec3::ZERO;
    let mut count = 0.0;
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for corner in 0..4 {
            let (a, b) = (corner & 1, corner >> 1);
            let k = cell + a * step[u] + b * step[v];
            let (from, to) = (field.distance[k], field.distance[k + step[axis]]);
            if (from > 0.0) != (to > 0.0) {
                let t = f64::from(from / (from - to));
                sum += unit[u] * a as f64 + unit[v] * b as f64 + unit[axis] * t;
                count += 1.0;
            }
        }
    }
    let l = cell % nz;
    let column = cell / nz;
    field.centre(column % nx, column / nx, l) + sum * (VOXEL / count)
}
