//! Union of components across tile borders.

use crate::components::{Component, TileComponents};
use gable_geometry::{DVec2, DisjointSets, dvec2};
use gable_raster::GridWindow;

/// A whole building: all components, over all tiles, that hang together.
#[derive(Clone, Debug, PartialEq)]
pub struct Whole {
    /// Its pieces as (tile, component), ascending.
    pub pieces: Vec<(usize, u32)>,
    /// Pixels, moments and extent of all pieces together.
    pub extent: Component,
}

impl Whole {
    /// The smallest window that holds it, for a pixel of `step` metres.
    #[must_use]
    pub fn window(&self, step: f64) -> GridWindow {
        let ([x0, x1], [y0, y1]) = (self.extent.columns, self.extent.rows);
        GridWindow { step, x0, y0, width: (x1 - x0 + 1) as usize, height: (y1 - y0 + 1) as usize }
    }

    /// Mean of its pixel centres, local metres.
    #[must_use]
    pub fn centroid(&self, step: f64) -> DVec2 {
        let n = self.extent.pixels as f64;
        dvec2(self.extent.sum_x as f64 / n + 0.5, self.extent.sum_y as f64 / n + 0.5) * step
    }

    /// Area, m².
    #[must_use]
    pub fn area(&self, step: f64) -> f64 {
        self.extent.pixels as f64 * step * step
    }
}

/// Unites the components of tiles that do not overlap. The wholes come ordered by the row, then the column, of the lower
/// left corner of their extent (then by size), whatever the tiling or the order of the tiles.
#[must_use]
pub fn unite(tiles: &[TileComponents]) -> Vec<Whole> {
    let mut first = Vec::with_capacity(tiles.len());
    let mut count = 0;
    for tile in tiles {
        first.push(count);
        count += tile.components.len();
    }
    let mut sets = DisjointSets::new(count);
    for sides in [vertical_sides(tiles, &first), horizontal_sides(tiles, &first)] {
        join_neighbours(sides, &mut sets);
    }
    let mut wholes: Vec<Option<Whole>> = vec![None; count];
    for (t, tile) in tiles.iter().enumerate() {
        for (c, component) in tile.components.iter().enumerate() {
            let root = sets.find(first[t] + c);
            match &mut wholes[root] {
                Some(whole) => {
                    whole.pieces.push((t, c as u32));
                    whole.extent.absorb(component);
                }
                none => *none = Some(Whole { pieces: vec![(t, c as u32)], extent: component.clone() }),
            }
        }
    }
    let mut wholes: Vec<Whole> = wholes.into_iter().flatten().collect();
    wholes.sort_by_key(|w| (w.extent.rows, w.extent.columns, w.extent.pixels, w.extent.sum_x, w.extent.sum_y));
    wholes
}

/// A border pixel: (line on which the border lies, place along it, whether it lies behind the line, component).
type SidePixel = (i64, i64, bool, usize);

fn vertical_sides(tiles: &[TileComponents], first: &[usize]) -> Vec<SidePixel> {
    let mut out = Vec::new();
    for (tile, &first) in tiles.iter().zip(first) {
        let [x0, y0] = tile.corner;
        push(&mut out, &tile.west, x0, y0, true, first);
        push(&mut out, &tile.east, x0 + tile.width() as i64, y0, false, first);
    }
    out
}

fn horizontal_sides(tiles: &[TileComponents], first: &[usize]) -> Vec<SidePixel> {
    let mut out = Vec::new();
    for (tile, &first) in tiles.iter().zip(first) {
        let [x0, y0] = tile.corner;
        push(&mut out, &tile.south, y0, x0, true, first);
        push(&mut out, &tile.north, y0 + tile.height() as i64, x0, false, first);
    }
    out
}

fn push(out: &mut Vec<SidePixel>, side: &[u32], line: i64, start: i64, behind: bool, first: usize) {
    let marked = side.iter().enumerate().filter(|&(_, &mark)| mark != 0);
    out.extend(marked.map(|(i, &mark)| (line, start + i as i64, behind, first + mark as usize - 1)));
}

fn join_neighbours(mut sides: Vec<SidePixel>, sets: &mut DisjointSets) {
    sides.sort_unstable();
    for pair in sides.windows(2) {
        let (before, behind) = (pair[0], pair[1]);
        if (before.0, before.1) == (behind.0, behind.1) && before.2 != behind.2 {
            sets.join(before.3, behind.3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::Raster;
    use proptest::prelude::*;

    fn extents(raster: &Raster<bool>, columns: usize, rows: usize) -> Vec<Component> {
        let window = raster.window();
        let mut tiles = Vec::new();
        for j in 0..rows {
            for i in 0..columns {
                let cut = |n: usize, k: usize, parts: usize| n * k / parts;
                let (xa, xb) = (cut(window.width, i, columns), cut(window.width, i + 1, columns));
                let (ya, yb) = (cut(window.height, j, rows), cut(window.height, j + 1, rows));
                let part = GridWindow {
                    x0: window.x0 + xa as i64,
                    y0: window.y0 + ya as i64,
                    width: xb - xa,
                    height: yb - ya,
                    ..window
                };
                tiles.push(TileComponents::of(&raster.crop(part, false), |&b| b).0);
            }
        }
        let forward = unite(&tiles);
        tiles.reverse();
        let backward: Vec<_> = unite(&tiles).into_iter().map(|w| w.extent).collect();
        let forward: Vec<_> = forward.into_iter().map(|w| w.extent).collect();
        assert_eq!(forward, backward, "the order of the tiles matters");
        forward
    }

    proptest! {
        #[test]
        fn wholes_do_not_depend_on_the_tiling(bits in proptest::collection::vec(any::<bool>(), 20 * 17), columns in 1usize..7, rows in 1usize..7) {
            let window = GridWindow { step: 0.2, x0: -7, y0: 100, width: 20, height: 17 };
            let raster = Raster::new(window, bits);
            let whole = extents(&raster, 1, 1);
            prop_assert_eq!(&whole, &extents(&raster, columns, rows));
            let pixels: u64 = whole.iter().map(|c| c.pixels).sum();
            prop_assert_eq!(pixels as usize, raster.values().iter().filter(|&&b| b).count());
        }
    }

    #[test]
    fn a_building_across_ten_tiles_is_one() {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 100, height: 3 };
        let raster = Raster::filled(window, true);
        let wholes = extents(&raster, 10, 1);
        assert_eq!(wholes.len(), 1);
        assert_eq!((wholes[0].pixels, wholes[0].columns, wholes[0].rows), (300, [0, 99], [0, 2]));
    }
}
