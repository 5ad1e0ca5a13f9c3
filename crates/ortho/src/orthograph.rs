//! The orthograph: what a mesh looks like from straight above, on one window of the pixel lattice.

use crate::scan::floor;
use gable_geometry::DVec3;
use gable_raster::{GridWindow, Raster};

/// Steps of a normal's code along each axis, from −1 to 1.
const NORMAL_STEPS: f64 = 1023.0;

/// Steep surface whose projection falls into one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WallEvidence {
    /// Area of the steep surface itself (not of its projection), m².
    pub area: f32,
    /// Area-weighted mean of the horizontal outward unit normals: shorter than 1 where walls face different ways.
    pub normal: [f32; 2],
    /// Lowest height covered, metres; 0 without a wall.
    pub z_min: f32,
    /// Highest height covered, metres; 0 without a wall.
    pub z_max: f32,
}

/// Colour, height, normal and wall evidence of the topmost surface (Zhu 2018, §4), all on the same window.
#[derive(Clone, Debug, PartialEq)]
pub struct Orthograph {
    /// Height of the topmost surface at the pixel's centre, local metres; NaN where there is none.
    pub height: Raster<f32>,
    /// Colour of the topmost surface, sRGB; black where there is none.
    pub colour: Raster<[u8; 3]>,
    /// Whether the colour comes from a texture or from vertex colours (and not from a plain material).
    pub photographed: Raster<bool>,
    /// Unit normal of the topmost surface, turned up (z ≥ 0) and rounded by [`quantised_normal`]; zero where there
    /// is none.
    pub normal: Raster<[f32; 3]>,
    /// Steep surface over the pixel, whatever lies above it.
    pub walls: Raster<WallEvidence>,
}

impl Orthograph {
    /// An orthograph without any surface.
    #[must_use]
    pub fn empty(window: GridWindow) -> Self {
        Self {
            height: Raster::filled(window, f32::NAN),
            colour: Raster::filled(window, [0; 3]),
            photographed: Raster::filled(window, false),
            normal: Raster::filled(window, [0.0; 3]),
            walls: Raster::filled(window, WallEvidence::default()),
        }
    }

    /// The window.
    #[must_use]
    pub fn window(&self) -> GridWindow {
        self.height.window()
    }

    /// The part on `window`; pixels that this orthograph does not have are empty.
    #[must_use]
    pub fn crop(&self, window: GridWindow) -> Self {
        let mut out = Self::empty(window);
        out.paste(self);
        out
    }

    /// Takes over the pixels that `other` shares with this one.
    pub fn paste(&mut self, other: &Self) {
        self.height.paste(&other.height);
        self.colour.paste(&other.colour);
        self.photographed.paste(&other.photographed);
        self.normal.paste(&other.normal);
        self.walls.paste(&other.walls);
    }

    /// Pixels with a surface, and how many of them are photographed.
    #[must_use]
    pub fn coverage(&self) -> (usize, usize) {
        let covered = self.height.values().iter().filter(|h| !h.is_nan()).count();
        (covered, self.photographed.values().iter().filter(|&&p| p).count())
    }
}

/// A normal turned up, made unit and rounded to the code in which it is stored, so that what is computed from it is
/// the same before and after a file. The error stays under 0.1°. Zero stays zero.
#[must_use]
pub fn quantised_normal(normal: DVec3) -> [f32; 3] {
    decode_normal(encode_normal(normal))
}

/// The code of "no normal".
pub(crate) const NO_NORMAL: [i16; 2] = [i16::MIN; 2];

/// Hemi-octahedral code: the upper half of the octahedron |x|+|y|+|z| = 1 turned by 45°, so that it fills a square
/// (Cigolle et al. 2014).
pub(crate) fn encode_normal(normal: DVec3) -> [i16; 2] {
    let n = if normal.z < 0.0 { -normal } else { normal };
    let sum = n.x.abs() + n.y.abs() + n.z;
    if sum <= 0.0 || !sum.is_finite() {
        return NO_NORMAL;
    }
    let (x, y) = (n.x / sum, n.y / sum);
    [x + y, x - y].map(|v| floor(v * NORMAL_STEPS + 0.5) as i16)
}

/// The normal of a code.
pub(crate) fn decode_normal(code: [i16; 2]) -> [f32; 3] {
    if code == NO_NORMAL {
        return [0.0; 3];
    }
    let [u, v] = code.map(|c| f64::from(c) / NORMAL_STEPS);
    let (x, y) = (0.5 * (u + v), 0.5 * (u - v));
    DVec3::new(x, y, (1.0 - x.abs() - y.abs()).max(0.0)).normalize_or_zero().to_array().map(|c| c as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;

    #[test]
    fn normals_survive_their_code() {
        let mut rng = Counter::new(5);
        for _ in 0..20_000 {
            let n = DVec3::new(rng.normal(), rng.normal(), rng.normal()).normalize();
            let up = if n.z < 0.0 { -n } else { n };
            let q = quantised_normal(n);
            let back = DVec3::new(q[0].into(), q[1].into(), q[2].into());
            assert!(up.angle_between(back) < 0.1f64.to_radians(), "{up} became {back}");
            assert_eq!(encode_normal(back), encode_normal(n), "rounding twice changes nothing");
        }
        assert_eq!(quantised_normal(DVec3::Z), [0.0, 0.0, 1.0]);
        assert_eq!(quantised_normal(DVec3::ZERO), [0.0; 3]);
    }
}
