//! Colour of a pixel in CIE L\*a\*b\* and in the illumination-invariant space of Chong, Gortler & Zickler 2008.
//!
//! The second space is `A · ln(B · XYZ)`: a change of the light multiplies the coordinates `B · XYZ` by a factor each,
//! so it only shifts the logarithms, and differences between pixels stay.

use std::sync::LazyLock;

/// To the sharpened sensor basis (Chong 2008, §4).
const B: [[f32; 3]; 3] = [
    [0.946_522_9, 0.294_692_7, -0.131_341_9],
    [-0.117_917_9, 0.992_996, 0.007_371_554],
    [0.092_304_61, -0.046_457_94, 0.994_646_4],
];

/// From the logarithms to perceptual axes (Chong 2008, §4).
const A: [[f32; 3]; 3] =
    [[27.074_39, -22.807_83, -1.806_681], [-5.646_736, -7.722_125, 12.865_03], [-4.163_133, -4.579_428, -4.576_049]];

/// White of sRGB (D65, 2°).
const WHITE: [f32; 3] = [0.950_47, 1.0, 1.088_83];

/// Least value under the logarithm: about one step of an 8-bit channel, so that black stays finite.
const DARK: f32 = 1.0 / 512.0;

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let c = i as f32 / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
});

/// The six colour features: L\* (0–100), a\*, b\*, and the three illumination-invariant coordinates.
///
/// `rgb` is 8-bit sRGB.
#[must_use]
pub fn colour_features(rgb: [u8; 3]) -> [f32; 6] {
    let [r, g, b] = rgb.map(|c| LINEAR[usize::from(c)]);
    let xyz = [
        0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b,
        0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b,
        0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b,
    ];
    let [fx, fy, fz] = [0, 1, 2].map(|i| lab_curve(xyz[i] / WHITE[i]));
    let log = B.map(|row| (row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2]).max(DARK).ln());
    let [i1, i2, i3] = A.map(|row| row[0] * log[0] + row[1] * log[1] + row[2] * log[2]);
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz), i1, i2, i3]
}

fn lab_curve(t: f32) -> f32 {
    const KNEE: f32 = 216.0 / 24389.0;
    if t > KNEE { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lab_of_known_colours() {
        // sRGB reference values (Lindbloom's calculator, D65).
        for (rgb, lab) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 128, 0], [46.23, -51.70, 49.90]),
            ([10, 10, 10], [2.74, 0.0, 0.0]),
        ] {
            let found = colour_features(rgb);
            for (f, l) in found.iter().zip(lab) {
                assert!((f - l).abs() < 0.05, "{rgb:?}: {found:?}");
            }
        }
    }

    #[test]
    fn a_change_of_light_only_shifts_the_invariant_space() {
        // Halving the light in linear space: 188 and 137, 225 and 165 are such pairs in sRGB.
        let (p, q) = (colour_features([188, 188, 188]), colour_features([137, 137, 137]));
        let (r, s) = (colour_features([225, 225, 225]), colour_features([165, 165, 165]));
        for i in 3..6 {
            assert!(((p[i] - q[i]) - (r[i] - s[i])).abs() < 0.2, "axis {i}");
        }
    }
}
