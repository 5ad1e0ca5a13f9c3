//! Files of the working folder: written whole or not at all, so that what exists is finished.

use crate::PipelineError;
use crate::mosaic::TileData;
use gable_raster::{GridWindow, Raster};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs;
use std::io::Write;
use std::path::Path;

/// Magic and version of a label tile.
const LABEL_MAGIC: &[u8; 8] = b"GBLLAB01";

/// Writes a file under a temporary name in the same folder and renames it.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), PipelineError> {
    write_with(path, |file| file.write_all(bytes))
}

/// As [`write`], through a buffered writer.
pub(crate) fn write_with(
    path: &Path,
    fill: impl FnOnce(&mut std::io::BufWriter<fs::File>) -> std::io::Result<()>,
) -> Result<(), PipelineError> {
    let io = |source| PipelineError::Io { path: path.to_owned(), source };
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let write = || {
        let mut file = std::io::BufWriter::new(fs::File::create(&part)?);
        fill(&mut file)?;
        file.flush()?;
        fs::rename(&part, path)
    };
    write().map_err(io)
}

/// Writes JSON.
pub(crate) fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), PipelineError> {
    let bytes = serde_json::to_vec(value)
        .map_err(|e| PipelineError::Artefact { path: path.to_owned(), reason: e.to_string() })?;
    write(path, &bytes)
}

/// As [`read_json`], but a damaged file too is `None`: what it held is made again.
pub(crate) fn whole_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, PipelineError> {
    match read_json(path) {
        Err(error @ PipelineError::Artefact { .. }) => {
            tracing::warn!("made again: {error}");
            Ok(None)
        }
        other => other,
    }
}

/// Reads what [`write_json`] wrote; `None` if the file is not there.
pub(crate) fn read_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, PipelineError> {
    let Some(bytes) = read(path)? else { return Ok(None) };
    let reason = |e: serde_json::Error| PipelineError::Artefact { path: path.to_owned(), reason: e.to_string() };
    serde_json::from_slice(&bytes).map(Some).map_err(reason)
}

fn read(path: &Path) -> Result<Option<Vec<u8>>, PipelineError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(PipelineError::Io { path: path.to_owned(), source }),
    }
}

/// Creates a folder and those above it.
pub(crate) fn create_dir(path: &Path) -> Result<(), PipelineError> {
    fs::create_dir_all(path).map_err(|source| PipelineError::Io { path: path.to_owned(), source })
}

/// Labels of one patch. Layout: magic, step (f64), x0, y0 (i64), width, height (u32), then the labels, one byte each,
/// zstd-compressed; all little-endian.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LabelTile(pub(crate) Raster<u8>);

/// No label: no surface was seen.
pub(crate) const NO_LABEL: u8 = u8::MAX;

impl LabelTile {
    pub(crate) fn write(&self, path: &Path) -> Result<(), PipelineError> {
        let window = self.0.window();
        let mut bytes = LABEL_MAGIC.to_vec();
        bytes.extend(window.step.to_le_bytes());
        bytes.extend(window.x0.to_le_bytes());
        bytes.extend(window.y0.to_le_bytes());
        bytes.extend((window.width as u32).to_le_bytes());
        bytes.extend((window.height as u32).to_le_bytes());
        let io = |source| PipelineError::Io { path: path.to_owned(), source };
        bytes.extend(zstd::bulk::compress(self.0.values(), 3).map_err(io)?);
        write(path, &bytes)
    }

    fn parse(bytes: &[u8]) -> Option<Self> {
        let rest = bytes.strip_prefix(LABEL_MAGIC.as_slice())?;
        let (head, body) = rest.split_at_checked(32)?;
        let eight = |i: usize| head[i..i + 8].try_into().ok();
        let four = |i: usize| head[i..i + 4].try_into().ok().map(|b| u32::from_le_bytes(b) as usize);
        let window = GridWindow {
            step: f64::from_le_bytes(eight(0)?),
            x0: i64::from_le_bytes(eight(8)?),
            y0: i64::from_le_bytes(eight(16)?),
            width: four(24)?,
            height: four(28)?,
        };
        let size = window.width.checked_mul(window.height).filter(|&n| n <= 1 << 28)?;
        let values = zstd::bulk::decompress(body, size).ok()?;
        (values.len() == size).then(|| Self(Raster::new(window, values)))
    }
}

impl TileData for LabelTile {
    fn load(path: &Path) -> Result<Self, PipelineError> {
        let wrong = |reason: &str| PipelineError::Artefact { path: path.to_owned(), reason: reason.to_owned() };
        let bytes = read(path)?.ok_or_else(|| wrong("the file is gone"))?;
        Self::parse(&bytes).ok_or_else(|| wrong("this is no whole label tile"))
    }

    fn empty(window: GridWindow) -> Self {
        Self(Raster::filled(window, NO_LABEL))
    }

    fn paste(&mut self, tile: &Self) {
        self.0.paste(&tile.0);
    }

    fn bytes(&self) -> usize {
        self.0.window().len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_tile_comes_back_and_a_broken_one_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("1_2.lab");
        let window = GridWindow { step: 0.2, x0: -5, y0: 7, width: 3, height: 2 };
        let tile = LabelTile(Raster::new(window, vec![0, 1, 2, 3, 255, 0]));
        tile.write(&path).unwrap();
        assert_eq!(LabelTile::load(&path).unwrap(), tile);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() - 3]).unwrap();
        let message = LabelTile::load(&path).unwrap_err().to_string();
        assert!(message.contains("1_2.lab") && message.contains("no whole label tile"), "{message}");
        assert!(read_json::<u8>(&dir.path().join("none.json")).unwrap().is_none());
    }
}
