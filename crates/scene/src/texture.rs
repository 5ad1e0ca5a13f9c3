//! Decoding of textures.

use crate::budget;
use crate::error::{SceneError, shown};
use crate::material::{Material, TextureSource};
use gable_files::{FileError, Reach};
use image::{DynamicImage, ImageDecoder as _, ImageFormat, ImageReader, Limits, RgbImage};
use std::io::{Cursor, Read as _};
use std::path::Path;

/// Decodes the image of a material; `None` if it has none.
///
/// Row 0 of the image is its top, so `v` = 1. An image of more than 32,768 pixels a side, 2²⁸ pixels (16,384 × 16,384) or 1 GiB
/// decoded is refused before it is decoded. Only files within `reach` are read.
///
/// # Errors
/// [`SceneError::Texture`] if the image is missing, may not be read, is broken, too large or neither JPEG nor PNG.
pub fn load_texture(material: &Material, reach: &Reach) -> Result<Option<RgbImage>, SceneError> {
    let Some(source) = &material.texture else { return Ok(None) };
    Ok(Some(decode_image(source.file(), &texture_bytes(source, reach)?)?.into_rgb8()))
}

/// The bytes of an image as they are in the source, not decoded.
///
/// # Errors
/// [`SceneError::Texture`] if the image is missing, may not be read, is longer than 1 GiB or neither JPEG nor PNG.
pub fn texture_bytes(source: &TextureSource, reach: &Reach) -> Result<Vec<u8>, SceneError> {
    let bytes = match source {
        TextureSource::File(path) => reach.read(path, budget::IMAGE_FILE).map_err(unusable)?,
        TextureSource::Embedded { file, image } => crate::gltf::image_bytes(file, *image, reach)?,
    };
    let fault = |what: String| SceneError::Texture { path: source.file().to_owned(), what };
    format(&bytes).map_err(fault)?;
    Ok(bytes)
}

fn unusable(error: FileError) -> SceneError {
    SceneError::Texture { path: error.path, what: error.kind.to_string() }
}

/// Decodes a JPEG or PNG image under the limits of [`load_texture`]; `path` is for the messages.
///
/// # Errors
/// [`SceneError::Texture`] if it is broken, too large or neither JPEG nor PNG.
pub fn decode_image(path: &Path, bytes: &[u8]) -> Result<DynamicImage, SceneError> {
    let fault = |what: String| SceneError::Texture { path: path.to_owned(), what };
    let format = format(bytes).map_err(fault)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(budget::IMAGE_SIDE);
    limits.max_image_height = Some(budget::IMAGE_SIDE);
    limits.max_alloc = Some(budget::IMAGE_MEMORY);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| fault(e.to_string()))?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > budget::IMAGE_PIXELS {
        return Err(fault(format!("it has {width} × {height} pixels, more than the 16384 × 16384 that are read")));
    }
    if decoder.total_bytes() > budget::IMAGE_MEMORY {
        return Err(fault("its pixels take more memory than the limit of 1 GiB".to_owned()));
    }
    DynamicImage::from_decoder(decoder).map_err(|e| fault(e.to_string()))
}

/// The image type by the first bytes, whatever the file's ending says.
pub(crate) fn format(bytes: &[u8]) -> Result<ImageFormat, String> {
    if bytes.starts_with(b"\xff\xd8\xff") {
        Ok(ImageFormat::Jpeg)
    } else if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Ok(ImageFormat::Png)
    } else {
        let start = shown(&bytes[..bytes.len().min(8)]);
        Err(format!("it is neither a JPEG nor a PNG image: it starts with {start}"))
    }
}

/// Whether a file is there and an image of a type that is read; what is wrong if not.
pub(crate) fn image_type(path: &Path, reach: &Reach) -> Result<(), String> {
    let mut start = Vec::new();
    let file = reach.open(path).map_err(|e| e.kind.to_string())?;
    file.take(16).read_to_end(&mut start).map_err(|e| e.to_string())?;
    format(&start).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_an_image_that_would_fill_the_memory() {
        // The header of a PNG that claims 16,000 × 16,000 pixels of 8 bytes.
        let mut png = Vec::new();
        png.extend_from_slice(
            b"\x89PNG\r\n\x1a\n\x00\x00\x00\x0dIHDR\x00\x00\x3e\x80\x00\x00\x3e\x80\x10\x06\x00\x00\x00",
        );
        png.extend_from_slice(&crc(&png[12..29]).to_be_bytes());
        png.extend_from_slice(b"\x00\x00\x00\x02IDAT\x78\x9c");
        png.extend_from_slice(&crc(b"IDAT\x78\x9c").to_be_bytes());
        let error = decode_image(Path::new("bomb.png"), &png).expect_err("must be refused").to_string();
        assert!(error.starts_with("bomb.png: the texture cannot be used: "), "{error}");
        assert!(error.to_lowercase().contains("limit") || error.contains("memory"), "{error}");
    }

    /// CRC-32 as PNG has it.
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
        })
    }

    #[test]
    fn knows_images_by_their_first_bytes() {
        assert!(format(b"\xff\xd8\xff\xe0").is_ok());
        let error = format(b"II*\0tiff").expect_err("a TIFF");
        assert_eq!(error, "it is neither a JPEG nor a PNG image: it starts with \"II*\\0tiff\"");
    }
}
