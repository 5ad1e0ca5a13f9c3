//! Connected regions of a label.

use gable_raster::Raster;

/// A connected region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Component {
    /// Its number in the raster of numbers, from 1.
    pub id: u32,
    /// Pixels.
    pub pixels: usize,
    /// First column, counted in the raster.
    pub x0: usize,
    /// First row.
    pub y0: usize,
    /// Column after the last.
    pub x1: usize,
    /// Row after the last.
    pub y1: usize,
}

impl Component {
    /// Whether the region reaches the border of a raster of `width` × `height` pixels, so that it may go on beyond.
    #[must_use]
    pub fn touches_border(&self, width: usize, height: usize) -> bool {
        self.x0 == 0 || self.y0 == 0 || self.x1 == width || self.y1 == height
    }
}

/// The 4-connected regions of the pixels with a value.
///
/// Gives the number of its region for each pixel (0: another value) and the regions, numbered from 1 in the order of
/// their first pixel, row by row. O(pixels · α).
#[must_use]
pub fn components<T: PartialEq>(raster: &Raster<T>, value: &T) -> (Raster<u32>, Vec<Component>) {
    let (width, height) = (raster.width(), raster.height());
    let mut numbers = vec![0_u32; width * height];
    // parent[k] of the provisional number k.
    let mut parent: Vec<u32> = vec![0];
    for y in 0..height {
        for (x, v) in raster.row(y).iter().enumerate() {
            if v != value {
                continue;
            }
            let i = y * width + x;
            let west = if x > 0 { numbers[i - 1] } else { 0 };
            let south = if y > 0 { numbers[i - width] } else { 0 };
            numbers[i] = match (west, south) {
                (0, 0) => {
                    parent.push(parent.len() as u32);
                    parent.len() as u32 - 1
                }
                (0, k) | (k, 0) => k,
                (a, b) => {
                    let (a, b) = (root(&mut parent, a), root(&mut parent, b));
                    // The earlier number stays the root.
                    parent[a.max(b) as usize] = a.min(b);
                    a.min(b)
                }
            };
        }
    }
    let mut ids = vec![0_u32; parent.len()];
    let mut found: Vec<Component> = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let number = &mut numbers[y * width + x];
            if *number == 0 {
                continue;
            }
            let root = root(&mut parent, *number) as usize;
            if ids[root] == 0 {
                ids[root] = found.len() as u32 + 1;
                found.push(Component { id: ids[root], pixels: 0, x0: x, y0: y, x1: x + 1, y1: y + 1 });
            }
            *number = ids[root];
            let region = &mut found[ids[root] as usize - 1];
            region.pixels += 1;
            region.x0 = region.x0.min(x);
            region.x1 = region.x1.max(x + 1);
            region.y1 = y + 1;
        }
    }
    (Raster::new(raster.window(), numbers), found)
}

fn root(parent: &mut [u32], mut k: u32) -> u32 {
    while parent[k as usize] != k {
        parent[k as usize] = parent[parent[k as usize] as usize];
        k = parent[k as usize];
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;
    use gable_raster::GridWindow;

    #[test]
    fn equals_flood_fill() {
        let mut random = Counter::new(6);
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 31, height: 23 };
        let raster = Raster::filled(window, ()).map(|()| random.index(2) as u8);
        let (numbers, regions) = components(&raster, &1);
        let mut seen = vec![0_u32; window.len()];
        let mut count = 0;
        for start in 0..window.len() {
            if raster.values()[start] != 1 || seen[start] != 0 {
                continue;
            }
            count += 1;
            seen[start] = count;
            let mut stack = vec![start];
            let mut pixels = 0;
            while let Some(i) = stack.pop() {
                pixels += 1;
                let (x, y) = (i % 31, i / 31);
                let around =
                    [(x > 0, i.wrapping_sub(1)), (x < 30, i + 1), (y > 0, i.wrapping_sub(31)), (y < 22, i + 31)];
                for (inside, j) in around {
                    if inside && raster.values()[j] == 1 && seen[j] == 0 {
                        seen[j] = count;
                        stack.push(j);
                    }
                }
            }
            assert_eq!(regions[count as usize - 1].pixels, pixels);
        }
        assert_eq!(numbers.values(), seen);
        assert_eq!(regions.len(), count as usize);
    }
}
