//! Connected components.

use crate::neighbours::Connectivity;
use crate::{GridWindow, Raster};
use gable_geometry::DisjointSets;

/// A connected component.
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
    /// Whether the component reaches the border of a raster of `width` × `height` pixels, so that it may go on beyond.
    #[must_use]
    pub fn touches_border(&self, width: usize, height: usize) -> bool {
        self.x0 == 0 || self.y0 == 0 || self.x1 == width || self.y1 == height
    }
}

/// The connected components of a raster.
#[derive(Clone, Debug, PartialEq)]
pub struct Components {
    /// The number of the component of each pixel, from 1; 0 for a pixel of none.
    pub numbers: Raster<u32>,
    /// The components, by number, which is the order of their first pixels, row by row.
    pub list: Vec<Component>,
}

/// The numbers along the four sides of a raster, 0 for none; all that has to be kept of a tile to unite its components with those
/// of the tiles beside it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BorderTraces {
    /// Along the southern row, from west to east.
    pub south: Vec<u32>,
    /// Along the northern row, from west to east.
    pub north: Vec<u32>,
    /// Along the western column, from south to north.
    pub west: Vec<u32>,
    /// Along the eastern column, from south to north.
    pub east: Vec<u32>,
}

impl Components {
    /// The pixels of each component, by number, each in the order of the raster. O(pixels).
    #[must_use]
    pub fn members(&self) -> Vec<Vec<usize>> {
        let mut members: Vec<Vec<usize>> = self.list.iter().map(|c| Vec::with_capacity(c.pixels)).collect();
        for (pixel, number) in self.numbers.values().iter().enumerate() {
            if *number != 0 {
                members[*number as usize - 1].push(pixel);
            }
        }
        members
    }

    /// The numbers along the four sides. O(width + height).
    #[must_use]
    pub fn border_traces(&self) -> BorderTraces {
        let (width, height) = (self.numbers.width(), self.numbers.height());
        if width == 0 || height == 0 {
            return BorderTraces::default();
        }
        let column = |x: usize| (0..height).map(|y| self.numbers[(x, y)]).collect();
        BorderTraces {
            south: self.numbers.row(0).to_vec(),
            north: self.numbers.row(height - 1).to_vec(),
            west: column(0),
            east: column(width - 1),
        }
    }
}

/// The connected components of the pixels whose values `belongs` accepts. O(pixels · α).
///
/// ```
/// use gable_raster::{Connectivity, GridWindow, Raster, components};
///
/// let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 4, height: 2 };
/// let heights = Raster::new(window, vec![3.0, 0.0, 0.0, 5.0, 0.0, 4.0, 0.0, 6.0]);
/// let high = components(&heights, Connectivity::Four, |height| *height > 2.0);
/// assert_eq!(high.numbers.values(), [1, 0, 0, 2, 0, 3, 0, 2]);
/// assert_eq!(high.list[1].pixels, 2);
/// assert_eq!(components(&heights, Connectivity::Eight, |height| *height > 2.0).list.len(), 2);
/// ```
#[must_use]
pub fn components<T>(raster: &Raster<T>, connectivity: Connectivity, belongs: impl Fn(&T) -> bool) -> Components {
    let values = raster.values();
    components_where(raster.window(), connectivity, |pixel| belongs(&values[pixel]), |_, _| true)
}

/// The connected components of the pixels that `belongs` accepts, where two pixels that touch are in one component if
/// `joined` says so (or if others link them). `joined` must not depend on the order of its pixels. Pixels are numbered row by row.
///
/// 1. Row by row each pixel takes the number of a pixel before it that touches it and is joined, else a new one; where it joins
///    several, their numbers are united (Rosenfeld & Pfaltz 1966).
/// 2. The numbers are replaced by those of the components, in the order of their first pixels.
///
/// O(pixels · α).
///
/// ```
/// use gable_raster::{Connectivity, GridWindow, components_where};
///
/// // Pixels of one label: 5 5 7 0, where 0 is none.
/// let labels = [5, 5, 7, 0];
/// let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 4, height: 1 };
/// let same = |a: usize, b: usize| labels[a] == labels[b];
/// let found = components_where(window, Connectivity::Four, |pixel| labels[pixel] != 0, same);
/// assert_eq!(found.numbers.values(), [1, 1, 2, 0]);
/// ```
#[must_use]
pub fn components_where(
    window: GridWindow,
    connectivity: Connectivity,
    belongs: impl Fn(usize) -> bool,
    joined: impl Fn(usize, usize) -> bool,
) -> Components {
    let (width, height) = (window.width, window.height);
    let corners = connectivity == Connectivity::Eight;
    let mut numbers = vec![0_u32; width * height];
    // Provisional numbers that belong together; 0 stays alone.
    let mut sets = DisjointSets::new(1);
    for row in 0..height {
        for column in 0..width {
            let pixel = row * width + column;
            if !belongs(pixel) {
                continue;
            }
            // Pixels before this one that touch it, and how far back they lie.
            let (has_west, has_south, has_east) = (column > 0, row > 0, column + 1 < width);
            let before = [
                (has_west, 1),
                (has_south, width),
                (corners && has_south && has_west, width + 1),
                (corners && has_south && has_east, width - 1),
            ];
            let mut own = 0;
            for (touches, back) in before {
                if !touches || numbers[pixel - back] == 0 || !joined(pixel - back, pixel) {
                    continue;
                }
                let other = numbers[pixel - back];
                if own == 0 {
                    own = other;
                } else if own != other {
                    sets.join(own as usize, other as usize);
                }
            }
            numbers[pixel] = if own == 0 { sets.add() as u32 } else { own };
        }
    }
    let list = renumber(&mut numbers, width, &mut sets);
    Components { numbers: Raster::new(window, numbers), list }
}

/// Step 2 of [`components_where`].
fn renumber(numbers: &mut [u32], width: usize, sets: &mut DisjointSets) -> Vec<Component> {
    let mut ids = vec![0_u32; sets.len()];
    let mut list: Vec<Component> = Vec::new();
    for (row, numbers) in numbers.chunks_exact_mut(width.max(1)).enumerate() {
        for (column, number) in numbers.iter_mut().enumerate().filter(|(_, number)| **number != 0) {
            let root = sets.find(*number as usize);
            if ids[root] == 0 {
                ids[root] = list.len() as u32 + 1;
                list.push(Component { id: ids[root], pixels: 0, x0: column, y0: row, x1: column + 1, y1: row + 1 });
            }
            *number = ids[root];
            let component = &mut list[ids[root] as usize - 1];
            component.pixels += 1;
            component.x0 = component.x0.min(column);
            component.x1 = component.x1.max(column + 1);
            component.y1 = row + 1;
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flood;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn equal_the_floods_from_each_pixel(
            labels in prop::collection::vec(0_u8..3, 1..200), width in 1_usize..15, eight in any::<bool>()
        ) {
            let height = labels.len() / width;
            let window = GridWindow { step: 0.2, x0: -3, y0: 7, width, height };
            let labels = &labels[..width * height];
            let connectivity = if eight { Connectivity::Eight } else { Connectivity::Four };
            let same = |a: usize, b: usize| labels[a] == labels[b];
            let found = components_where(window, connectivity, |pixel| labels[pixel] != 0, same);
            let mut numbers = vec![0; labels.len()];
            let mut members: Vec<Vec<usize>> = Vec::new();
            for seed in 0..labels.len() {
                if labels[seed] == 0 || numbers[seed] != 0 {
                    continue;
                }
                let number = members.len() as u32 + 1;
                numbers[seed] = number;
                let mut component = Vec::new();
                flood(seed, width, height, connectivity, &mut component, |pixel| {
                    let taken = labels[pixel] == labels[seed] && numbers[pixel] == 0;
                    if taken {
                        numbers[pixel] = number;
                    }
                    taken
                });
                component.sort_unstable();
                members.push(component);
            }
            prop_assert_eq!(found.numbers.values(), &numbers[..]);
            prop_assert_eq!(found.members(), members.clone());
            for (component, pixels) in found.list.iter().zip(&members) {
                let columns = || pixels.iter().map(|pixel| pixel % width);
                let rows = || pixels.iter().map(|pixel| pixel / width);
                prop_assert_eq!(component.pixels, pixels.len());
                prop_assert_eq!((component.x0, component.x1), (columns().min().unwrap(), columns().max().unwrap() + 1));
                prop_assert_eq!((component.y0, component.y1), (rows().min().unwrap(), rows().max().unwrap() + 1));
            }
        }
    }

    #[test]
    fn traces_run_along_the_four_sides() {
        let window = GridWindow { step: 1.0, x0: 0, y0: 0, width: 3, height: 3 };
        let raster = Raster::new(window, vec![1, 0, 1, 0, 0, 1, 1, 0, 0]);
        let found = components(&raster, Connectivity::Four, |value| *value == 1);
        let traces = found.border_traces();
        assert_eq!((&traces.south[..], &traces.north[..]), (&[1, 0, 2][..], &[3, 0, 0][..]));
        assert_eq!((&traces.west[..], &traces.east[..]), (&[1, 0, 3][..], &[2, 2, 0][..]));
        let nothing = Raster::new(GridWindow { width: 0, ..window }, Vec::<u8>::new());
        assert_eq!(components(&nothing, Connectivity::Four, |_| true).border_traces(), BorderTraces::default());
    }
}
