//! Textures with their mip pyramid, and how a pixel's footprint is averaged over one.

use crate::scan::floor;
use gable_geometry::DVec2;
use std::sync::{Arc, LazyLock};

/// Steps of the table that goes from linear light back to sRGB.
const LINEAR_STEPS: usize = 8191;
/// Probes along the longer axis of an oblique footprint, at most.
const MAX_PROBES: usize = 6;

/// Linear light in 0..=`LINEAR_STEPS` for each sRGB byte.
static TO_LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let v = byte as f64 / 255.0;
        let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
        (linear * LINEAR_STEPS as f64) as f32
    })
});

/// The sRGB byte for each step of linear light.
static TO_SRGB: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=LINEAR_STEPS)
        .map(|step| {
            let v = step as f64 / LINEAR_STEPS as f64;
            let coded = if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
            (coded * 255.0).round() as u8
        })
        .collect()
});

fn to_srgb(linear: [f32; 3]) -> [u8; 3] {
    linear.map(|v| TO_SRGB[((v + 0.5) as usize).min(LINEAR_STEPS)])
}

/// Where the colours of a scene's materials come from.
pub trait TextureSource: Sync {
    /// The texture of a material; `None` if it has none or it cannot be read.
    fn texture(&self, material: u32) -> Option<Arc<Texture>>;

    /// The plain colour of a material, sRGB; grey if it has none.
    fn colour(&self, material: u32) -> [u8; 3];
}

/// A source without textures: every material has the same colour.
#[derive(Clone, Copy, Debug)]
pub struct PlainColours(pub [u8; 3]);

impl TextureSource for PlainColours {
    fn texture(&self, _material: u32) -> Option<Arc<Texture>> {
        None
    }

    fn colour(&self, _material: u32) -> [u8; 3] {
        self.0
    }
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    /// sRGB, row by row from the top.
    texels: Vec<[u8; 3]>,
}

impl Level {
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let (linear, coded) = (&*TO_LINEAR, &*TO_SRGB);
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            let upper = &self.texels[2 * y * self.width..][..self.width];
            let lower = &self.texels[(2 * y + 1).min(self.height - 1) * self.width..][..self.width];
            for x in 0..width {
                let (left, right) = (2 * x, (2 * x + 1).min(self.width - 1));
                let four = [upper[left], upper[right], lower[left], lower[right]];
                texels.push(std::array::from_fn(|c| {
                    let sum: f32 = four.iter().map(|t| linear[t[c] as usize]).sum();
                    coded[(0.25 * sum + 0.5) as usize]
                }));
            }
        }
        Self { width, height, texels }
    }

    /// Bilinear interpolation in linear light; `x` and `y` in texels of this level, centres at halves.
    #[inline]
    fn bilinear(&self, x: f64, y: f64, repeat: bool) -> [f32; 3] {
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (floor(x), floor(y));
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let inner = x0 >= 0 && y0 >= 0 && x0 < self.width as i64 - 1 && y0 < self.height as i64 - 1;
        let four = if inner {
            let at = y0 as usize * self.width + x0 as usize;
            let (upper, lower) = (&self.texels[at..at + 2], &self.texels[at + self.width..at + self.width + 2]);
            [upper[0], upper[1], lower[0], lower[1]]
        } else {
            let index = |i: i64, n: usize| match repeat {
                true => i.rem_euclid(n as i64) as usize,
                false => i.clamp(0, n as i64 - 1) as usize,
            };
            let texel = |x: i64, y: i64| self.texels[index(y, self.height) * self.width + index(x, self.width)];
            let (x1, y1) = (x0.saturating_add(1), y0.saturating_add(1));
            [texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1)]
        };
        let linear = &*TO_LINEAR;
        std::array::from_fn(|i| {
            let [a, b, c, d] = four.map(|t| linear[t[i] as usize]);
            let (upper, lower) = (a + (b - a) * fx, c + (d - c) * fx);
            upper + (lower - upper) * fy
        })
    }
}

/// An image and its halvings down to one texel. Halving averages in linear light.
#[derive(Debug)]
pub struct Texture {
    levels: Vec<Level>,
}

impl Texture {
    /// Builds the pyramid of an image: sRGB texels row by row from the top.
    /// `None` if it has no texel or their number is not `width · height`.
    #[must_use]
    pub fn new(width: usize, height: usize, texels: Vec<[u8; 3]>) -> Option<Self> {
        if texels.is_empty() || width.checked_mul(height) != Some(texels.len()) {
            return None;
        }
        let mut levels = vec![Level { width, height, texels }];
        while levels[levels.len() - 1].texels.len() > 1 {
            levels.push(levels[levels.len() - 1].halved());
        }
        Some(Self { levels })
    }

    /// Memory held, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|l| 3 * l.texels.len()).sum()
    }

    /// Width and height of the image in texels, as a vector.
    pub(crate) fn size(&self) -> DVec2 {
        DVec2::new(self.levels[0].width as f64, self.levels[0].height as f64)
    }

    /// Mean colour under a footprint whose centre is at `at` (texels of the image, y down).
    #[inline]
    pub(crate) fn sample(&self, at: DVec2, footprint: &Footprint) -> [u8; 3] {
        let mut sum = [0.0; 3];
        for probe in 0..footprint.probes {
            let along = (probe as f64 + 0.5) / footprint.probes as f64 - 0.5;
            let p = at + footprint.axis * along;
            let fine = self.at_level(p, footprint.level, footprint.repeat);
            let colour = if footprint.blend > 0.0 {
                let coarse = self.at_level(p, footprint.level + 1, footprint.repeat);
                std::array::from_fn(|c| fine[c] + (coarse[c] - fine[c]) * footprint.blend)
            } else {
                fine
            };
            for c in 0..3 {
                sum[c] += colour[c];
            }
        }
        to_srgb(sum.map(|v| v / footprint.probes as f32))
    }

    fn at_level(&self, p: DVec2, level: usize, repeat: bool) -> [f32; 3] {
        let level = level.min(self.levels.len() - 1);
        let scale = 1.0 / (1u64 << level) as f64;
        self.levels[level].bilinear(p.x * scale, p.y * scale, repeat)
    }
}

/// The parallelogram of texels under one pixel, as probes along its longer axis in one or two levels of the pyramid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    level: usize,
    blend: f32,
    axis: DVec2,
    probes: usize,
    repeat: bool,
}

impl Footprint {
    /// The footprint of a pixel whose sides are `east` and `north` in texels of the image. `repeat` says whether
    /// the image is continued beyond its border by itself (else by its border texels).
    pub(crate) fn new(east: DVec2, north: DVec2, repeat: bool) -> Self {
        // Axes of the ellipse that the footprint's matrix makes of the unit circle.
        let (p, q, r) = (
            east.x * east.x + north.x * north.x,
            east.x * east.y + north.x * north.y,
            east.y * east.y + north.y * north.y,
        );
        let (mean, half) = (0.5 * (p + r), 0.5 * (p - r));
        let root = (half * half + q * q).sqrt();
        let direction = if half > 0.0 { DVec2::new(half + root, q) } else { DVec2::new(q, root - half) };
        let direction = direction.normalize_or_zero();
        let (minor, major) = ((mean - root).max(0.0).sqrt(), (mean + root).sqrt().min(1e6));
        // A probe is as wide as the minor axis, or wider where the footprint is very oblique.
        let width = minor.max(major / MAX_PROBES as f64).max(1.0);
        let probes = ((major / width + 0.5) as usize).clamp(1, MAX_PROBES);
        let depth = (width as f32).log2();
        let level = depth as usize;
        Self {
            level,
            blend: depth - level as f32,
            axis: if probes > 1 {
                direction * (major - width).max(0.0) * probes as f64 / (probes - 1) as f64
            } else {
                DVec2::ZERO
            },
            probes,
            repeat,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_goes_there_and_back() {
        for byte in 0..=255u8 {
            assert_eq!(to_srgb([TO_LINEAR[byte as usize]; 3]), [byte; 3]);
        }
    }

    #[test]
    fn fine_stripes_average_to_their_mean_light() {
        // Stripes of black and white, one texel wide: half the light is sRGB 188.
        let texels = (0..64 * 64).map(|i| if i % 2 == 0 { [255; 3] } else { [0; 3] }).collect();
        let texture = Texture::new(64, 64, texels).unwrap();
        for scale in [4.0, 5.3, 8.0] {
            let footprint = Footprint::new(DVec2::new(scale, 0.0), DVec2::new(0.0, -scale), true);
            for x in [20.0, 21.3, 33.9] {
                let [r, g, b] = texture.sample(DVec2::new(x, 30.0), &footprint);
                assert!(r.abs_diff(188) <= 1 && r == g && g == b, "{r} at scale {scale}");
            }
        }
        // Across the stripes a footprint is long, along them short: still the mean.
        let footprint = Footprint::new(DVec2::new(6.0, 0.0), DVec2::new(0.0, 1.0), true);
        let [r, ..] = texture.sample(DVec2::new(31.0, 30.0), &footprint);
        assert!(r.abs_diff(188) <= 12, "{r}");
    }

    #[test]
    fn coarse_texels_are_interpolated() {
        let texture = Texture::new(2, 1, vec![[0; 3], [255; 3]]).unwrap();
        let footprint = Footprint::new(DVec2::new(0.1, 0.0), DVec2::new(0.0, 0.1), false);
        let at = |x: f64| texture.sample(DVec2::new(x, 0.5), &footprint)[0];
        assert_eq!((at(0.2), at(0.5), at(1.0), at(1.5), at(9.0)), (0, 0, 188, 255, 255));
        assert!(at(0.7) < at(0.8) && at(0.8) < at(1.2));
        assert!(Texture::new(2, 2, vec![[0; 3]; 3]).is_none());
        assert!(Texture::new(0, 0, vec![]).is_none());
    }
}
