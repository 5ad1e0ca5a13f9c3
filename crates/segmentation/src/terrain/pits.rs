//! Small hollows in the midst of ground.

use super::cells::{Cells, Side};
use super::enclosure::STEP;

/// Area up to which a hollow is a fault of the mesh or too small to be told from one, m².
const PIT_AREA: f64 = 100.0;

/// Share of the border that has to be higher ground.
const IN_GROUND: f64 = 0.5;

/// Takes hollows out of the ground: shafts, stairs and spikes below ground, which the surface shall bridge. A court is none: what
/// stands around it is no ground. O(cells).
pub(super) fn leave_out(cells: &Cells, ground: &mut [bool]) {
    let surfaces = cells.surfaces(ground, STEP);
    let mut border = vec![0_usize; surfaces.sizes.len()];
    let mut in_ground = vec![0_usize; surfaces.sizes.len()];
    for (i, number) in surfaces.number.iter().enumerate() {
        let Some(number) = number else { continue };
        for side in Side::ALL {
            match cells.beside(i, side) {
                Some((j, _)) if surfaces.number[j] == Some(*number) => {}
                Some((j, rise)) => {
                    border[*number as usize] += 1;
                    in_ground[*number as usize] += usize::from(ground[j] && rise >= STEP);
                }
                None => border[*number as usize] += 1,
            }
        }
    }
    for (i, number) in surfaces.number.iter().enumerate() {
        if let Some(n) = number.map(|n| n as usize) {
            let is_pit = cells.area(surfaces.sizes[n]) < PIT_AREA && in_ground[n] as f64 > IN_GROUND * border[n] as f64;
            ground[i] &= !is_pit;
        }
    }
}
