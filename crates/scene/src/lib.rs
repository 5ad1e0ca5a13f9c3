//! Readers of city meshes: a stream of triangles with textures, in f64 world coordinates, z up.

use gable_geometry::DVec3;
use std::path::PathBuf;

/// What covers a triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Image file; `None` for plain colour. (Images inside a GLB are given a path by the reader, see its docs.)
    pub texture: Option<PathBuf>,
    /// Colour where there is no texture, sRGB.
    pub colour: [u8; 3],
}

/// One triangle of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Corners, world coordinates, z up, counter-clockwise seen from outside.
    pub corners: [DVec3; 3],
    /// Texture coordinates (u right, v up, as OBJ has them).
    pub uv: Option<[[f32; 2]; 3]>,
    /// Vertex colours, sRGB.
    pub colours: Option<[[u8; 3]; 3]>,
    /// Index into the scene's materials; `u32::MAX` for none.
    pub material: u32,
}
