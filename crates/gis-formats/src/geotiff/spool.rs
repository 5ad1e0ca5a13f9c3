//! Packed tiles in a nameless temporary file, until it is known where they will stand.

use super::pyramid::{Packed, Pyramid};
use crate::Error;
use std::fs::File;
use std::io::{self, BufWriter, Read as _, Seek as _, SeekFrom, Write};
use std::path::Path;

/// The packed tiles of a layer.
pub(super) struct Spool {
    file: BufWriter<File>,
    bytes: u64,
    /// Where each tile lies and how long it is; levels from the finest on, tiles row by row.
    tiles: Vec<Vec<(u64, u32)>>,
    columns: Vec<usize>,
}

impl Spool {
    pub(super) fn new(folder: &Path, pyramid: &Pyramid) -> Result<Self, Error> {
        let file = tempfile::tempfile_in(folder).map_err(Error::Spool)?;
        let levels = pyramid.levels();
        Ok(Self {
            file: BufWriter::new(file),
            bytes: 0,
            tiles: levels.iter().map(|level| vec![(0, 0); level.columns * level.rows]).collect(),
            columns: levels.iter().map(|level| level.columns).collect(),
        })
    }

    /// Bytes of all tiles.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Sizes of the tiles of a level.
    pub(super) fn sizes(&self, level: usize) -> Vec<u32> {
        self.tiles[level].iter().map(|&(_, size)| size).collect()
    }

    /// Where the tiles of each level will stand behind `head`: the coarsest level first.
    pub(super) fn offsets(&self, head: u64) -> Vec<Vec<u64>> {
        let mut at = head;
        let mut all: Vec<Vec<u64>> = vec![Vec::new(); self.tiles.len()];
        for (level, tiles) in self.tiles.iter().enumerate().rev() {
            for &(_, size) in tiles {
                all[level].push(at);
                at += u64::from(size);
            }
        }
        all
    }

    /// Copies the tiles in that order.
    pub(super) fn copy(&mut self, out: &mut impl Write) -> io::Result<()> {
        self.file.flush()?;
        let mut tile = Vec::new();
        for level in self.tiles.iter().rev() {
            for &(from, size) in level {
                tile.resize(size as usize, 0);
                let file = self.file.get_mut();
                file.seek(SeekFrom::Start(from))?;
                file.read_exact(&mut tile)?;
                out.write_all(&tile)?;
            }
        }
        Ok(())
    }

    fn put(&mut self, packed: &Packed) -> io::Result<()> {
        self.file.write_all(&packed.bytes)?;
        let at = packed.at;
        self.tiles[at.level][at.row * self.columns[at.level] + at.column] = (self.bytes, packed.bytes.len() as u32);
        self.bytes += packed.bytes.len() as u64;
        Ok(())
    }
}

/// Puts packed tiles where they belong.
pub(super) fn put(spools: &mut [Spool], packed: Vec<Packed>) -> Result<(), Error> {
    for tile in packed {
        spools[tile.layer].put(&tile).map_err(Error::Spool)?;
    }
    Ok(())
}
