//! Triangles on their way to the blocks: sorted into cells, kept in one temporary file.
//!
//! Blocks can only be laid out when the whole scene was seen, and the scene is read once. So its
//! triangles are gathered, two million at a time, sorted by a fixed lattice of cells and appended
//! to a file, one compressed segment for each cell. A block later reads the segments near it.

use crate::bytes::{put, take};
use crate::codec;
use crate::file::expand;
use crate::triangle::BlockTriangle;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Triangles that are gathered before they are written: 152 MB.
const GATHERED: usize = 2_000_000;
/// log₂ of the lattice units along a cell of level 0: 32 m.
const CELL_BITS: u32 = 18;
/// zstd level of segments: the fastest that finds repeated bytes.
const LEVEL: i32 = 1;

/// A cell of the spill's lattice.
///
/// Level n has cells of 32·2ⁿ m. A triangle belongs to the level whose cells are as wide as it is,
/// and there to the cell with its middle, so that it sticks out by half a cell at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Cell {
    pub(crate) level: u8,
    pub(crate) x: i16,
    pub(crate) y: i16,
}

impl Cell {
    fn of(min: [i32; 3], max: [i32; 3]) -> Self {
        let width = |i: usize| i64::from(max[i]) - i64::from(min[i]);
        let cells = (width(0).max(width(1)) as u64).div_ceil(1 << CELL_BITS).max(1);
        let level = cells.next_power_of_two().trailing_zeros();
        // The middle has 32 bits, so its cell has 14.
        let at = |i: usize| ((i64::from(min[i]) + i64::from(max[i])) >> (CELL_BITS + 1 + level)) as i16;
        Self { level: level as u8, x: at(0), y: at(1) }
    }

    /// The cell of level 0 that a point lies in.
    pub(crate) fn home(corner: [i32; 3]) -> Self {
        Self { level: 0, x: (corner[0] >> CELL_BITS) as i16, y: (corner[1] >> CELL_BITS) as i16 }
    }
}

/// Triangles of one cell in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) cell: Cell,
    offset: u64,
    packed: u32,
    raw: u32,
    pub(crate) count: u32,
    /// Bounds of its triangles.
    pub(crate) min: [i32; 3],
    pub(crate) max: [i32; 3],
}

/// The temporary file while it is written.
pub(crate) struct SpillWriter {
    file: File,
    length: u64,
    segments: Vec<Segment>,
    gathered: Vec<BlockTriangle>,
    /// Triangles that were written before the gathered ones.
    before: u64,
}

impl SpillWriter {
    /// A nameless file in a folder: the system removes it, however the program ends.
    pub(crate) fn new(folder: &Path) -> io::Result<Self> {
        let file = tempfile::tempfile_in(folder)?;
        Ok(Self { file, length: 0, segments: Vec::new(), gathered: Vec::new(), before: 0 })
    }

    /// Takes the next triangle of the scene.
    pub(crate) fn push(&mut self, triangle: BlockTriangle) -> io::Result<()> {
        self.gathered.push(triangle);
        if self.gathered.len() == GATHERED { self.write() } else { Ok(()) }
    }

    /// Sorts what was gathered into cells and appends it, cells in parallel.
    fn write(&mut self) -> io::Result<()> {
        let gathered = std::mem::take(&mut self.gathered);
        let mut order: Vec<(Cell, u32)> = gathered
            .par_iter()
            .enumerate()
            .map(|(i, triangle)| {
                let (min, max) = triangle.bounds();
                (Cell::of(min, max), i as u32)
            })
            .collect();
        order.par_sort_unstable();
        let before = self.before;
        let packed: Vec<io::Result<(Segment, Vec<u8>)>> = order
            .par_chunk_by(|a, b| a.0 == b.0)
            .map(|group| {
                let triangles: Vec<BlockTriangle> = group.iter().map(|(_, i)| gathered[*i as usize]).collect();
                let places = group.iter().map(|(_, i)| before + u64::from(*i));
                pack(group[0].0, &triangles, places)
            })
            .collect();
        for segment in packed {
            let (mut segment, bytes) = segment?;
            segment.offset = self.length;
            self.file.write_all(&bytes)?;
            self.length += bytes.len() as u64;
            self.segments.push(segment);
        }
        self.before += gathered.len() as u64;
        self.gathered = gathered;
        self.gathered.clear();
        Ok(())
    }

    /// Writes the rest; the file is ready to be read.
    pub(crate) fn finish(mut self) -> io::Result<Spill> {
        self.write()?;
        Ok(Spill { file: Mutex::new(self.file), segments: self.segments, length: self.length })
    }
}

/// One segment and its bytes; its offset is not known yet.
fn pack(cell: Cell, triangles: &[BlockTriangle], places: impl Iterator<Item = u64>) -> io::Result<(Segment, Vec<u8>)> {
    let (mut min, mut max) = ([i32::MAX; 3], [i32::MIN; 3]);
    for triangle in triangles {
        let (low, high) = triangle.bounds();
        min = [0, 1, 2].map(|i| min[i].min(low[i]));
        max = [0, 1, 2].map(|i| max[i].max(high[i]));
    }
    let mut raw = Vec::new();
    let mut last = 0;
    for place in places {
        put(&mut raw, place - last);
        last = place;
    }
    codec::encode(triangles, &mut raw);
    let bytes = zstd::bulk::compress(&raw, LEVEL)?;
    let count = triangles.len() as u32;
    Ok((Segment { cell, offset: 0, packed: bytes.len() as u32, raw: raw.len() as u32, count, min, max }, bytes))
}

/// The temporary file when it is complete.
pub(crate) struct Spill {
    file: Mutex<File>,
    pub(crate) segments: Vec<Segment>,
    /// Bytes in the file.
    pub(crate) length: u64,
}

impl Spill {
    /// A segment's triangles, each with its place in the scene's stream.
    pub(crate) fn read(&self, segment: &Segment) -> io::Result<Vec<(u64, BlockTriangle)>> {
        let mut bytes = vec![0; segment.packed as usize];
        {
            // The file's position is set before each read, so a thread that died left nothing wrong.
            let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
            file.seek(SeekFrom::Start(segment.offset))?;
            file.read_exact(&mut bytes)?;
        }
        let wrong = |what| io::Error::new(io::ErrorKind::InvalidData, what);
        let raw = expand(&bytes, u64::from(segment.raw)).map_err(wrong)?;
        let mut rest = raw.as_slice();
        let mut place = 0;
        let mut places = Vec::with_capacity(segment.count as usize);
        for _ in 0..segment.count {
            place += take(&mut rest).ok_or_else(|| wrong("the temporary file ends too early"))?;
            places.push(place);
        }
        let triangles = codec::decode(&mut rest, u64::from(segment.count)).map_err(wrong)?;
        Ok(places.into_iter().zip(triangles).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn cells_are_as_wide_as_their_triangles() {
        const CELL: i32 = 1 << CELL_BITS;
        let cell = |x0: i32, x1: i32| Cell::of([x0, 0, 0], [x1, 0, 0]);
        assert_eq!(cell(0, CELL), Cell { level: 0, x: 0, y: 0 });
        assert_eq!(cell(0, CELL + 1), Cell { level: 1, x: 0, y: 0 });
        assert_eq!(cell(-3, 1), Cell { level: 0, x: -1, y: 0 });
        assert_eq!(cell(i32::MIN, i32::MAX).level, 14);
        assert_eq!(cell(i32::MAX, i32::MAX).x, (1 << 13) - 1);
        assert_eq!(cell(i32::MIN, i32::MIN).x, -(1 << 13));
    }

    proptest! {
        #[test]
        fn every_triangle_is_in_one_segment_that_bounds_it(triangles in crate::codec::tests::triangles()) {
            let folder = tempfile::tempdir().expect("temporary folder");
            let mut writer = SpillWriter::new(folder.path()).expect("temporary file");
            for (i, triangle) in triangles.iter().enumerate() {
                if i == 7 {
                    writer.write().expect("writes");
                }
                writer.push(*triangle).expect("writes");
            }
            let spill = writer.finish().expect("writes");
            let mut all = Vec::new();
            for segment in &spill.segments {
                for (place, triangle) in spill.read(segment).expect("reads") {
                    let (min, max) = triangle.bounds();
                    prop_assert!((0..3).all(|i| min[i] >= segment.min[i] && max[i] <= segment.max[i]));
                    prop_assert_eq!(Cell::of(min, max), segment.cell);
                    all.push((place, triangle));
                }
            }
            all.sort_by_key(|(place, _)| *place);
            let expected: Vec<_> = triangles.into_iter().enumerate().map(|(i, t)| (i as u64, t)).collect();
            prop_assert_eq!(all, expected);
        }
    }
}
