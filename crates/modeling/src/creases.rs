//! Where roof planes meet: ridges, hips and valleys as intersections of planes, not as detected lines.
//!
//! Zhu 2018 (§5.2) finds ridges as segments in maps of directional normal variation, to which the planes fit only by
//! chance, so that thin walls stand along the ridges. Two planes that touch in the pixel labelling without a step meet
//! in their line of intersection, which is exact for both.

use crate::surface::NONE;
use gable_geometry::{DVec2, Plane};
use gable_raster::Raster;
use std::collections::BTreeMap;

/// A piece of the line in which two planes meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crease {
    pub(crate) a: DVec2,
    pub(crate) b: DVec2,
    /// The two planes, the smaller index first.
    pub(crate) planes: [u16; 2],
    /// Length of the label border that it explains, metres.
    pub(crate) support: f64,
}

/// The pixel edges between two labels: their middles, by pair of labels (smaller first), in row order.
pub(crate) fn borders(labels: &Raster<u16>) -> BTreeMap<[u16; 2], Vec<DVec2>> {
    let window = labels.window();
    let mut out: BTreeMap<[u16; 2], Vec<DVec2>> = BTreeMap::new();
    for y in 0..window.height {
        for x in 0..window.width {
            let here = labels[(x, y)];
            let mut add = |there: u16, at: DVec2| {
                if here != NONE && there != NONE && here != there {
                    out.entry([here.min(there), here.max(there)]).or_default().push(at);
                }
            };
            let centre = window.centre(x, y);
            if x + 1 < window.width {
                add(labels[(x + 1, y)], centre + DVec2::new(0.5 * window.step, 0.0));
            }
            if y + 1 < window.height {
                add(labels[(x, y + 1)], centre + DVec2::new(0.0, 0.5 * window.step));
            }
        }
    }
    out
}

/// Creases from the label borders. A border pixel belongs to the crease if the two planes differ there by less than
/// `step` metres in height and the line of intersection passes within `reach` metres; runs with gaps of at
/// most `reach` make one crease, which must explain at least `shortest` metres.
pub(crate) fn creases(labels: &Raster<u16>, planes: &[Plane], step: f64, reach: f64, shortest: f64) -> Vec<Crease> {
    let pixel = labels.window().step;
    let mut out = Vec::new();
    for (pair, points) in borders(labels) {
        let [p, q] = pair.map(|i| &planes[i as usize]);
        let Some((origin, along)) = p.intersection(q) else { continue };
        let mut places: Vec<f64> = points
            .iter()
            .filter(|&&x| (p.height(x) - q.height(x)).abs() < step)
            .filter(|&&x| (x - origin).perp_dot(along).abs() < reach)
            .map(|&x| (x - origin).dot(along))
            .collect();
        places.sort_by(f64::total_cmp);
        let mut start = 0;
        for end in 1..=places.len() {
            if end < places.len() && places[end] - places[end - 1] <= reach {
                continue;
            }
            let (from, to) = (places[start], places[end - 1]);
            start = end;
            if to - from >= shortest {
                out.push(Crease {
                    a: origin + along * from,
                    b: origin + along * to,
                    planes: pair,
                    support: (to - from).max(pixel),
                });
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
    fn a_ridge_is_the_line_of_intersection() {
        // The ridge runs along x = 4; the label border is ragged by a pixel.
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 40, height: 30 };
        let planes = [Plane { a: 0.5, b: 0.0, c: 3.0 }, Plane { a: -0.5, b: 0.0, c: 7.0 }];
        let labels = Raster::new(window, (0..1200).map(|p| u16::from(p % 40 >= 20 + (p / 40) % 2)).collect());
        let found = creases(&labels, &planes, 0.4, 1.0, 1.0);
        assert_eq!(found.len(), 1);
        assert!((found[0].a.x - 4.0).abs() < 1e-9 && (found[0].b.x - 4.0).abs() < 1e-9);
        assert!(found[0].a.distance(found[0].b) > 5.0);
        // A step of 2 m is no crease.
        let apart = [planes[0], Plane { c: 9.0, ..planes[1] }];
        assert!(creases(&labels, &apart, 0.4, 1.0, 1.0).is_empty());
    }
}
