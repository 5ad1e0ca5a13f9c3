//! What the ground of a city is found from, of one block: low heights and colours.
//!
//! Layout: magic, length of the colour counts as JSON (u32), the counts, then for each cell its column, row (i64) and sixteen
//! heights (f32), zstd-compressed; all little-endian.

use crate::{PipelineError, artefact};
use gable_segmentation::{CoarseHeights, GreenExcess};
use std::path::Path;

const MAGIC: &[u8; 8] = b"GBLLOW01";

/// Bytes of a cell.
const CELL: usize = 2 * 8 + 16 * 4;

/// Writes the parts of one block.
pub(super) fn write(path: &Path, heights: &CoarseHeights, green: &GreenExcess) -> Result<(), PipelineError> {
    let wrong = |reason: String| PipelineError::Artefact { path: path.to_owned(), reason };
    let counts = serde_json::to_vec(green).map_err(|e| wrong(e.to_string()))?;
    let mut bytes = MAGIC.to_vec();
    bytes.extend((counts.len() as u32).to_le_bytes());
    bytes.extend(counts);
    let mut raw = Vec::new();
    for (column, row, samples) in heights.cells() {
        raw.extend(column.to_le_bytes());
        raw.extend(row.to_le_bytes());
        samples.iter().for_each(|z| raw.extend(z.to_le_bytes()));
    }
    bytes.extend(zstd::bulk::compress(&raw, 3).map_err(|e| wrong(e.to_string()))?);
    artefact::write(path, &bytes)
}

/// Adds the parts of one block to those of the city.
pub(super) fn add(path: &Path, heights: &mut CoarseHeights, green: &mut GreenExcess) -> Result<(), PipelineError> {
    let wrong = |reason: &str| PipelineError::Artefact { path: path.to_owned(), reason: reason.to_owned() };
    let bytes = std::fs::read(path).map_err(|source| PipelineError::Io { path: path.to_owned(), source })?;
    let damaged = || wrong("these are no whole low heights");
    let rest = bytes.strip_prefix(MAGIC.as_slice()).ok_or_else(damaged)?;
    let (length, rest) = rest.split_first_chunk::<4>().ok_or_else(damaged)?;
    let (counts, body) = rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(damaged)?;
    green.merge(&serde_json::from_slice(counts).map_err(|e| wrong(&e.to_string()))?);
    let raw = zstd::stream::decode_all(body).map_err(|e| wrong(&e.to_string()))?;
    let mut cells = raw.chunks_exact(CELL);
    for cell in cells.by_ref() {
        let eight = |at: usize| std::array::from_fn::<u8, 8, _>(|i| cell[at + i]);
        let mut samples = [0.0; 16];
        for (sample, four) in samples.iter_mut().zip(cell[16..].chunks_exact(4)) {
            *sample = f32::from_le_bytes([four[0], four[1], four[2], four[3]]);
        }
        heights.add_cell(i64::from_le_bytes(eight(0)), i64::from_le_bytes(eight(8)), &samples);
    }
    if cells.remainder().is_empty() { Ok(()) } else { Err(damaged()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::{GridWindow, Raster};

    #[test]
    fn parts_of_two_blocks_are_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let window = GridWindow { step: 0.5, x0: -9, y0: 3, width: 30, height: 20 };
        let mut number = 0.0;
        let heights = Raster::filled(window, ()).map(|()| {
            number += 1.0;
            if number as i32 % 7 == 0 { f32::NAN } else { number }
        });
        let colour = Raster::filled(window, [60, 90, 50]);
        let (mut whole, mut green) = (CoarseHeights::new(2.0), GreenExcess::default());
        let (mut joined, mut counted) = (CoarseHeights::new(2.0), GreenExcess::default());
        whole.accumulate(&heights);
        green.accumulate(&colour, &Raster::filled(window, true));
        for (x0, width) in [(-9, 13), (4, 17)] {
            let cut = GridWindow { x0, width, ..window };
            let (mut part, mut seen) = (CoarseHeights::new(2.0), GreenExcess::default());
            part.accumulate(&heights.crop(cut, f32::NAN));
            seen.accumulate(&colour.crop(cut, [0; 3]), &Raster::filled(cut, true));
            let path = folder.path().join("part.low");
            write(&path, &part, &seen).unwrap();
            add(&path, &mut joined, &mut counted).unwrap();
        }
        assert_eq!(counted, green);
        assert_eq!(format!("{joined:?}"), format!("{whole:?}"));
        let path = folder.path().join("part.low");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        let error = add(&path, &mut joined, &mut counted).unwrap_err();
        assert!(matches!(error, PipelineError::Artefact { .. }), "{error}");
    }
}
