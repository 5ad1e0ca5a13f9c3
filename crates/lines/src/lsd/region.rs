//! Regions of pixels whose level lines agree.

use super::gradient::Gradient;
use super::rectangle::Rectangle;
use gable_geometry::{DVec2, symmetric_eigen_2};
use gable_raster::around;

/// A grown region; its memory is used again from seed to seed.
#[derive(Default)]
pub(super) struct Region {
    /// The seed first.
    places: Vec<u32>,
    /// Sum of the level-line directions.
    sum: DVec2,
}

impl Region {
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Grows over unused 8-neighbours that agree with the mean direction to within `tolerance`, and marks them used.
    pub(super) fn grow(&mut self, gradient: &mut Gradient, seed: u32, tolerance: f64) {
        let cosine = tolerance.cos();
        self.places.clear();
        self.places.push(seed);
        self.sum = gradient.level(seed);
        gradient.set_used(seed, true);
        let mut mean = self.sum;
        let mut next = 0;
        while next < self.places.len() {
            let at = self.places[next] as usize;
            next += 1;
            for near in around(at, gradient.width, gradient.height) {
                let near = near as u32;
                if gradient.is_used(near) {
                    continue;
                }
                let level = gradient.level(near);
                // A place without gradient has direction zero.
                if level.dot(mean) >= cosine && level != DVec2::ZERO {
                    gradient.set_used(near, true);
                    self.places.push(near);
                    self.sum += level;
                    mean = self.sum.normalize_or_zero();
                }
            }
        }
    }

    /// The rectangle of the region's moments, magnitudes as masses; at least one pixel wide.
    fn fit(&self, gradient: &Gradient, tolerance: f64) -> Option<Rectangle> {
        let (mut mass, mut centre) = (0.0, DVec2::ZERO);
        for &at in &self.places {
            mass += gradient.magnitude(at);
            centre += gradient.place(at) * gradient.magnitude(at);
        }
        if mass <= 0.0 {
            return None;
        }
        centre /= mass;
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for &at in &self.places {
            let (d, m) = (gradient.place(at) - centre, gradient.magnitude(at));
            xx += m * d.x * d.x;
            xy += m * d.x * d.y;
            yy += m * d.y * d.y;
        }
        let (_, [_, axis]) = symmetric_eigen_2([xx / mass, xy / mass, yy / mass]);
        let along = if axis.dot(self.sum) < 0.0 { -axis } else { axis };
        let mut rectangle = Rectangle::new(centre, along, tolerance);
        for &at in &self.places {
            rectangle.include(gradient.place(at));
        }
        Some(rectangle)
    }

    /// Share of the rectangle that the region covers.
    fn density(&self, rectangle: &Rectangle) -> f64 {
        self.len() as f64 / (rectangle.length() * rectangle.width()).max(1e-9)
    }

    /// Fits a rectangle; where the region fills it too thinly, grows again with the tolerance seen near the seed, then
    /// drops what lies far from the seed until it is dense enough. `None` if hardly anything is left.
    pub(super) fn fit_densely(&mut self, gradient: &mut Gradient, tolerance: f64, density: f64) -> Option<Rectangle> {
        let mut rectangle = self.fit(gradient, tolerance)?;
        if self.density(&rectangle) >= density {
            return Some(rectangle);
        }
        let seed = self.places[0];
        let (direction, place) = (gradient.level(seed), gradient.place(seed));
        let [mut sum, mut squares, mut count] = [0.0; 3];
        for &at in &self.places {
            gradient.set_used(at, false);
            if gradient.place(at).distance(place) < rectangle.width() {
                let turn = direction.angle_to(gradient.level(at));
                sum += turn;
                squares += turn * turn;
                count += 1.0;
            }
        }
        let mean = sum / f64::max(count, 1.0);
        let spread = (squares / f64::max(count, 1.0) - mean * mean).max(0.0).sqrt();
        self.grow(gradient, seed, (2.0 * spread).min(tolerance));
        if self.len() < 3 {
            return None;
        }
        rectangle = self.fit(gradient, tolerance)?;
        let ends = rectangle.ends();
        let mut radius = ends[0].distance(place).max(ends[1].distance(place));
        while self.density(&rectangle) < density {
            radius *= 0.75;
            let mut sum = DVec2::ZERO;
            self.places.retain(|&at| {
                let near = gradient.place(at).distance(place) <= radius;
                if near {
                    sum += gradient.level(at);
                } else {
                    gradient.set_used(at, false);
                }
                near
            });
            self.sum = sum;
            if self.len() < 3 {
                return None;
            }
            rectangle = self.fit(gradient, tolerance)?;
        }
        Some(rectangle)
    }

    /// Mean change of the raster across the region.
    pub(super) fn contrast(&self, gradient: &Gradient, rectangle: &Rectangle) -> f64 {
        let across = rectangle.along().perp();
        let change = |&at: &u32| gradient.magnitude(at) * across.dot(gradient.level(at).perp());
        self.places.iter().map(change).sum::<f64>() / rectangle.length().max(1.0)
    }
}
