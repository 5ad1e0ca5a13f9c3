//! Defects that do not emerge from the field: spikes, folds, torn patches, doubled faces.

use super::TriMesh;
use super::columns::Columns;
use super::field::Field;
use crate::noise::{hash, noise3, unit};
use gable_geometry::DVec3;

/// Tears holes where hardly any camera saw, in water, and now and then elsewhere.
pub(crate) fn tear(mesh: &mut TriMesh, field: &Field, columns: &Columns, seed: u64) {
    let centre = |f: &[u32; 3]| f.iter().map(|&v| mesh.vertices[v as usize]).sum::<DVec3>() / 3.0;
    let kept: Vec<[u32; 3]> = mesh
        .faces
        .iter()
        .filter(|f| {
            let p = centre(f);
            let wet = if columns.is_water(p) { 0.35 } else { 0.0 };
            let limit = 0.98 - 0.42 * f64::from(field.hidden(p)) - wet;
            noise3(seed ^ 0x7ea, 2.4, p) < limit
        })
        .copied()
        .collect();
    mesh.faces = kept;
}

/// Pulls a few vertices far down (about one for 3,000 faces) and folds some faces over their neighbours.
pub(crate) fn spike_and_fold(mesh: &mut TriMesh, seed: u64) {
    let mut border = vec![0_i32; mesh.vertices.len()];
    for face in &mesh.faces {
        for k in 0..3 {
            border[face[k] as usize] += face[(k + 1) % 3] as i32 - face[(k + 2) % 3] as i32;
        }
    }
    for (v, p) in mesh.vertices.iter_mut().enumerate() {
        // Around an inner vertex every neighbour is once the next and once the one after.
        if border[v] != 0 {
            continue;
        }
        let key = (*p * 1000.0).round();
        let h = |k: i64| unit(hash(seed ^ 0x5b1 ^ k as u64, key.x as i64, key.y as i64, key.z as i64));
        if h(0) < 1.0 / 1500.0 {
            p.z -= 0.8 + 3.0 * h(1);
        } else if h(2) < 1.0 / 400.0 {
            *p += DVec3::new(h(3) - 0.5, h(4) - 0.5, h(5) - 0.5) * 1.6;
        }
    }
}

/// Shifts a whole tile by 10 to 25 mm in height, up and down in turn: seams of 2 to 5 cm.
pub(crate) fn misplace(mesh: &mut TriMesh, seed: u64, ix: i64, iy: i64) {
    let size = 0.010 + 0.015 * unit(hash(seed ^ 0x5ea, ix, iy, 0));
    let dz = if (ix + iy).rem_euclid(2) == 0 { size } else { -size };
    for p in &mut mesh.vertices {
        p.z += dz;
    }
}
