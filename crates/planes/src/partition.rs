//! A labelling of a building's pixels by planes, and the steps that improve it.

use crate::local_fit::Field;
use crate::roof_plane::UNASSIGNED;
use gable_geometry::{Covariance3, DVec3, dvec3};
use gable_raster::around_inner;

/// Coefficients a, b, c of z = a·x + b·y + c in the field's coordinates.
pub(crate) type Coefficients = [f64; 3];

/// Pixels by plane.
pub(crate) struct Partition<'a> {
    pub(crate) field: &'a Field,
    /// Index into `planes` for each pixel.
    pub(crate) labels: Vec<u16>,
    pub(crate) planes: Vec<Coefficients>,
    /// Squared distance at which a pixel is better left unassigned, m².
    pub(crate) cut2: f64,
    /// Cost of a neighbour of another label, m².
    pub(crate) smoothness: f64,
}

impl<'a> Partition<'a> {
    pub(crate) fn new(field: &'a Field, cut: f64, smoothness: f64) -> Self {
        let labels = vec![UNASSIGNED; field.z.len()];
        Self { field, labels, planes: Vec::new(), cut2: cut * cut, smoothness }
    }

    /// [`is_interior`] with this labelling.
    pub(crate) fn is_interior(&self, pixel: usize, reach: usize) -> bool {
        is_interior(&self.labels, self.field.width, self.field.height, pixel, reach)
    }

    /// Pixels that count as rounded off: 0.4 m from a border.
    pub(crate) fn rounding_reach(&self) -> usize {
        ((0.4 / self.field.step).round() as usize).max(1)
    }

    /// [`interior_moments`] with this labelling.
    pub(crate) fn moments(&self) -> Vec<Covariance3> {
        let field = self.field;
        let point = |p: usize| {
            let (x, y) = field.position(p);
            dvec3(x, y, f64::from(field.z[p]))
        };
        let reach = self.rounding_reach();
        interior_moments(&self.labels, field.width, field.height, self.planes.len(), reach, point)
    }

    /// Fits every plane to its pixels.
    pub(crate) fn refit(&mut self) {
        let moments = self.moments();
        for (plane, moments) in self.planes.iter_mut().zip(moments) {
            if let Some(p) = moments.height_plane() {
                *plane = [p.a, p.b, p.c];
            }
        }
    }

    /// Lets the planes compete for the pixels at their borders, `rounds` times: iterated conditional modes of
    /// Σ min(misfit, cut²) + smoothness · unequal neighbours, where a pixel may only take the label of one of
    /// its four neighbours or none. Planes are fitted again every other round. Only the first round visits all
    /// pixels; the others visit those whose neighbourhood is not uniform or has just changed.
    pub(crate) fn compete(&mut self, rounds: usize) {
        let w = self.field.width;
        let mut queued = vec![false; self.labels.len()];
        let mut visit: Vec<u32> = self.field.inside.clone();
        for round in 0..rounds {
            let mut next = Vec::new();
            let mut changed = 0;
            for k in 0..visit.len() {
                // Forth and back, so that no direction is preferred.
                let pixel = visit[if round % 2 == 0 { k } else { visit.len() - 1 - k }];
                let pixel = pixel as usize;
                let Some(label) = self.best_label(pixel) else { continue };
                let mut queue = |q: usize| {
                    if !std::mem::replace(&mut queued[q], true) && !self.field.z[q].is_nan() {
                        next.push(q as u32);
                    }
                };
                queue(pixel);
                if label != self.labels[pixel] {
                    self.labels[pixel] = label;
                    changed += 1;
                    around_inner(pixel, w).into_iter().for_each(queue);
                }
            }
            if round % 2 == 1 || round + 1 == rounds {
                self.refit();
            }
            if changed * 500 < self.field.inside.len() {
                break;
            }
            for &q in &next {
                queued[q as usize] = false;
            }
            next.sort_unstable();
            visit = next;
        }
    }

    /// The label that suits a pixel best; `None` if nothing speaks for a change: a pixel among equals that is near
    /// its plane, or at the border of the raster.
    fn best_label(&self, pixel: usize) -> Option<u16> {
        let (w, h) = (self.field.width, self.field.height);
        let (i, j) = (pixel % w, pixel / w);
        if i == 0 || j == 0 || i + 1 == w || j + 1 == h {
            return None;
        }
        let own = self.labels[pixel];
        let around = around_inner(pixel, w).map(|q| self.labels[q]);
        if around.iter().all(|&l| l == own) {
            let limit = self.cut2 + 8.0 * self.smoothness;
            if own == UNASSIGNED || self.field.misfit(pixel, self.planes[own as usize]) <= limit {
                return None;
            }
        }
        let cost = |label: u16| {
            let unequal = around.iter().filter(|&&l| l != label).count();
            let misfit = if label == UNASSIGNED {
                self.cut2
            } else {
                self.field.misfit(pixel, self.planes[label as usize]).min(2.0 * self.cut2)
            };
            misfit + self.smoothness * unequal as f64
        };
        let mut best = (cost(own), own);
        for (n, label) in std::iter::once(UNASSIGNED).chain(around[..4].iter().copied()).enumerate() {
            let seen = label == own || (n > 0 && (label == UNASSIGNED || around[..n - 1].contains(&label)));
            if !seen {
                let c = cost(label);
                if c < best.0 {
                    best = (c, label);
                }
            }
        }
        Some(best.1)
    }

    /// Pixels of each plane.
    pub(crate) fn counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.planes.len()];
        for &label in &self.labels {
            if label != UNASSIGNED {
                counts[label as usize] += 1;
            }
        }
        counts
    }

    /// Drops the planes for which `keep` is false and renumbers the others; their pixels become unassigned.
    pub(crate) fn retain(&mut self, keep: &[bool]) {
        let mut index = vec![UNASSIGNED; keep.len()];
        let mut kept = Vec::new();
        for (k, plane) in self.planes.iter().enumerate() {
            if keep[k] {
                index[k] = kept.len() as u16;
                kept.push(*plane);
            }
        }
        self.planes = kept;
        for label in &mut self.labels {
            if *label != UNASSIGNED {
                *label = index[*label as usize];
            }
        }
    }
}

/// Whether a pixel and the four at `reach` pixels from it have the same label: not at a border, where
/// surfaces are rounded. Pixels outside the raster count as another label.
pub(crate) fn is_interior(labels: &[u16], width: usize, height: usize, pixel: usize, reach: usize) -> bool {
    let (i, j) = (pixel % width, pixel / width);
    let label = labels[pixel];
    i >= reach
        && j >= reach
        && i + reach < width
        && j + reach < height
        && labels[pixel - reach] == label
        && labels[pixel + reach] == label
        && labels[pixel - reach * width] == label
        && labels[pixel + reach * width] == label
}

/// Moments of each label's pixels. Pixels at borders weigh little, so that rounding does not bias a fit but small
/// regions still have one.
pub(crate) fn interior_moments(
    labels: &[u16],
    width: usize,
    height: usize,
    count: usize,
    reach: usize,
    point: impl Fn(usize) -> DVec3,
) -> Vec<Covariance3> {
    let mut out = vec![Covariance3::default(); count];
    for (pixel, &label) in labels.iter().enumerate() {
        if label != UNASSIGNED {
            let weight = if is_interior(labels, width, height, pixel, reach) { 1.0 } else { 0.02 };
            out[label as usize].add(point(pixel), weight);
        }
    }
    out
}

/// Sum of squared orthogonal residuals of the best plane through points with these moments.
pub(crate) fn residual_sum(moments: &Covariance3) -> f64 {
    let [_, _, xz, _, yz, zz] = moments.matrix();
    let Some(p) = moments.height_plane() else { return 0.0 };
    (zz - p.a * xz - p.b * yz).max(0.0) / (1.0 + p.a * p.a + p.b * p.b) * moments.weight()
}
