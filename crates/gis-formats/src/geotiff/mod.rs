//! Cloud-optimised GeoTIFF: tiled, deflated, with overviews, the directories first and what is coarse before what is fine, so that a
//! program which shows a part of a city at some scale reads that part of the file alone.
//!
//! 1. The tiles of the full resolution are asked for in the order of a Z-curve, a few at a time on all threads.
//! 2. An overview halves the level below it; a tile of it is made as soon as its four are there. What waits for its neighbours is a
//!    few tiles on each level, whatever the size of the city.
//! 3. Compressed tiles go to a nameless temporary file in the order in which they come; the file is put together from it at the end,
//!    when their sizes are known: BigTIFF if 4 GB are not enough.
//!
//! The bytes depend on the pixels alone. The crate `tiff` writes strips without overviews, in an order of its own, so the container is
//! written here.

mod container;
mod keys;
mod pixels;
mod pyramid;
mod spool;

pub(crate) use pixels::rounded;
pub use pixels::{Class, PixelKind, Pixels};

use crate::{Error, GeoReference};
use container::{Directory, Value};
use pyramid::Pyramid;
use rayon::prelude::*;
use spool::Spool;
use std::io::{self, Write};
use std::path::Path;

/// Edge of a tile, pixels.
pub const TILE: usize = 512;

/// What height is written where there is none.
pub const NO_HEIGHT: f32 = -9999.0;

/// Where the pixels of a raster lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RasterGrid {
    /// Columns.
    pub width: usize,
    /// Rows, the first one in the north.
    pub height: usize,
    /// World coordinate of the western edge, metres.
    pub west: f64,
    /// World coordinate of the northern edge, metres.
    pub north: f64,
    /// Edge of a pixel, metres.
    pub step: f64,
}

/// One of several rasters on the same grid.
#[derive(Clone, Debug, PartialEq)]
pub struct RasterLayer {
    /// What a pixel tells, with its unit.
    pub description: String,
    /// What a pixel is.
    pub kind: PixelKind,
    /// Whether its heights are those of the reference system.
    pub has_world_heights: bool,
}

/// Rasters whose tiles are compressed and only have to be put into files.
pub struct CogSet {
    layers: Vec<RasterLayer>,
    grid: RasterGrid,
    pyramid: Pyramid,
    spools: Vec<Spool>,
}

impl CogSet {
    /// Compresses the tiles of rasters on one grid, and makes their overviews. `read` gives the pixels of a tile (of [`TILE`] by
    /// [`TILE`], row by row from the north, beyond the grid as where nothing is) for each layer, by the tile's column and row.
    ///
    /// # Errors
    /// If `read` fails, or the temporary files in `folder` cannot be written.
    pub fn make<E: From<Error> + Send>(
        layers: Vec<RasterLayer>,
        grid: RasterGrid,
        folder: &Path,
        read: impl Fn(usize, usize) -> Result<Vec<Pixels>, E> + Sync,
    ) -> Result<Self, E> {
        let pyramid = Pyramid::of(grid.width, grid.height);
        let mut spools = Vec::new();
        for _ in &layers {
            spools.push(Spool::new(folder, &pyramid)?);
        }
        let kinds: Vec<&PixelKind> = layers.iter().map(|layer| &layer.kind).collect();
        let mut assembly = pyramid::Assembly::new(&pyramid, &kinds);
        let units = pyramid.units();
        for some in units.chunks(2 * rayon::current_num_threads()) {
            let made: Vec<_> =
                some.par_iter().map(|&unit| pyramid::build(&pyramid, &kinds, unit, &read)).collect::<Result<_, E>>()?;
            for (unit, (tiles, top)) in some.iter().zip(made) {
                spool::put(&mut spools, tiles)?;
                spool::put(&mut spools, assembly.add(*unit, top)?)?;
            }
        }
        Ok(Self { layers, grid, pyramid, spools })
    }

    /// Writes the file of a layer. Give a buffered stream.
    ///
    /// # Errors
    /// If the stream or the temporary file fails.
    pub fn write(&mut self, layer: usize, place: &GeoReference, out: &mut impl Write) -> io::Result<()> {
        let spool = &mut self.spools[layer];
        // What a directory takes does not depend on the offsets in it.
        let is_big = |big: bool, directories: &[Directory]| {
            let head: u64 = directories.iter().map(|d| d.size(big)).sum();
            head + spool.bytes() + 16 > u64::from(u32::MAX)
        };
        let none = vec![Vec::new(); self.pyramid.levels().len()];
        let blank = directories(&self.layers[layer], &self.grid, &self.pyramid, place, spool, &none);
        let big = is_big(false, &blank);
        let head = container::HEADER[usize::from(big)] + blank.iter().map(|d| d.size(big)).sum::<u64>();
        let offsets = spool.offsets(head);
        let directories = directories(&self.layers[layer], &self.grid, &self.pyramid, place, spool, &offsets);
        container::write_head(&directories, big, out)?;
        spool.copy(out)
    }
}

/// The directories of all levels, the finest first. Offsets that are not known yet may be missing.
fn directories(
    layer: &RasterLayer,
    grid: &RasterGrid,
    pyramid: &Pyramid,
    place: &GeoReference,
    spool: &Spool,
    offsets: &[Vec<u64>],
) -> Vec<Directory> {
    let mut all = Vec::new();
    for (number, level) in pyramid.levels().iter().enumerate() {
        let tiles = level.columns * level.rows;
        let mut offsets = offsets[number].clone();
        offsets.resize(tiles, 0);
        let mut directory = Directory::default();
        directory.put(254, Value::Long(vec![u32::from(number > 0)]));
        directory.put(256, Value::Long(vec![level.width as u32]));
        directory.put(257, Value::Long(vec![level.height as u32]));
        layer.kind.describe(&mut directory);
        directory.put(284, Value::Short(vec![1]));
        directory.put(322, Value::Short(vec![TILE as u16]));
        directory.put(323, Value::Short(vec![TILE as u16]));
        directory.put(324, Value::Offsets(offsets));
        directory.put(325, Value::Long(spool.sizes(number)));
        if number == 0 {
            directory.put(305, Value::Ascii(concat!("gable ", env!("CARGO_PKG_VERSION")).to_owned()));
            directory.put(33550, Value::Double(vec![grid.step, grid.step, 0.0]));
            directory.put(33922, Value::Double(vec![0.0, 0.0, 0.0, grid.west, grid.north, 0.0]));
            keys::put(place, layer.has_world_heights, &mut directory);
            directory.put(42112, Value::Ascii(layer.kind.metadata(&layer.description)));
        }
        all.push(directory);
    }
    all
}

#[cfg(test)]
mod tests;
