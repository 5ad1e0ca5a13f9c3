//! Decoding of textures.

use crate::error::{SceneError, shown};
use crate::material::{Material, TextureSource};
use image::{ImageFormat, ImageReader, Limits, RgbImage};
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

/// Widest and highest image that is decoded, pixels.
const LARGEST_SIDE: u32 = 32_768;
/// Most memory that decoding one image may take, bytes: 16,384 × 16,384 pixels in RGBA.
const LARGEST_IMAGE: u64 = 1 << 30;
/// Longest image file that is read, bytes.
const LARGEST_FILE: u64 = 1 << 30;

/// Decodes the image of a material; `None` if it has none.
///
/// Row 0 of the image is its top, so `v` = 1. An image of more than 32,768 pixels a side or 1 GiB
/// decoded is refused before it is decoded.
///
/// # Errors
/// [`SceneError::Texture`] if the image is missing, broken, too large or neither JPEG nor PNG.
pub fn load_texture(material: &Material) -> Result<Option<RgbImage>, SceneError> {
    let Some(source) = &material.texture else { return Ok(None) };
    decode(source.file(), &texture_bytes(source)?).map(Some)
}

/// The bytes of an image as they are in the source, not decoded.
///
/// # Errors
/// [`SceneError::Texture`] if the image is missing or longer than 1 GiB.
pub fn texture_bytes(source: &TextureSource) -> Result<Vec<u8>, SceneError> {
    match source {
        TextureSource::File(path) => read(path),
        TextureSource::Embedded { file, image } => crate::gltf::image_bytes(file, *image),
    }
}

fn read(path: &Path) -> Result<Vec<u8>, SceneError> {
    let fault = |what: String| SceneError::Texture { path: path.to_owned(), what };
    let file = File::open(path).map_err(|e| fault(e.to_string()))?;
    let mut bytes = Vec::new();
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(|e| fault(e.to_string()))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(fault("the file is longer than 1 GiB".to_owned()));
    }
    Ok(bytes)
}

fn decode(path: &Path, bytes: &[u8]) -> Result<RgbImage, SceneError> {
    let fault = |what: String| SceneError::Texture { path: path.to_owned(), what };
    let format = format(bytes).map_err(fault)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(LARGEST_IMAGE);
    reader.limits(limits);
    Ok(reader.decode().map_err(|e| fault(e.to_string()))?.into_rgb8())
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
pub(crate) fn image_type(path: &Path) -> Result<(), String> {
    let mut start = Vec::new();
    let file = File::open(path).map_err(|e| e.to_string())?;
    file.take(16).read_to_end(&mut start).map_err(|e| e.to_string())?;
    format(&start).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_an_image_that_would_fill_the_memory() {
        // The header of a PNG that claims 30,000 × 30,000 pixels of 8 bytes.
        let mut png = Vec::new();
        png.extend_from_slice(
            b"\x89PNG\r\n\x1a\n\x00\x00\x00\x0dIHDR\x00\x00\x75\x30\x00\x00\x75\x30\x10\x06\x00\x00\x00",
        );
        png.extend_from_slice(&crc(&png[12..29]).to_be_bytes());
        png.extend_from_slice(b"\x00\x00\x00\x02IDAT\x78\x9c");
        png.extend_from_slice(&crc(b"IDAT\x78\x9c").to_be_bytes());
        let error = decode(Path::new("bomb.png"), &png).expect_err("must be refused").to_string();
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
