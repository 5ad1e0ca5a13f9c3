//! The unit of the stream.

use gable_geometry::DVec3;

/// One triangle of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Corners, world coordinates, z up, counter-clockwise seen from outside.
    pub corners: [DVec3; 3],
    /// Texture coordinates (u right, v up, as OBJ has them); outside 0..1 the image repeats.
    pub uv: Option<[[f32; 2]; 3]>,
    /// Vertex colours, sRGB.
    pub colours: Option<[[u8; 3]; 3]>,
    /// Index into the scene's materials; [`Triangle::NO_MATERIAL`] for none.
    pub material: u32,
}

impl Triangle {
    /// The material index of a triangle that has none.
    pub const NO_MATERIAL: u32 = u32::MAX;
}
