//! The ground surface in tiles, so that a unit reads only the part that it stands on.
//!
//! A tile holds the cells of one square of an absolute lattice. What is read from several tiles is the whole surface with no
//! height where no tile was read: the surface is interpolated relative to its window's corner, so a smaller window would
//! round otherwise. Layout: magic, edge of a cell (f64), window of the surface, window of the tile (column, row as i64, width,
//! height as u32 each), then the heights (f32), zstd-compressed; all little-endian.

use crate::{PipelineError, artefact};
use gable_raster::{GridWindow, Raster};
use gable_segmentation::Terrain;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"GBLTER01";

/// Edge of a tile, cells.
const TILE: i64 = 64;

/// Most cells of a city that are believed.
const MOST: usize = 1 << 28;

fn file(column: i64, row: i64) -> String {
    format!("terrain/{column}_{row}.ter")
}

/// The tiles that heights on `window` (of pixels) depend on, of a surface on the window `cells`.
pub(super) fn tiles(cells: GridWindow, window: GridWindow) -> BTreeSet<String> {
    let bounds = window.bounds();
    // Bilinear between the centres of cells, continued flat beyond the border; a cell more for rounding.
    let range = |low: f64, high: f64, first: i64, count: usize| {
        let last = first + count as i64 - 1;
        let low = ((low / cells.step - 0.5).floor() as i64 - 1).clamp(first, last);
        let high = ((high / cells.step - 0.5).floor() as i64 + 2).clamp(first, last);
        low.div_euclid(TILE)..=high.div_euclid(TILE)
    };
    let columns = range(bounds.min.x, bounds.max.x, cells.x0, cells.width);
    range(bounds.min.y, bounds.max.y, cells.y0, cells.height)
        .flat_map(|row| columns.clone().map(move |column| file(column, row)))
        .collect()
}

/// Writes a surface; returns the names of its tiles.
pub(super) fn write(folder: &Path, terrain: &Terrain) -> Result<Vec<String>, PipelineError> {
    let heights = terrain.heights();
    let cells = heights.window();
    let last_column = (cells.x0 + cells.width as i64 - 1).div_euclid(TILE);
    let last_row = (cells.y0 + cells.height as i64 - 1).div_euclid(TILE);
    let mut made = Vec::new();
    for row in cells.y0.div_euclid(TILE)..=last_row {
        for column in cells.x0.div_euclid(TILE)..=last_column {
            let edge = TILE as usize;
            let square = GridWindow { step: cells.step, x0: column * TILE, y0: row * TILE, width: edge, height: edge };
            let window = square.intersection(&cells);
            let part = heights.crop(window, f32::NAN);
            let name = file(column, row);
            let path = folder.join(&name);
            let mut bytes = MAGIC.to_vec();
            bytes.extend(cells.step.to_le_bytes());
            for window in [cells, window] {
                bytes.extend(window.x0.to_le_bytes());
                bytes.extend(window.y0.to_le_bytes());
                bytes.extend((window.width as u32).to_le_bytes());
                bytes.extend((window.height as u32).to_le_bytes());
            }
            let raw: Vec<u8> = part.values().iter().flat_map(|z| z.to_le_bytes()).collect();
            let io = |source| PipelineError::Io { path: path.clone(), source };
            bytes.extend(zstd::bulk::compress(&raw, 3).map_err(io)?);
            artefact::write(&path, &bytes)?;
            made.push(name);
        }
    }
    Ok(made)
}

/// The surface of all tiles in `folder`.
pub(super) fn read(folder: &Path) -> Result<Terrain, PipelineError> {
    let folder = folder.join("terrain");
    let io = |source| PipelineError::Io { path: folder.clone(), source };
    let mut paths: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(io)? {
        paths.push(entry.map_err(io)?.path());
    }
    paths.sort();
    let mut surface: Option<Raster<f32>> = None;
    for path in &paths {
        let wrong = |reason: &str| PipelineError::Artefact { path: path.clone(), reason: reason.to_owned() };
        let bytes = std::fs::read(path).map_err(|source| PipelineError::Io { path: path.clone(), source })?;
        let (cells, tile) = parse(&bytes).ok_or_else(|| wrong("this is no whole tile of a terrain"))?;
        let surface = surface.get_or_insert_with(|| Raster::filled(cells, f32::NAN));
        if surface.window() != cells {
            return Err(wrong("it belongs to another terrain than the tiles beside it"));
        }
        surface.paste(&tile);
    }
    let none = || PipelineError::Artefact { path: folder.clone(), reason: "no tile of the terrain is here".to_owned() };
    Ok(Terrain::from_heights(surface.ok_or_else(none)?))
}

/// No cell lies farther from the origin than so many cells; beyond, sums of places would overflow.
const FARTHEST: u64 = 1 << 40;

fn parse(bytes: &[u8]) -> Option<(GridWindow, Raster<f32>)> {
    let rest = bytes.strip_prefix(MAGIC.as_slice())?;
    let (head, body) = rest.split_at_checked(8 + 2 * 24)?;
    let eight = |at: usize| head[at..at + 8].try_into().ok();
    let four = |at: usize| head[at..at + 4].try_into().ok().map(|b| u32::from_le_bytes(b) as usize);
    let step = f64::from_le_bytes(eight(0)?);
    let window = |at: usize| {
        let window = GridWindow {
            step,
            x0: i64::from_le_bytes(eight(at)?),
            y0: i64::from_le_bytes(eight(at + 8)?),
            width: four(at + 16)?,
            height: four(at + 20)?,
        };
        let is_on_earth = window.x0.unsigned_abs() <= FARTHEST && window.y0.unsigned_abs() <= FARTHEST;
        let is_small = window.width.checked_mul(window.height).is_some_and(|cells| cells <= MOST);
        (is_on_earth && is_small).then_some(window)
    };
    let (cells, tile) = (window(8)?, window(32)?);
    let raw = zstd::bulk::decompress(body, tile.len() * 4).ok()?;
    let heights: Vec<f32> = raw.chunks_exact(4).map(|z| f32::from_le_bytes([z[0], z[1], z[2], z[3]])).collect();
    (heights.len() == tile.len()).then(|| (cells, Raster::new(tile, heights)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface() -> Terrain {
        let window = GridWindow { step: 2.0, x0: -100, y0: 37, width: 211, height: 150 };
        let mut number = 0.0_f32;
        Terrain::from_heights(Raster::filled(window, ()).map(|()| {
            number = (number * 1.37 + 0.11) % 40.0;
            number
        }))
    }

    #[test]
    fn a_part_of_the_tiles_gives_the_same_heights_where_they_are_needed() {
        let whole = surface();
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("terrain")).unwrap();
        let made = write(folder.path(), &whole).unwrap();
        // Columns -2 to 1, rows 0 to 2.
        assert_eq!(made.len(), 4 * 3);
        let windows = [
            GridWindow { step: 0.2, x0: -1000, y0: 380, width: 64, height: 70 },
            // Over the corner of the surface and beyond.
            GridWindow { step: 0.2, x0: 1090, y0: 1800, width: 100, height: 100 },
        ];
        for window in windows {
            let needed = tiles(whole.heights().window(), window);
            assert!(!needed.is_empty() && needed.iter().all(|name| made.contains(name)), "{needed:?}");
            let part = tempfile::tempdir().unwrap();
            std::fs::create_dir(part.path().join("terrain")).unwrap();
            for name in &needed {
                std::fs::copy(folder.path().join(name), part.path().join(name)).unwrap();
            }
            assert_eq!(read(part.path()).unwrap().raster(window).values(), whole.raster(window).values());
        }
        let path = folder.path().join(&made[3]);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(read(folder.path()).unwrap_err().to_string().contains("no whole tile"));
        // A place that no tile has, found by a fuzzer: the sum with its width overflowed.
        let mut far = bytes;
        far[40..48].copy_from_slice(&i64::MIN.to_le_bytes());
        std::fs::write(&path, far).unwrap();
        assert!(read(folder.path()).unwrap_err().to_string().contains("no whole tile"));
    }
}
