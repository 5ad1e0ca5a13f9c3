//! Vertices that lie within the snap tolerance become one before anything is judged.

use super::{Code, Issue};
use crate::Shell;
use gable_geometry::DVec3;
use std::collections::HashMap;

/// A shell whose vertices are united within a tolerance. Faces keep their numbers.
pub(super) struct Snapped {
    /// Different points: each the first of the vertices that it stands for.
    pub(super) points: Vec<DVec3>,
    /// Rings of each face, as indices into `points`.
    pub(super) faces: Vec<Vec<Vec<u32>>>,
}

impl Snapped {
    /// Unites vertices in their order: a vertex joins the first earlier point closer than `tolerance`, or founds one.
    /// Points a millionth below the tolerance count as that far apart, so that neighbours on a lattice of the
    /// tolerance's step stay two, whatever the rounding of their coordinates.
    /// O(n) with a grid of cells as wide as the tolerance.
    pub(super) fn new(shell: &Shell, tolerance: f64) -> Result<Self, Issue> {
        if shell.faces.is_empty() {
            return Err(Issue::new(Code::Empty, None, "the geometry has no face"));
        }
        if !shell.is_well_formed() {
            let message = "a vertex index is out of range or a coordinate is not finite";
            return Err(Issue::new(Code::InvalidInput, None, message));
        }
        let (points, map) = unite(&shell.vertices, tolerance);
        let ring = |ring: &Vec<u32>| ring.iter().map(|&i| map[i as usize]).collect();
        let faces = shell.faces.iter().map(|face| face.rings.iter().map(ring).collect()).collect();
        Ok(Self { points, faces })
    }

    /// Text of a point for messages.
    pub(super) fn place(p: DVec3) -> String {
        format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z)
    }
}

/// The different points and, for each vertex, which of them it is.
fn unite(vertices: &[DVec3], tolerance: f64) -> (Vec<DVec3>, Vec<u32>) {
    let mut points: Vec<DVec3> = Vec::with_capacity(vertices.len());
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(vertices.len());
    let exact = tolerance <= 0.0;
    let reach2 = (tolerance * (1.0 - 1e-6)).powi(2);
    let mut map = Vec::with_capacity(vertices.len());
    for &v in vertices {
        let cell = if exact {
            // + 0.0 makes the two zeros one.
            (v + DVec3::ZERO).to_array().map(|c| c.to_bits() as i64)
        } else {
            (v / tolerance).floor().to_array().map(|c| c as i64)
        };
        let mut found: Option<u32> = None;
        let reach = if exact { 0..=0 } else { -1..=1i64 };
        for dx in reach.clone() {
            for dy in reach.clone() {
                for dz in reach.clone() {
                    let key = [cell[0].wrapping_add(dx), cell[1].wrapping_add(dy), cell[2].wrapping_add(dz)];
                    for &i in cells.get(&key).into_iter().flatten() {
                        let same = exact || points[i as usize].distance_squared(v) < reach2;
                        if same && found.is_none_or(|f| i < f) {
                            found = Some(i);
                        }
                    }
                }
            }
        }
        let index = found.unwrap_or_else(|| {
            points.push(v);
            cells.entry(cell).or_default().push((points.len() - 1) as u32);
            (points.len() - 1) as u32
        });
        map.push(index);
    }
    (points, map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;
    use proptest::prelude::*;

    proptest! {
        /// The grid finds what comparing with every earlier point finds.
        #[test]
        fn equals_brute_force(raw in prop::collection::vec((-20..20i32, -20..20i32, -3..3i32), 0..60)) {
            let vertices: Vec<_> = raw.iter().map(|&(x, y, z)| dvec3(x.into(), y.into(), z.into()) * 0.37e-3).collect();
            let (points, map) = unite(&vertices, 0.001);
            let mut expected: Vec<DVec3> = Vec::new();
            for (v, &m) in vertices.iter().zip(&map) {
                let i = expected.iter().position(|p| p.distance(*v) < 0.000_999_999).unwrap_or(expected.len());
                if i == expected.len() {
                    expected.push(*v);
                }
                prop_assert_eq!(m as usize, i);
            }
            prop_assert_eq!(points, expected);
        }
    }
}
