//! Regions that are no roof planes: too small, too thin or too steep.

use crate::partition::Partition;
use crate::roof_plane::UNASSIGNED;
use gable_raster::square_cores;

/// Drops planes with less than `min_area` m², steeper than `max_slope` (tangent), or thinner than `min_width`
/// metres nearly everywhere: rounded borders and walls. Returns how many were dropped.
pub(crate) fn clean(partition: &mut Partition<'_>, min_area: f64, min_width: f64, max_slope: f64) -> usize {
    let step = partition.field.step;
    let counts = partition.counts();
    // A square of 0.8 · min_width: strips that run diagonally hold it if they are 1.1 · min_width wide.
    let core = core_counts(partition, (0.4 * min_width / step + 1e-9) as usize);
    let keep: Vec<bool> = (0..partition.planes.len())
        .map(|k| {
            let [a, b, _] = partition.planes[k];
            // A disc of diameter min_width keeps its centre only; a region must hold more than that.
            let wide = core[k] as f64 >= (0.02 * counts[k] as f64).max(2.0);
            counts[k] as f64 * step * step >= min_area && a.hypot(b) <= max_slope && wide
        })
        .collect();
    let dropped = keep.iter().filter(|&&k| !k).count();
    if dropped > 0 {
        partition.retain(&keep);
    }
    dropped
}

/// Pixels of each label whose square of `2·reach + 1` pixels has the same label throughout.
fn core_counts(partition: &Partition<'_>, reach: usize) -> Vec<usize> {
    let (width, height) = (partition.field.width, partition.field.height);
    let mut counts = vec![0; partition.planes.len()];
    for label in square_cores(&partition.labels, width, height, reach, UNASSIGNED) {
        if label != UNASSIGNED {
            counts[label as usize] += 1;
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local_fit::Field;
    use gable_raster::{GridWindow, Raster};

    #[test]
    fn strips_walls_and_specks_go_and_the_rest_is_renumbered() {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 40, height: 40 };
        let field = Field::new(&Raster::filled(window, 0.0), &Raster::filled(window, true), 0.6);
        let mut partition = Partition::new(&field, 0.5, 0.0);
        // A strip of 0.6 m, a roof, a speck of 1 m², a wall.
        partition.planes = vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0; 3], [5.0, 0.0, 0.0]];
        for (p, label) in partition.labels.iter_mut().enumerate() {
            *label = match (p % 40, p / 40) {
                (0..3, _) => 0,
                (35.., 35..) => 2,
                (30.., _) => 3,
                _ => 1,
            };
        }
        assert_eq!(core_counts(&partition, 2), [0, 23 * 36, 1, 6 * 36 - 25]);
        assert_eq!(clean(&mut partition, 3.0, 1.0, 3.7), 3);
        assert_eq!(partition.planes, [[0.1, 0.0, 0.0]]);
        assert_eq!((partition.labels[0], partition.labels[10], partition.labels[39]), (UNASSIGNED, 0, UNASSIGNED));
    }
}
