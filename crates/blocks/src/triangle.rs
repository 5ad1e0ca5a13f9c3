//! The triangles of a block, on the coordinate lattice.

use bytemuck::{Pod, Zeroable};
use gable_geometry::{DVec3, dvec3};

/// Units of the coordinate lattice per metre: corners are stored as whole multiples of 2⁻¹³ m (0.12 mm), so
/// that a triangle has the same corners in every block that holds it, whatever the grid.
pub const UNITS_PER_METRE: f64 = 8192.0;

/// One triangle of a block file: corners on the coordinate lattice of the local frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BlockTriangle {
    /// Corners in units of 2⁻¹³ m from the local origin.
    pub corners: [[i32; 3]; 3],
    /// Texture coordinates (u right, v up); zero without a texture.
    pub uv: [[f32; 2]; 3],
    /// Index into the scene's materials; `u32::MAX` for none.
    pub material: u32,
    /// Vertex colours, sRGB, and 255 as fourth byte where they are given, else 0.
    pub colours: [[u8; 4]; 3],
}

impl BlockTriangle {
    /// Corners in local metres.
    #[must_use]
    pub fn positions(&self) -> [DVec3; 3] {
        self.corners.map(|[x, y, z]| dvec3(f64::from(x), f64::from(y), f64::from(z)) / UNITS_PER_METRE)
    }

    /// Whether the corners lie on a line; exact.
    #[must_use]
    pub fn is_sliver(&self) -> bool {
        let [a, b, c] = self.corners.map(|corner| corner.map(i128::from));
        let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
        [(0, 1), (1, 2), (2, 0)].into_iter().all(|(i, j)| u[i] * v[j] == u[j] * v[i])
    }

    /// Lowest and highest coordinates, in lattice units.
    #[must_use]
    pub fn bounds(&self) -> ([i32; 3], [i32; 3]) {
        let [a, b, c] = self.corners;
        let axis = |f: fn(i32, i32) -> i32, i: usize| f(f(a[i], b[i]), c[i]);
        ([0, 1, 2].map(|i| axis(i32::min, i)), [0, 1, 2].map(|i| axis(i32::max, i)))
    }
}

/// The triangles of one block: all that touch its core (the same triangle is in each block that it touches).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockMesh {
    /// Triangle soup, in the order of the input.
    pub triangles: Vec<BlockTriangle>,
}
