//! JPEG 2000 images.

use crate::budget;
use crate::texture::check_size;
use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};
use image::{DynamicImage, RgbImage};

/// Bytes that the decoder keeps for each sample: its coefficient and its value.
const SAMPLE: u64 = 8;

/// Decodes an image, if its size as told in its header is not beyond what is read.
pub(crate) fn decode(bytes: &[u8]) -> Result<DynamicImage, String> {
    let image = Image::new(bytes, &DecodeSettings::default()).map_err(|e| e.to_string())?;
    let (width, height) = (image.width(), image.height());
    check_size(width, height)?;
    let colours = usize::from(image.color_space().num_channels());
    let samples = colours + usize::from(image.has_alpha());
    let pixels = u64::from(width) * u64::from(height);
    if pixels * samples as u64 * SAMPLE > budget::IMAGE_MEMORY {
        return Err("its pixels take more memory than the limit of 1 GiB".to_owned());
    }
    let mut context = DecoderContext::default();
    let data = image.decode(&mut context).map_err(|e| e.to_string())?.data_u8();
    if samples == 0 || data.len() as u64 != pixels * samples as u64 {
        return Err(format!("its {samples} channels are not of one size"));
    }
    let mut rgb = Vec::with_capacity(3 * pixels as usize);
    for pixel in data.chunks_exact(samples) {
        rgb.extend(match (colours, pixel) {
            (1 | 2, [grey, ..]) => [*grey; 3],
            (3, [r, g, b, ..]) => [*r, *g, *b],
            (4, [c, m, y, k, ..]) => [c, m, y].map(|ink| 255 - ink.saturating_add(*k)),
            _ => return Err(format!("it has {colours} channels of colour")),
        });
    }
    let image = RgbImage::from_raw(width, height, rgb).ok_or("its pixels are not all there")?;
    Ok(DynamicImage::ImageRgb8(image))
}
