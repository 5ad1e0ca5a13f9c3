//! Coordinates as they are written: multiples of 0.1 mm.
//!
//! Rounding can make a solid invalid that was valid before (corners that fall together, slivers that collapse), so
//! what is validated must be what is written. The writers write `quantised(shell)` and nothing else.

use crate::{Face, Shell};
use gable_geometry::DVec3;
use std::collections::HashMap;

/// Lattice steps in a metre: the writers' `scale` is its inverse, 0.0001.
pub const STEPS_PER_METRE: f64 = 10_000.0;

/// Lattice coordinates of a local point, nearest first. The lattice hangs on the local origin, whatever tile or file
/// the point is written to. Beyond 9e14 m the value saturates.
#[must_use]
pub fn lattice(p: DVec3) -> [i64; 3] {
    (p * STEPS_PER_METRE).to_array().map(|v| v.round() as i64)
}

/// The local point of lattice coordinates: each the f64 nearest to its decimal.
#[must_use]
pub fn from_lattice(q: [i64; 3]) -> DVec3 {
    DVec3::from_array(q.map(|v| v as f64 / STEPS_PER_METRE))
}

/// The shell as it will be written: vertices on the lattice, equal ones merged in order of first use, unused ones
/// dropped; repeated corners of a ring united; rings with fewer than three corners left out, and faces whose outer
/// ring is. Leaving out such a face keeps a closed shell closed: its two remaining edges cancel each other.
///
/// Idempotent. O(corners). Indices out of range make their face vanish; validate the shell itself to see them.
#[must_use]
pub fn quantised(shell: &Shell) -> Shell {
    let mut index: HashMap<[i64; 3], u32> = HashMap::with_capacity(shell.vertices.len());
    let mut out = Shell::default();
    for face in &shell.faces {
        let mut rings: Vec<Vec<[i64; 3]>> = Vec::with_capacity(face.rings.len());
        for (r, ring) in face.rings.iter().enumerate() {
            let corners = ring.iter().map(|&i| shell.vertices.get(i as usize).filter(|p| p.is_finite()));
            let Some(mut corners) = corners.map(|p| p.map(|&p| lattice(p))).collect::<Option<Vec<_>>>() else {
                rings.clear();
                break;
            };
            corners.dedup();
            while corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            if corners.len() >= 3 {
                rings.push(corners);
            } else if r == 0 {
                break;
            }
        }
        if rings.is_empty() {
            continue;
        }
        let vertices = &mut out.vertices;
        let mut place = |q: [i64; 3]| {
            *index.entry(q).or_insert_with(|| {
                vertices.push(from_lattice(q));
                (vertices.len() - 1) as u32
            })
        };
        let rings = rings.into_iter().map(|ring| ring.into_iter().map(&mut place).collect()).collect();
        out.faces.push(Face { rings, semantic: face.semantic, attributes: face.attributes.clone() });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shell::samples::{cuboid, gabled};
    use gable_geometry::dvec3;

    #[test]
    fn rounds_merges_and_drops() {
        let mut shell = cuboid(dvec3(0.0, 0.0, 0.0), dvec3(1.000_04, 2.0, 0.000_03));
        shell.vertices.push(dvec3(9.0, 9.0, 9.0));
        let written = quantised(&shell);
        // The box is 0 high: floor and roof remain with the same four corners, the walls collapse.
        assert_eq!(written.vertices.len(), 4);
        assert_eq!(written.faces.len(), 2);
        assert!(written.vertices.contains(&dvec3(1.0, 2.0, 0.0)));
        assert_eq!(quantised(&written), written);
    }

    #[test]
    fn moves_nothing_further_than_half_a_step() {
        let house = gabled(dvec3(0.123_456_7, -7.654_321, 3.333_333_3));
        let written = quantised(&house);
        assert_eq!(written.faces.len(), house.faces.len());
        for (a, b) in house.faces.iter().zip(&written.faces) {
            for (&i, &j) in a.rings[0].iter().zip(&b.rings[0]) {
                let gap = house.vertices[i as usize] - written.vertices[j as usize];
                assert!(gap.abs().max_element() <= 0.5e-4 + 1e-12);
            }
        }
    }

    #[test]
    fn bad_indices_make_no_panic() {
        let mut shell = cuboid(DVec3::ZERO, DVec3::ONE);
        shell.faces[2].rings[0][1] = 99;
        shell.vertices[7].x = f64::NAN;
        assert!(quantised(&shell).faces.len() < 6);
    }
}
