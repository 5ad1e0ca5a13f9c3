//! Windows of the city's rasters, put together from the tiles on disk.

use crate::PipelineError;
use gable_ortho::Orthograph;
use gable_raster::GridWindow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// A tile of a mosaic: where it lies and in which file.
#[derive(Clone, Debug)]
pub(crate) struct MosaicTile {
    pub(crate) window: GridWindow,
    pub(crate) path: PathBuf,
}

/// What a mosaic's tiles hold.
pub(crate) trait TileData: Sized + Send + Sync {
    fn load(path: &std::path::Path) -> Result<Self, PipelineError>;
    fn empty(window: GridWindow) -> Self;
    fn paste(&mut self, tile: &Self);
    fn bytes(&self) -> usize;
}

/// The rasters of a whole city, of which only some tiles are in memory: the least recently used ones leave when
/// the budget is passed.
pub(crate) struct Mosaic<T> {
    tiles: Vec<MosaicTile>,
    /// Tiles by cell of a coarse lattice, so that a window finds its tiles without looking at all.
    cells: BTreeMap<(i64, i64), Vec<usize>>,
    lost: BTreeSet<usize>,
    cell: i64,
    step: f64,
    cache: Mutex<Cache<T>>,
}

struct Cache<T> {
    tiles: BTreeMap<usize, (u64, usize, Arc<T>)>,
    clock: u64,
    bytes: usize,
    budget: usize,
}

impl<T: TileData> Mosaic<T> {
    /// A mosaic of tiles that do not overlap; `budget` is in bytes.
    pub(crate) fn new(tiles: Vec<MosaicTile>, step: f64, budget: usize) -> Self {
        let cell = tiles.iter().map(|t| t.window.width.max(t.window.height)).max().unwrap_or(1).max(1) as i64;
        let mut cells: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
        for (i, tile) in tiles.iter().enumerate() {
            for key in lattice_cells(&tile.window, cell) {
                cells.entry(key).or_default().push(i);
            }
        }
        let cache = Cache { tiles: BTreeMap::new(), clock: 0, bytes: 0, budget };
        Self { tiles, cells, lost: BTreeSet::new(), cell, step, cache: Mutex::new(cache) }
    }

    /// Leaves tiles out, as if they had never been there.
    pub(crate) fn leave_out(&mut self, tiles: &[usize]) {
        self.cells.values_mut().for_each(|list| list.retain(|i| !tiles.contains(i)));
        self.lost.extend(tiles);
    }

    /// Whether a tile was left out.
    pub(crate) fn is_lost(&self, tile: usize) -> bool {
        self.lost.contains(&tile)
    }

    /// Edge of a pixel, metres.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    /// The tiles.
    pub(crate) fn tiles(&self) -> &[MosaicTile] {
        &self.tiles
    }

    /// The data on a window; empty where no tile lies.
    pub(crate) fn read(&self, window: GridWindow) -> Result<T, PipelineError> {
        let mut out = T::empty(window);
        let mut wanted: Vec<usize> =
            lattice_cells(&window, self.cell).filter_map(|key| self.cells.get(&key)).flatten().copied().collect();
        wanted.sort_unstable();
        wanted.dedup();
        for i in wanted {
            if !self.tiles[i].window.intersection(&window).is_empty() {
                out.paste(&*self.tile(i)?);
            }
        }
        Ok(out)
    }

    /// One tile.
    pub(crate) fn tile(&self, index: usize) -> Result<Arc<T>, PipelineError> {
        {
            let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
            cache.clock += 1;
            let now = cache.clock;
            if let Some(entry) = cache.tiles.get_mut(&index) {
                entry.0 = now;
                return Ok(Arc::clone(&entry.2));
            }
        }
        // Decoded without the lock: two threads may decode the same tile, which costs time but no memory for long.
        let tile = Arc::new(T::load(&self.tiles[index].path)?);
        let bytes = tile.bytes();
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let now = cache.clock;
        if cache.tiles.insert(index, (now, bytes, Arc::clone(&tile))).is_none() {
            cache.bytes += bytes;
        }
        while cache.bytes > cache.budget && cache.tiles.len() > 1 {
            let Some(oldest) = cache.tiles.iter().min_by_key(|(_, e)| e.0).map(|(&i, _)| i) else { break };
            if let Some((_, bytes, _)) = cache.tiles.remove(&oldest) {
                cache.bytes -= bytes;
            }
        }
        Ok(tile)
    }
}

fn lattice_cells(window: &GridWindow, cell: i64) -> impl Iterator<Item = (i64, i64)> + use<> {
    let (x0, y0) = (window.x0.div_euclid(cell), window.y0.div_euclid(cell));
    let x1 = (window.x0 + window.width as i64 - 1).div_euclid(cell);
    let y1 = (window.y0 + window.height as i64 - 1).div_euclid(cell);
    (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| (x, y)))
}

impl TileData for Orthograph {
    fn load(path: &std::path::Path) -> Result<Self, PipelineError> {
        Self::read(path).map_err(|e| PipelineError::Artefact { path: path.to_owned(), reason: e.to_string() })
    }

    fn empty(window: GridWindow) -> Self {
        Self::empty(window)
    }

    fn paste(&mut self, tile: &Self) {
        Self::paste(self, tile);
    }

    fn bytes(&self) -> usize {
        self.window().len() * 40
    }
}
