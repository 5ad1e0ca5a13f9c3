//! What covers a triangle.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The colour of what has no colour of its own, sRGB.
pub const GREY: [u8; 3] = [128; 3];

/// Where the bytes of a texture are; [`load_texture`](crate::load_texture) reads both kinds.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TextureSource {
    /// An image file.
    File(PathBuf),
    /// An image inside a GLB or glTF file.
    Embedded {
        /// The GLB or glTF file.
        file: PathBuf,
        /// Index into its array of images.
        image: usize,
    },
}

impl TextureSource {
    /// The file that holds the image.
    #[must_use]
    pub fn file(&self) -> &Path {
        match self {
            Self::File(file) | Self::Embedded { file, .. } => file,
        }
    }
}

/// What covers a triangle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Its image; `None` for plain colour, also where the image is missing.
    pub texture: Option<TextureSource>,
    /// Colour where there is no texture, sRGB; [`GREY`] where the image is missing.
    pub colour: [u8; 3],
}

impl Default for Material {
    fn default() -> Self {
        Self { name: String::new(), texture: None, colour: GREY }
    }
}
