//! Being written.
use crate::counts::Warnings;
use crate::error::SceneError;
use crate::material::Material;
use crate::sink::{Halt, Placement, Sink};
use std::path::Path;

pub(crate) fn read_materials(path: &Path, _: &mut Warnings) -> Result<Vec<Material>, SceneError> {
    Err(SceneError::Unsupported { path: path.to_owned(), what: "not read yet".to_owned() })
}
pub(crate) fn stream(path: &Path, _: u32, _: Placement, _: &mut Sink<'_>) -> Result<(), Halt> {
    Err(SceneError::Unsupported { path: path.to_owned(), what: "not read yet".to_owned() }.into())
}
pub(crate) fn image_bytes(path: &Path, _: usize) -> Result<Vec<u8>, SceneError> {
    Err(SceneError::Unsupported { path: path.to_owned(), what: "not read yet".to_owned() })
}
