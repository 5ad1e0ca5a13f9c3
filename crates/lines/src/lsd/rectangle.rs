//! The rectangle of a candidate segment, and its variations.

use super::gradient::Gradient;
use super::nfa::significance;
use gable_geometry::DVec2;

/// An oriented rectangle on the gradient's lattice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    centre: DVec2,
    along: DVec2,
    /// Extent along and across, relative to the centre.
    length: [f64; 2],
    width: [f64; 2],
    /// Level lines within this angle of `along` are aligned.
    tolerance: f64,
}

impl Rectangle {
    /// The empty rectangle about a line.
    pub(super) fn new(centre: DVec2, along: DVec2, tolerance: f64) -> Self {
        Self { centre, along, length: [0.0; 2], width: [0.0; 2], tolerance }
    }

    /// Grows to hold a point.
    pub(super) fn include(&mut self, p: DVec2) {
        let d = p - self.centre;
        for (range, v) in [(&mut self.length, self.along.dot(d)), (&mut self.width, self.along.perp_dot(d))] {
            *range = [range[0].min(v), range[1].max(v)];
        }
    }

    pub(super) fn along(&self) -> DVec2 {
        self.along
    }

    pub(super) fn length(&self) -> f64 {
        self.length[1] - self.length[0]
    }

    /// At least one pixel.
    pub(super) fn width(&self) -> f64 {
        (self.width[1] - self.width[0]).max(1.0)
    }

    /// Ends of the segment: on the line of the masses, not half way between the sides.
    pub(super) fn ends(&self) -> [DVec2; 2] {
        self.length.map(|t| self.centre + self.along * t)
    }

    /// Pixels inside, and how many of them are aligned.
    fn count(&self, gradient: &Gradient) -> (usize, usize) {
        let cosine = self.tolerance.cos() as f32;
        let direction = [self.along.x as f32, self.along.y as f32];
        let [low, high] = self.width;
        let spare = 0.5 * (1.0 - (high - low)).max(0.0);
        let width = [low - spare, high + spare];
        let corner = |t: f64, s: f64| self.centre.y + self.along.y * t + self.along.perp().y * s;
        let ys = self.length.iter().flat_map(|&t| width.iter().map(move |&s| corner(t, s)));
        let (bottom, top) = ys.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
        let (mut total, mut aligned) = (0, 0);
        for y in bottom.ceil().max(0.0) as i64..=top.floor().min(gradient.height as f64 - 1.0) as i64 {
            let dy = y as f64 - self.centre.y;
            let mut from: f64 = 0.0;
            let mut to = gradient.width as f64 - 1.0;
            // along = dx·ax + dy·ay lies in `length`, across = dy·ax − dx·ay in `width`.
            for (slope, offset, range) in
                [(self.along.x, dy * self.along.y, self.length), (-self.along.y, dy * self.along.x, width)]
            {
                if slope.abs() < 1e-12 {
                    if offset < range[0] || offset > range[1] {
                        to = -1.0;
                    }
                    continue;
                }
                let [a, b] = range.map(|r| self.centre.x + (r - offset) / slope);
                from = from.max(a.min(b));
                to = to.min(a.max(b));
            }
            let (from, to) = ((from - 1e-9).ceil() as i64, (to + 1e-9).floor() as i64);
            if from > to {
                continue;
            }
            let row = gradient.level_row(y as usize, from as usize, to as usize);
            total += row.len();
            aligned += row.iter().filter(|l| l[0] * direction[0] + l[1] * direction[1] >= cosine).count();
        }
        (total, aligned)
    }

    fn significance(&self, gradient: &Gradient, log_tests: f64) -> f64 {
        let (total, aligned) = self.count(gradient);
        significance(total, aligned, self.tolerance / std::f64::consts::PI, log_tests)
    }

    /// The most significant of the published variations of this rectangle, with its significance: finer precision, less
    /// width on both sides, on the left, on the right, and precision again, five steps each; a rectangle that is
    /// significant as it is stays.
    pub(super) fn improved(self, gradient: &Gradient, log_tests: f64) -> (Self, f64) {
        let mut best = (self, self.significance(gradient, log_tests));
        let narrower = |r: &mut Self, left: f64, right: f64| {
            let fits = r.width[1] - r.width[0] > 1.0;
            if fits {
                r.width = [r.width[0] + right, r.width[1] - left];
            }
            fits
        };
        let finer = |r: &mut Self| {
            r.tolerance *= 0.5;
            true
        };
        let steps: [&dyn Fn(&mut Self) -> bool; 5] =
            [&finer, &|r| narrower(r, 0.25, 0.25), &|r| narrower(r, 0.5, 0.0), &|r| narrower(r, 0.0, 0.5), &finer];
        for step in steps {
            if best.1 > 0.0 {
                return best;
            }
            let mut tried = best.0;
            for _ in 0..5 {
                if !step(&mut tried) {
                    break;
                }
                let significance = tried.significance(gradient, log_tests);
                if significance > best.1 {
                    best = (tried, significance);
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, dvec2};
    use gable_raster::{GridWindow, Raster};

    #[test]
    fn counts_the_pixels_inside() {
        let window = GridWindow { step: 1.0, x0: 0, y0: 0, width: 31, height: 25 };
        let mut rng = Counter::new(8);
        let raster = Raster::new(window, (0..window.len()).map(|_| rng.unit() as f32).collect());
        let gradient = Gradient::new(&raster, 0.1).unwrap();
        for _ in 0..200 {
            let along = DVec2::from_angle(rng.range(0.0, 6.3));
            let mut r = Rectangle::new(dvec2(rng.range(0.0, 30.0), rng.range(0.0, 24.0)), along, 0.5);
            r.length = [-rng.range(0.0, 12.0), rng.range(0.0, 12.0)];
            r.width = [-rng.range(0.6, 3.0), rng.range(0.6, 3.0)];
            let (mut total, mut aligned) = (0, 0);
            for at in 0..(gradient.width * gradient.height) as u32 {
                let d = gradient.place(at) - r.centre;
                let inside = |v: f64, range: [f64; 2]| v >= range[0] && v <= range[1];
                if inside(along.dot(d), r.length) && inside(along.perp_dot(d), r.width) {
                    total += 1;
                    aligned += usize::from(gradient.level(at).dot(along) >= 0.5f64.cos());
                }
            }
            assert_eq!(r.count(&gradient), (total, aligned));
        }
    }
}
