//! Leaves out triangles that say nothing.

use crate::triangle::{BlockMesh, BlockTriangle};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// What was left out of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CleanReport {
    /// Triangles without area on the coordinate lattice.
    pub degenerate: u64,
    /// Triangles with the same three corners as an earlier one, in whatever order.
    pub duplicate: u64,
}

impl CleanReport {
    /// Adds another block's counts.
    pub fn add(&mut self, other: Self) {
        self.degenerate += other.degenerate;
        self.duplicate += other.duplicate;
    }
}

/// Leaves out triangles without area and all but the first of those with the same three corners.
///
/// A triangle is judged by itself and by triangles with its very corners, which are in each block
/// that it is in, so it stays or goes whatever the grid. (Twins that face opposite ways count as
/// the same: seen from above they cover the same pixels.) Expected O(n).
pub fn clean(mesh: &mut BlockMesh) -> CleanReport {
    let mut report = CleanReport::default();
    let mut seen = HashSet::with_capacity(mesh.triangles.len());
    mesh.triangles.retain(|triangle| {
        if is_degenerate(triangle) {
            report.degenerate += 1;
            return false;
        }
        let mut corners = triangle.corners;
        corners.sort_unstable();
        let new = seen.insert(corners);
        report.duplicate += u64::from(!new);
        new
    });
    report
}

/// Whether the corners lie on a line; exact.
fn is_degenerate(triangle: &BlockTriangle) -> bool {
    let [a, b, c] = triangle.corners.map(|corner| corner.map(i128::from));
    let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(i, j)| u[i] * v[j] == u[j] * v[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn triangle(corners: [[i32; 3]; 3]) -> BlockTriangle {
        BlockTriangle { corners, ..BlockTriangle::default() }
    }

    #[test]
    fn leaves_out_slivers_and_twins() {
        let [a, b, c, d] = [[0, 0, 0], [i32::MAX, 0, 0], [0, i32::MIN, 7], [5, 5, 5]];
        let line = [[i32::MIN; 3], [0; 3], [i32::MAX; 3]];
        let soup = [[a, b, c], [a, a, c], [c, a, b], [b, a, c], [a, b, d], line, [a, b, c]];
        let mut mesh = BlockMesh { triangles: soup.map(triangle).to_vec() };
        let report = clean(&mut mesh);
        assert_eq!(report, CleanReport { degenerate: 2, duplicate: 3 });
        assert_eq!(mesh.triangles, [[a, b, c], [a, b, d]].map(triangle));
    }

    proptest! {
        #[test]
        fn agrees_with_comparing_all_pairs(soup in proptest::collection::vec(
            proptest::array::uniform3(proptest::array::uniform3(0i32..2)), 0..40,
        )) {
            let mut mesh = BlockMesh { triangles: soup.iter().map(|c| triangle(*c)).collect() };
            clean(&mut mesh);
            let same = |a: &[[i32; 3]; 3], b: &[[i32; 3]; 3]| a.iter().all(|c| b.contains(c)) && b.iter().all(|c| a.contains(c));
            let area = |[a, b, c]: [[i32; 3]; 3]| {
                let p = |v: [i32; 3]| gable_geometry::dvec3(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]));
                (p(b) - p(a)).cross(p(c) - p(a)).length()
            };
            let mut kept: Vec<[[i32; 3]; 3]> = Vec::new();
            for corners in soup {
                if area(corners) > 0.0 && !kept.iter().any(|k| same(k, &corners)) {
                    kept.push(corners);
                }
            }
            prop_assert_eq!(mesh.triangles.iter().map(|t| t.corners).collect::<Vec<_>>(), kept);
        }
    }
}
