//! Which roof plane each pixel of the mask belongs to: the detected inliers, completed to the whole mask.

use gable_geometry::Plane;
use gable_raster::{Raster, sides};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// No plane.
pub(crate) const NONE: u16 = u16::MAX;

/// Largest residual that is told apart, metres: what lies further off is a tree, a chimney or a hole.
const FAR: f32 = 4.0;

/// Gives every pixel of the mask a plane: regions of inliers grow over the rest in the order of the vertical residual,
/// so that borders come to lie where the planes stop fitting. Pixels without height are taken last.
/// O(n log n); ties are broken by pixel number, so the result does not depend on anything else.
pub(crate) fn complete(
    labels: &Raster<u16>,
    planes: &[Plane],
    height: &Raster<f32>,
    mask: &Raster<bool>,
) -> Raster<u16> {
    let window = labels.window();
    let (w, h) = (window.width, window.height);
    let mut out = labels.clone();
    for (label, &inside) in out.values_mut().iter_mut().zip(mask.values()) {
        if !inside {
            *label = NONE;
        }
    }
    let residual = |pixel: usize, plane: u16| {
        let z = height.values()[pixel];
        if z.is_nan() {
            return FAR;
        }
        let at = window.centre(pixel % w, pixel / w);
        ((f64::from(z) - planes[plane as usize].height(at)).abs() as f32).min(FAR)
    };
    let mut queue = BinaryHeap::new();
    let key = |r: f32| Reverse((r * 1000.0) as u32);
    for p in 0..w * h {
        let label = out.values()[p];
        if label == NONE {
            continue;
        }
        for q in sides(p, w, h).into_iter().flatten() {
            if mask.values()[q] && out.values()[q] == NONE {
                queue.push((key(residual(q, label)), Reverse(q), Reverse(label)));
            }
        }
    }
    while let Some((_, Reverse(p), Reverse(label))) = queue.pop() {
        if out.values()[p] != NONE {
            continue;
        }
        out.values_mut()[p] = label;
        for q in sides(p, w, h).into_iter().flatten() {
            if mask.values()[q] && out.values()[q] == NONE {
                queue.push((key(residual(q, label)), Reverse(q), Reverse(label)));
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;

    #[test]
    fn borders_come_to_lie_on_the_step() {
        let window = GridWindow { step: 1.0, x0: 0, y0: 0, width: 8, height: 3 };
        let planes = [Plane::horizontal(3.0), Plane::horizontal(6.0)];
        let height = Raster::new(window, (0..24).map(|p| if p % 8 < 5 { 3.1 } else { 6.0 }).collect());
        let mut labels = Raster::filled(window, NONE);
        labels[(0, 0)] = 0;
        labels[(7, 2)] = 1;
        let out = complete(&labels, &planes, &height, &Raster::filled(window, true));
        for p in 0..24 {
            assert_eq!(out.values()[p], u16::from(p % 8 >= 5));
        }
    }
}
