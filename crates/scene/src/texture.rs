//! Decoding of textures.

use crate::budget;
use crate::error::{SceneError, shown};
use crate::jpeg2000;
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
/// [`SceneError::Texture`] if the image is missing, may not be read, is broken, too large or of a type that is not read.
pub fn load_texture(material: &Material, reach: &Reach) -> Result<Option<RgbImage>, SceneError> {
    let Some(source) = &material.texture else { return Ok(None) };
    Ok(Some(decode_image(source.file(), &texture_bytes(source, reach)?)?.into_rgb8()))
}

/// The bytes of an image as they are in the source, not decoded.
///
/// # Errors
/// [`SceneError::Texture`] if the image is missing, may not be read, is longer than 1 GiB or of a type that is not read.
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

/// Decodes an image under the limits of [`load_texture`]; `path` is for the messages.
///
/// # Errors
/// [`SceneError::Texture`] if it is broken, too large or of a type that is not read.
pub fn decode_image(path: &Path, bytes: &[u8]) -> Result<DynamicImage, SceneError> {
    let fault = |what: String| SceneError::Texture { path: path.to_owned(), what };
    let format = match format(bytes).map_err(fault)? {
        ImageType::Plain(format) => format,
        ImageType::Jpeg2000 => return jpeg2000::decode(bytes).map_err(fault),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(budget::IMAGE_SIDE);
    limits.max_image_height = Some(budget::IMAGE_SIDE);
    limits.max_alloc = Some(budget::IMAGE_MEMORY);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| fault(e.to_string()))?;
    let (width, height) = decoder.dimensions();
    check_size(width, height).map_err(fault)?;
    if decoder.total_bytes() > budget::IMAGE_MEMORY {
        return Err(fault("its pixels take more memory than the limit of 1 GiB".to_owned()));
    }
    DynamicImage::from_decoder(decoder).map_err(|e| fault(e.to_string()))
}

/// An error for an image of more pixels than are read.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), String> {
    let most = budget::IMAGE_SIDE;
    if width.max(height) > most {
        return Err(format!("it has {width} × {height} pixels, more than the {most} a side that are read"));
    }
    if u64::from(width) * u64::from(height) > budget::IMAGE_PIXELS {
        return Err(format!("it has {width} × {height} pixels, more than the 16384 × 16384 that are read"));
    }
    Ok(())
}

/// The types of images that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImageType {
    /// One that the image library decodes.
    Plain(ImageFormat),
    /// JPEG 2000, as a file or as a bare stream.
    Jpeg2000,
}

/// Bytes of an image by which its type is known.
pub(crate) const HEAD: u64 = 32;

/// The image type by the first bytes, whatever the file's ending says.
pub(crate) fn format(bytes: &[u8]) -> Result<ImageType, String> {
    const KNOWN: [(&[u8], ImageType); 7] = [
        (b"\xff\xd8\xff", ImageType::Plain(ImageFormat::Jpeg)),
        (b"\x89PNG\r\n\x1a\n", ImageType::Plain(ImageFormat::Png)),
        (b"II*\0", ImageType::Plain(ImageFormat::Tiff)),
        (b"MM\0*", ImageType::Plain(ImageFormat::Tiff)),
        (b"II+\0", ImageType::Plain(ImageFormat::Tiff)),
        (b"\0\0\0\x0cjP  ", ImageType::Jpeg2000),
        (b"\xff\x4f\xff\x51", ImageType::Jpeg2000),
    ];
    const NAMED: [(&[u8], &str); 8] = [
        (b"\xabKTX 20", "KTX2"),
        (b"\xabKTX 11", "KTX"),
        (b"DDS ", "DDS"),
        (b"GIF8", "GIF"),
        (b"8BPS", "Photoshop"),
        (b"v/1\x01", "OpenEXR"),
        (b"#?", "Radiance"),
        (b"\0\0\0\x20ftypavif", "AVIF"),
    ];
    if let Some((_, known)) = KNOWN.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Ok(*known);
    }
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return Ok(ImageType::Plain(ImageFormat::WebP));
    }
    if bytes.starts_with(b"BM") && bytes.get(6..10) == Some(&[0; 4]) {
        return Ok(ImageType::Plain(ImageFormat::Bmp));
    }
    if is_tga(bytes) {
        return Ok(ImageType::Plain(ImageFormat::Tga));
    }
    if let Some((_, name)) = NAMED.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Err(format!("it is a {name} image, which is not read: convert it to JPEG or PNG"));
    }
    let start = shown(&bytes[..bytes.len().min(8)]);
    Err(format!("it is no JPEG, PNG, TIFF, BMP, TGA, WebP or JPEG 2000 image: it starts with {start}"))
}

/// TGA has no mark at its start, but few values that its header may have.
fn is_tga(bytes: &[u8]) -> bool {
    let Some(&[_, palette, kind, c0, c1, l0, l1, depth, _, _, _, _, w0, w1, h0, h1, bits, descriptor]) =
        bytes.first_chunk::<18>()
    else {
        return false;
    };
    let with_palette = palette == 1 && matches!(kind, 1 | 9) && matches!(depth, 15 | 16 | 24 | 32) && bits == 8;
    let plain = palette == 0 && [c0, c1, l0, l1, depth] == [0; 5] && matches!(kind, 2 | 3 | 10 | 11);
    let has_size = (w0, w1) != (0, 0) && (h0, h1) != (0, 0);
    has_size && (with_palette || plain && matches!(bits, 8 | 15 | 16 | 24 | 32)) && descriptor & 0xc0 == 0
}

/// Whether a file is there and an image of a type that is read; what is wrong if not.
pub(crate) fn image_type(path: &Path, reach: &Reach) -> Result<(), String> {
    let mut start = Vec::new();
    let file = reach.open(path).map_err(|e| e.kind.to_string())?;
    file.take(HEAD).read_to_end(&mut start).map_err(|e| e.to_string())?;
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
        let types: [(&[u8], ImageFormat); 5] = [
            (b"\xff\xd8\xff\xe0", ImageFormat::Jpeg),
            (b"II*\0tiff", ImageFormat::Tiff),
            (b"MM\0*", ImageFormat::Tiff),
            (b"BM\x36\0\0\0\0\0\0\0", ImageFormat::Bmp),
            (b"RIFF\x24\0\0\0WEBPVP8 ", ImageFormat::WebP),
        ];
        for (start, kind) in types {
            assert_eq!(format(start), Ok(ImageType::Plain(kind)));
        }
        assert_eq!(format(b"\xff\x4f\xff\x51\0"), Ok(ImageType::Jpeg2000));
        let error = format(b"id_rsa").expect_err("no image");
        assert_eq!(error, "it is no JPEG, PNG, TIFF, BMP, TGA, WebP or JPEG 2000 image: it starts with \"id_rsa\"");
        for (start, name) in [(b"\xabKTX 20\xbb".as_slice(), "KTX2"), (b"DDS |", "DDS"), (b"GIF89a", "GIF")] {
            let error = format(start).expect_err("not read");
            assert_eq!(error, format!("it is a {name} image, which is not read: convert it to JPEG or PNG"));
        }
    }

    #[test]
    fn tga_is_known_by_its_header() {
        let head = |kind: u8, palette: u8, bits: u8| {
            let mut head = [0; 18];
            (head[1], head[2], head[16]) = (palette, kind, bits);
            (head[12], head[14], head[17]) = (4, 4, 0x20);
            head
        };
        assert!([2, 3, 10, 11].iter().all(|kind| is_tga(&head(*kind, 0, 24))));
        assert!(!is_tga(&head(2, 0, 12)) && !is_tga(&head(4, 0, 24)) && !is_tga(&head(2, 1, 24)) && !is_tga(&[0; 32]));
        assert!(!is_tga(b"\0\x01") && !is_tga(b"OFF\n3 1 0\n0 0 0 0 0 0"));
    }
}
