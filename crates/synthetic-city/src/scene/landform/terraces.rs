//! A hillside in terraces: treads with retaining walls here and banks there, along the contour lines.

use super::Landform;
use crate::noise::noise2;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};
use std::sync::Arc;

#[derive(Debug)]
struct Terraces {
    seed: u64,
    /// Height from tread to tread, metres.
    rise: f64,
    /// Share of that height that the tread itself rises.
    rest: f64,
    /// Where the noise is above this, the hillside is as it grew.
    natural: f64,
    /// Where the noise is above this, a wall holds the step, else a bank.
    walls: f64,
}

impl Landform for Terraces {
    fn height(&self, p: DVec2, below: f64) -> f64 {
        if noise2(self.seed ^ 1, 55.0, p.x, p.y) > self.natural {
            return below;
        }
        let wobble = 0.6 * self.rise * noise2(self.seed ^ 2, 32.0, p.x, p.y);
        let level = (below + wobble) / self.rise;
        let (step, share) = (level.floor(), level - level.floor());
        let riser = if noise2(self.seed ^ 3, 17.0, p.x, p.y) > self.walls { 0.02 } else { 0.35 };
        let tread = 1.0 - riser;
        let within =
            if share < tread { self.rest * share / tread } else { 1.0 - (1.0 - self.rest) * (1.0 - share) / riser };
        (step + within) * self.rise - wobble
    }
}

/// Terraces the whole site.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let form = Terraces {
        seed: c.bits(),
        rise: c.range(1.2, 3.6),
        rest: c.range(0.0, 0.25),
        natural: c.range(0.15, 0.7),
        walls: c.range(-0.5, 0.2),
    };
    site.town.relief.add(Arc::new(form));
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    #[test]
    fn steps_stay_near_the_slope_and_most_of_the_ground_is_flatter() {
        let form = Terraces { seed: 3, rise: 2.0, rest: 0.1, natural: 2.0, walls: -2.0 };
        let slope = |x: f64| 100.0 + 0.3 * x;
        let at = |x: f64| form.height(dvec2(x, 5.0), slope(x));
        let mut flat = 0;
        for i in 0..1000 {
            let x = f64::from(i) * 0.1;
            assert!((at(x) - slope(x)).abs() <= 2.0 + 1e-9, "{x}");
            flat += usize::from((at(x + 0.05) - at(x)).abs() < 0.3 * 0.05);
        }
        assert!(flat > 900, "{flat} of 1000 places are flatter than the hillside");
    }
}
