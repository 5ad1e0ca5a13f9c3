//! Pictures of a city seen from above, as PNG.

use crate::Error;
use crate::height_raster::{HeightRaster, NONE};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

/// Colours (red, green, blue).
pub(crate) type Colour = [u8; 3];

/// Nothing there.
pub(crate) const BLANK: Colour = [250, 250, 248];

/// Errors of this much have full colour, metres.
pub(crate) const FULL: f64 = 1.0;

/// Blue for too low, white for right, red for too high.
pub(crate) fn error_colour(error: f64) -> Colour {
    let t = (error / FULL).clamp(-1.0, 1.0);
    let (far, near) = if t < 0.0 { ([33.0, 102.0, 172.0], -t) } else { ([178.0, 24.0, 43.0], t) };
    let mix = |k: usize| (236.0 + (far[k] - 236.0) * near.sqrt()) as u8;
    [mix(0), mix(1), mix(2)]
}

/// A PNG of pixels given by column and row, row 0 being the southern one.
pub(crate) fn png(width: usize, height: usize, colour: impl Fn(usize) -> Colour) -> Result<Vec<u8>, Error> {
    let mut pixels = Vec::with_capacity(3 * width * height);
    for row in (0..height).rev() {
        for column in 0..width {
            pixels.extend(colour(row * width + column));
        }
    }
    let mut out = Vec::new();
    PngEncoder::new(&mut out).write_image(&pixels, width as u32, height as u32, ExtendedColorType::Rgb8)?;
    Ok(out)
}

/// Shading of heights by light from the north-west, between the given heights.
pub(crate) fn shade(raster: &HeightRaster, at: usize, low: f64, high: f64) -> Colour {
    if raster.tag[at] == NONE {
        return BLANK;
    }
    let (x, y) = (at % raster.width, at / raster.width);
    let z = |x: usize, y: usize| {
        let n = y * raster.width + x;
        if raster.tag[n] == NONE { raster.z[at] } else { raster.z[n] }
    };
    let slope = |a: f64, b: f64| ((b - a) / (2.0 * raster.step)).clamp(-3.0, 3.0);
    let dx = slope(z(x.saturating_sub(1), y), z((x + 1).min(raster.width - 1), y));
    let dy = slope(z(x, y.saturating_sub(1)), z(x, (y + 1).min(raster.height - 1)));
    let light = ((dx - dy + 1.6) / (2.3 * (1.0 + dx * dx + dy * dy).sqrt())).clamp(0.0, 1.0);
    let tone = ((raster.z[at] - low) / (high - low).max(0.1)).clamp(0.0, 1.0);
    [0.55 + 0.4 * tone, 0.5 + 0.3 * tone, 0.45].map(|c| (255.0 * (c * (0.45 + 0.75 * light)).clamp(0.0, 1.0)) as u8)
}

/// Base64 (RFC 4648) with padding.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let n = (0..3).fold(0_u32, |n, k| n << 8 | u32::from(chunk.get(k).copied().unwrap_or(0)));
        for k in 0..4 {
            let digit = DIGITS[(n >> (18 - 6 * k) & 63) as usize];
            out.push(if k > chunk.len() { '=' } else { char::from(digit) });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        for (text, code) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(text.as_bytes()), code);
        }
    }

    #[test]
    fn pictures_have_north_above() {
        let bytes = png(1, 2, |at| if at == 0 { [255, 0, 0] } else { [0, 0, 255] }).unwrap();
        let picture = image::load_from_memory(&bytes).unwrap().to_rgb8();
        assert_eq!((picture.get_pixel(0, 0).0, picture.get_pixel(0, 1).0), ([0, 0, 255], [255, 0, 0]));
        assert_eq!(error_colour(0.0), [236; 3]);
        assert_eq!(error_colour(-5.0), error_colour(-1.0));
    }
}
