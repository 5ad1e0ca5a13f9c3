//! The map of a job, for those who watch it: where its units lie, and the mesh seen from above.
//!
//! The split tells where the blocks are, and each sampling leaves a small picture of its block; when all are sampled, the patches are
//! known, and the pictures become one. So there is a map of a job that fails later, too.

use super::Unit;
use crate::stages::split::Blocks;
use crate::stages::tiles3d::{UNSEEN, jpeg};
use crate::{PipelineError, artefact};
use gable_geometry::{Box2, DVec2, dvec2};
use gable_ortho::Orthograph;
use gable_raster::GridWindow;
use image::RgbImage;
use serde::Serialize;
use std::path::Path;

/// Where the blocks are: [`Extents`]. Tiles lie where the blocks of the same name lie.
pub(super) const BLOCKS: &str = "map/blocks.json";
/// Where the patches of the labelling are: [`Extents`].
pub(super) const PATCHES: &str = "map/patches.json";
/// The mesh seen from above, over the whole grid.
pub(super) const PICTURE: &str = "map/picture.jpg";
/// Folder of the pictures of single blocks.
pub(super) const PARTS: &str = "map/parts/";

/// Longest side of the picture of the city, pixels.
const PIXELS: f64 = 1024.0;
/// Longest side of that of a block, pixels.
const PART_PIXELS: usize = 256;

/// Where units lie.
#[derive(Clone, Debug, Serialize)]
struct Extents {
    /// Reference system of the coordinates.
    crs: String,
    /// West, south, east, north of the whole grid; world coordinates, metres.
    bbox: [f64; 4],
    units: Vec<Extent>,
}

/// Where a unit lies.
#[derive(Clone, Debug, Serialize)]
struct Extent {
    unit: String,
    /// West, south, east, north; world coordinates, metres.
    bbox: [f64; 4],
}

/// The artefact that holds the picture of a block.
pub(super) fn part_file(block: &str) -> String {
    format!("{PARTS}{block}.jpg")
}

/// Writes where the blocks with data are; gives the name of the file.
pub(super) fn write_blocks(unit: &Unit<'_>, blocks: &Blocks) -> Result<String, PipelineError> {
    let windows =
        blocks.with_data().into_iter().filter_map(|(ix, iy)| Some((format!("{ix}_{iy}"), blocks.core(ix, iy)?)));
    write_extents(unit, blocks, BLOCKS, windows)
}

/// Writes where patches are, each under the name of its unit; gives the name of the file.
pub(super) fn write_patches(
    unit: &Unit<'_>,
    blocks: &Blocks,
    patches: impl Iterator<Item = (String, GridWindow)>,
) -> Result<String, PipelineError> {
    write_extents(unit, blocks, PATCHES, patches)
}

fn write_extents(
    unit: &Unit<'_>,
    blocks: &Blocks,
    file: &str,
    windows: impl Iterator<Item = (String, GridWindow)>,
) -> Result<String, PipelineError> {
    let [x, y, _] = blocks.frame().origin;
    let world = |b: Box2| [b.min.x + x, b.min.y + y, b.max.x + x, b.max.y + y];
    let extents = Extents {
        crs: blocks.frame().crs.to_string(),
        bbox: world(whole(blocks)),
        units: windows.map(|(unit, window)| Extent { unit, bbox: world(window.bounds()) }).collect(),
    };
    make_folder(unit, file)?;
    unit.write(file, &extents)?;
    Ok(file.to_owned())
}

fn make_folder(unit: &Unit<'_>, file: &str) -> Result<(), PipelineError> {
    unit.folder.join(file).parent().map_or(Ok(()), artefact::create_dir)
}

/// The whole grid, local metres.
fn whole(blocks: &Blocks) -> Box2 {
    let grid = &blocks.report.grid;
    grid.whole().bounds(grid.step)
}

/// The colours of a block, many pixels united to one.
pub(super) struct Part {
    window: GridWindow,
    /// Pixels along a side that become one.
    factor: usize,
    width: usize,
    height: usize,
    /// Sums of the colours, and how many pixels were seen; row 0 in the north.
    sums: Vec<[u64; 4]>,
}

impl Part {
    pub(super) fn new(window: GridWindow) -> Self {
        let factor = window.width.max(window.height).div_ceil(PART_PIXELS).max(1);
        let (width, height) = (window.width.div_ceil(factor), window.height.div_ceil(factor));
        Self { window, factor, width, height, sums: vec![[0; 4]; width * height] }
    }

    /// Adds what was seen in a piece of the block. Without a photograph it is shaded, as if the light came from the north-west.
    pub(super) fn add(&mut self, maps: &Orthograph) {
        let piece = maps.window();
        for y in 0..piece.height {
            for x in 0..piece.width {
                if maps.height[(x, y)].is_nan() {
                    continue;
                }
                let column = (piece.x0 + x as i64 - self.window.x0) as usize / self.factor;
                let row = (piece.y0 + y as i64 - self.window.y0) as usize / self.factor;
                let colour = if maps.photographed[(x, y)] { maps.colour[(x, y)] } else { shade(maps.normal[(x, y)]) };
                let sum = &mut self.sums[(self.height - 1 - row) * self.width + column];
                (0..3).for_each(|i| sum[i] += u64::from(colour[i]));
                sum[3] += 1;
            }
        }
    }

    /// Writes it.
    pub(super) fn write(&self, unit: &Unit<'_>, file: &str) -> Result<(), PipelineError> {
        let mut pixels = Vec::with_capacity(self.sums.len() * 3);
        for sum in &self.sums {
            let mean = |i: usize| (sum[i] + sum[3] / 2).checked_div(sum[3]).map_or(UNSEEN[i], |v| v as u8);
            pixels.extend((0..3).map(mean));
        }
        let bytes = jpeg(&pixels, self.width as u32, self.height as u32).map_err(|e| unit.failed(e))?;
        make_folder(unit, file)?;
        artefact::write(&unit.folder.join(file), &bytes)
    }
}

/// The grey of a surface that has no picture.
fn shade([x, y, z]: [f32; 3]) -> [u8; 3] {
    [(70.0 + 160.0 * (0.75 * z - 0.35 * x + 0.35 * y).clamp(0.0, 1.0)) as u8; 3]
}

/// A picture of a block, and where it lies.
struct Tile {
    bounds: Box2,
    picture: RgbImage,
}

/// Unites the pictures of the blocks that were sampled; gives the name of the file.
pub(super) fn write_picture(unit: &Unit<'_>, blocks: &Blocks) -> Result<String, PipelineError> {
    let grid = &blocks.report.grid;
    let mut tiles: Vec<Option<Tile>> = Vec::new();
    for core in grid.cores() {
        let file = unit.folder.join(part_file(&format!("{}_{}", core.column, core.row)));
        tiles.push(if file.is_file() {
            Some(Tile { bounds: core.bounds(grid.step), picture: open(&file)? })
        } else {
            None
        });
    }
    let bounds = whole(blocks);
    let size = bounds.size();
    let pixel = (size.max_element() / PIXELS).max(grid.step);
    let [width, height] = [size.x, size.y].map(|side| (side / pixel).round().max(1.0) as u32);
    let picture = RgbImage::from_fn(width, height, |column, row| {
        let part = dvec2((f64::from(column) + 0.5) / f64::from(width), (f64::from(row) + 0.5) / f64::from(height));
        let at = dvec2(bounds.min.x + part.x * size.x, bounds.max.y - part.y * size.y);
        let [x, y] = [at.x, at.y].map(|c| (c / grid.step).floor() as i64);
        let core = grid.core_of_pixel(x, y);
        let tile = core.and_then(|core| tiles[(core.row * grid.columns() + core.column) as usize].as_ref());
        image::Rgb(tile.map_or(UNSEEN, |tile| colour(tile, at)))
    });
    let bytes = jpeg(picture.as_raw(), width, height).map_err(|e| unit.failed(e))?;
    make_folder(unit, PICTURE)?;
    artefact::write(&unit.folder.join(PICTURE), &bytes)?;
    Ok(PICTURE.to_owned())
}

fn open(path: &Path) -> Result<RgbImage, PipelineError> {
    let damaged = |e: image::ImageError| PipelineError::Artefact { path: path.to_owned(), reason: e.to_string() };
    Ok(image::open(path).map_err(damaged)?.into_rgb8())
}

fn colour(tile: &Tile, at: DVec2) -> [u8; 3] {
    let part = (at - tile.bounds.min) / tile.bounds.size();
    let (width, height) = tile.picture.dimensions();
    let pixel = |part: f64, most: u32| ((part * f64::from(most)).max(0.0) as u32).min(most - 1);
    tile.picture.get_pixel(pixel(part.x, width), pixel(1.0 - part.y, height)).0
}
