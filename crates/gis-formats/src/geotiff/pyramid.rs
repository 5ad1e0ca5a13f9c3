//! Tiles and overviews: which there are, and how they are made one from the other.

use super::TILE;
use super::pixels::{PixelKind, Pixels};
use crate::Error;
use std::collections::BTreeMap;

/// Levels that are made at once from the tiles below: four by four tiles.
const UNIT: usize = 2;

/// A level of a raster, cut into tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// All levels, the finest first; the last one is a single tile.
#[derive(Clone, Debug)]
pub(super) struct Pyramid(Vec<Level>);

/// A tile of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct At {
    pub(super) level: usize,
    pub(super) column: usize,
    pub(super) row: usize,
}

/// A packed tile of a layer.
pub(super) struct Packed {
    pub(super) layer: usize,
    pub(super) at: At,
    pub(super) bytes: Vec<u8>,
}

impl Pyramid {
    pub(super) fn of(width: usize, height: usize) -> Self {
        let level = |width: usize, height: usize| Level {
            width,
            height,
            columns: width.div_ceil(TILE),
            rows: height.div_ceil(TILE),
        };
        let mut levels = vec![level(width.max(1), height.max(1))];
        while let Some(&last) = levels.last()
            && (last.columns > 1 || last.rows > 1)
        {
            levels.push(level(last.width.div_ceil(2), last.height.div_ceil(2)));
        }
        Self(levels)
    }

    pub(super) fn levels(&self) -> &[Level] {
        &self.0
    }

    fn top(&self) -> usize {
        self.0.len() - 1
    }

    fn has(&self, at: At) -> bool {
        self.0.get(at.level).is_some_and(|level| at.column < level.columns && at.row < level.rows)
    }

    /// The tiles that are made in one go, along a Z-curve: those of one level, each with what lies under it.
    pub(super) fn units(&self) -> Vec<At> {
        let level = UNIT.min(self.top());
        let Level { columns, rows, .. } = self.0[level];
        let all = (0..rows).flat_map(|row| (0..columns).map(move |column| At { level, column, row }));
        let mut units: Vec<At> = all.collect();
        units.sort_by_key(|at| interleaved(at.column, at.row));
        units
    }

    /// The tiles under a tile of an overview.
    fn below(&self, at: At) -> Vec<At> {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let child = |(x, y)| At { level: at.level - 1, column: 2 * at.column + x, row: 2 * at.row + y };
        four.into_iter().map(child).filter(|&child| self.has(child)).collect()
    }
}

/// The bits of two numbers by turns.
fn interleaved(column: usize, row: usize) -> u64 {
    (0..32).map(|bit| (((column >> bit) as u64 & 1) << (2 * bit)) | (((row >> bit) as u64 & 1) << (2 * bit + 1))).sum()
}

/// Makes a tile with all that lies under it; gives what was packed, and its pixels.
pub(super) fn build<E: From<Error>>(
    pyramid: &Pyramid,
    kinds: &[&PixelKind],
    at: At,
    read: &impl Fn(usize, usize) -> Result<Vec<Pixels>, E>,
) -> Result<(Vec<Packed>, Vec<Pixels>), E> {
    let mut packed = Vec::new();
    let pixels = if at.level == 0 {
        read(at.column, at.row)?
    } else {
        let mut pixels: Vec<Pixels> = kinds.iter().map(|kind| kind.blank()).collect();
        for child in pyramid.below(at) {
            let (more, fine) = build(pyramid, kinds, child, read)?;
            packed.extend(more);
            halve(&mut pixels, &fine, child);
        }
        pixels
    };
    packed.extend(pack(at, &pixels)?);
    Ok((packed, pixels))
}

fn halve(coarse: &mut [Pixels], fine: &[Pixels], child: At) {
    for (coarse, fine) in coarse.iter_mut().zip(fine) {
        coarse.put_halved(fine, child.column % 2 == 1, child.row % 2 == 1);
    }
}

fn pack(at: At, pixels: &[Pixels]) -> Result<Vec<Packed>, Error> {
    let pack =
        |(layer, pixels): (usize, &Pixels)| Ok(Packed { layer, at, bytes: pixels.packed().map_err(Error::Spool)? });
    pixels.iter().enumerate().map(pack).collect()
}

/// The overviews over the units: tiles that wait until all below them are there.
pub(super) struct Assembly<'a> {
    pyramid: &'a Pyramid,
    kinds: &'a [&'a PixelKind],
    waiting: BTreeMap<At, (Vec<Pixels>, usize)>,
}

impl<'a> Assembly<'a> {
    pub(super) fn new(pyramid: &'a Pyramid, kinds: &'a [&'a PixelKind]) -> Self {
        Self { pyramid, kinds, waiting: BTreeMap::new() }
    }

    /// Adds a tile; gives the packed tiles of the overviews that are finished with it.
    pub(super) fn add(&mut self, at: At, pixels: Vec<Pixels>) -> Result<Vec<Packed>, Error> {
        let mut packed = Vec::new();
        let (mut at, mut pixels) = (at, pixels);
        while at.level < self.pyramid.top() {
            let parent = At { level: at.level + 1, column: at.column / 2, row: at.row / 2 };
            let blank = || (self.kinds.iter().map(|kind| kind.blank()).collect(), self.pyramid.below(parent).len());
            let (coarse, missing) = self.waiting.entry(parent).or_insert_with(blank);
            halve(coarse, &pixels, at);
            *missing -= 1;
            if *missing > 0 {
                break;
            }
            let Some((finished, _)) = self.waiting.remove(&parent) else { break };
            packed.extend(pack(parent, &finished)?);
            (at, pixels) = (parent, finished);
        }
        Ok(packed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_halve_to_one_tile_and_units_hold_each_tile_once() {
        let pyramid = Pyramid::of(5 * TILE + 3, TILE);
        let sizes: Vec<_> = pyramid.levels().iter().map(|l| (l.width, l.height, l.columns, l.rows)).collect();
        assert_eq!(sizes, [(2563, 512, 6, 1), (1282, 256, 3, 1), (641, 128, 2, 1), (321, 64, 1, 1)]);
        let (kinds, mut seen) = ([&PixelKind::Height], Vec::new());
        for unit in pyramid.units() {
            let read = |_: usize, _: usize| Ok::<_, Error>(vec![PixelKind::Height.blank()]);
            seen.extend(build(&pyramid, &kinds, unit, &read).unwrap().0.iter().map(|p| p.at));
        }
        seen.sort_unstable();
        assert_eq!(seen.len(), 6 + 3 + 2);
        seen.dedup();
        assert_eq!(seen.len(), 6 + 3 + 2);
        assert_eq!(Pyramid::of(1, 1).levels().len(), 1);
    }
}
