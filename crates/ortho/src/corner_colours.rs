//! Colours at the corners of triangles, for what shows a mesh without its textures.

use crate::texture::{Footprint, Texture, TextureSource};
use gable_blocks::BlockTriangle;
use gable_geometry::DVec2;
use std::sync::Arc;

/// How far from a corner towards the middle of its triangle its colour is looked at: in an atlas, the neighbour's picture begins at
/// the edge.
const INWARD: f64 = 0.25;

/// Finds the colours of corners: of the texture, else of the vertices, else of the material. Triangles of one material in a row are
/// looked up once.
pub struct CornerColours<'a> {
    textures: &'a dyn TextureSource,
    size: f64,
    material: Option<u32>,
    texture: Option<Arc<Texture>>,
    plain: [u8; 3],
}

impl<'a> CornerColours<'a> {
    /// Colours averaged over squares of so many metres, or of the triangle if it is smaller.
    #[must_use]
    pub fn new(textures: &'a dyn TextureSource, size: f64) -> Self {
        Self { textures, size, material: None, texture: None, plain: [0; 3] }
    }

    /// sRGB colours of the corners.
    pub fn of(&mut self, triangle: &BlockTriangle) -> [[u8; 3]; 3] {
        if self.material != Some(triangle.material) {
            self.material = Some(triangle.material);
            self.texture = self.textures.texture(triangle.material);
            self.plain = self.textures.colour(triangle.material);
        }
        match &self.texture {
            Some(texture) => self.textured(texture, triangle),
            None if triangle.colours.iter().all(|c| c[3] != 0) => triangle.colours.map(|[r, g, b, _]| [r, g, b]),
            None => [self.plain; 3],
        }
    }

    fn textured(&self, texture: &Texture, triangle: &BlockTriangle) -> [[u8; 3]; 3] {
        // Texture files start at the top, v at the bottom.
        let at = triangle.uv.map(|[u, v]| DVec2::new(f64::from(u), 1.0 - f64::from(v)) * texture.size());
        let [a, b, c] = triangle.positions();
        let area = (b - a).cross(c - a).length();
        let texels = (at[1] - at[0]).perp_dot(at[2] - at[0]).abs();
        let side = if area > 0.0 { self.size.min(area.sqrt()) * (texels / area).sqrt() } else { 1.0 };
        let repeat = triangle.uv.iter().flatten().any(|t| !(-0.001..=1.001).contains(t));
        let footprint = Footprint::new(DVec2::new(side, 0.0), DVec2::new(0.0, side), repeat);
        let middle = (at[0] + at[1] + at[2]) / 3.0;
        at.map(|corner| texture.sample(corner.lerp(middle, INWARD), &footprint))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlainColours;

    struct Halves(Arc<Texture>);

    impl TextureSource for Halves {
        fn texture(&self, material: u32) -> Option<Arc<Texture>> {
            (material == 0).then(|| Arc::clone(&self.0))
        }

        fn colour(&self, _material: u32) -> [u8; 3] {
            [9; 3]
        }
    }

    #[test]
    fn corners_have_the_colours_of_texture_vertices_or_material() {
        // Red in the west, blue in the east.
        let texels = (0..64 * 64).map(|i| if i % 64 < 32 { [255, 0, 0] } else { [0, 0, 255] }).collect();
        let halves = Halves(Arc::new(Texture::new(64, 64, texels).unwrap()));
        let mut colours = CornerColours::new(&halves, 0.5);
        let metres = 8192;
        let textured = BlockTriangle {
            corners: [[0, 0, 0], [8 * metres, 0, 0], [0, 8 * metres, 0]],
            uv: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            ..BlockTriangle::default()
        };
        assert_eq!(colours.of(&textured), [[255, 0, 0], [0, 0, 255], [255, 0, 0]]);
        let plain = BlockTriangle { material: 1, ..textured };
        assert_eq!(colours.of(&plain), [[9; 3]; 3]);
        let painted = BlockTriangle { colours: [[1, 2, 3, 255], [4, 5, 6, 255], [7, 8, 9, 255]], ..plain };
        assert_eq!(colours.of(&painted), [[1, 2, 3], [4, 5, 6], [7, 8, 9]]);
        // A triangle without extent has a colour too.
        let point = BlockTriangle { corners: [[0; 3]; 3], ..textured };
        assert_eq!(colours.of(&point)[0], [255, 0, 0]);
        assert_eq!(CornerColours::new(&PlainColours([5; 3]), 1.0).of(&textured), [[5; 3]; 3]);
    }
}
