//! Affine transforms of glTF nodes, in double precision.

use gable_geometry::DVec3;

/// Columns of a 3 × 3 matrix, and a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transform {
    columns: [DVec3; 3],
    shift: DVec3,
}

impl Transform {
    pub(crate) const IDENTITY: Self = Self { columns: [DVec3::X, DVec3::Y, DVec3::Z], shift: DVec3::ZERO };

    /// The transform that first applies a node's own 4 × 4 matrix, by columns, then this one.
    pub(crate) fn then(&self, matrix: &[[f64; 4]; 4]) -> Self {
        let column = |at: usize| {
            let [x, y, z, _] = matrix[at];
            DVec3::new(x, y, z)
        };
        Self { columns: [0, 1, 2].map(|at| self.turn(column(at))), shift: self.apply(column(3)) }
    }

    /// The transform of a matrix by its rows.
    pub(crate) fn of_rows([x, y, z]: [DVec3; 3]) -> Self {
        let column = |at: usize| DVec3::new(x[at], y[at], z[at]);
        Self { columns: [0, 1, 2].map(column), shift: DVec3::ZERO }
    }

    /// The transform that first shifts by a vector, then does this one.
    pub(crate) fn after_shift(&self, by: DVec3) -> Self {
        Self { columns: self.columns, shift: self.apply(by) }
    }

    /// The transform that first does another, then this one.
    pub(crate) fn after(&self, first: &Self) -> Self {
        Self { columns: first.columns.map(|column| self.turn(column)), shift: self.apply(first.shift) }
    }

    fn turn(&self, v: DVec3) -> DVec3 {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }

    /// A point, transformed.
    pub(crate) fn apply(&self, point: DVec3) -> DVec3 {
        self.turn(point) + self.shift
    }

    /// Whether triangles turn over.
    pub(crate) fn mirrors(&self) -> bool {
        self.columns[0].cross(self.columns[1]).dot(self.columns[2]) < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_moves_with_its_parent() {
        let quarter = [[0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [10.0, 0.0, 0.0, 1.0]];
        let flip = [[-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 5.0, 0.0, 1.0]];
        let parent = Transform::IDENTITY.then(&quarter);
        let child = parent.then(&flip);
        // (1, 2, 3) → (−1, 7, 3) → (−7, −1, 3) + (10, 0, 0)
        assert_eq!(child.apply(DVec3::new(1.0, 2.0, 3.0)), DVec3::new(3.0, -1.0, 3.0));
        assert!(child.mirrors() && !parent.mirrors());
    }
}
