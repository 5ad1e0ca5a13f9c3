//! A plaza on two levels: a retaining wall with flights of stairs across the site.

use super::{Landform, ramp};
use crate::noise::{lattice_unit, noise2};
use crate::scene::objects::Cover;
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};
use std::sync::Arc;

/// Height and depth of a step, metres.
const STEP: [f64; 2] = [0.165, 0.32];
/// Distance from flight to flight along the wall, metres.
const PITCH: f64 = 28.0;

#[derive(Debug)]
struct Levels {
    seed: u64,
    plan: Oblong,
    height: f64,
    /// Half the width of a flight, metres.
    flight: f64,
    /// How far the wall swings, metres.
    swing: f64,
}

impl Landform for Levels {
    fn height(&self, p: DVec2, below: f64) -> f64 {
        let d = p - self.plan.centre;
        let (along, across) = (d.dot(self.plan.axis), d.dot(self.plan.axis.perp()));
        let across = across + self.swing * noise2(self.seed, 40.0, along, 0.0);
        let cell = (along / PITCH).floor();
        let middle = (cell + 0.3 + 0.4 * lattice_unit(self.seed, cell as i64, 0, 1)) * PITCH;
        if (along - middle).abs() < self.flight {
            let run = self.height / STEP[0] * STEP[1];
            let up = ramp(-run, 0.0, across) * self.height;
            return below + (up / STEP[0]).ceil() * STEP[0];
        }
        below + if across > 0.0 { self.height } else { 0.0 }
    }
}

/// Two levels 1.5 to 5 m apart.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let plan = site.strip(c.range(-0.4, 0.4), 4.0, c);
    let height = (c.range(1.5, 5.0) / STEP[0]).round() * STEP[0];
    let form = Levels { seed: c.bits(), plan, height, flight: c.range(1.5, 9.0), swing: c.range(0.0, 6.0) };
    let wide = Oblong { half_width: form.swing + 11.0, ..plan };
    site.town.relief.add(Arc::new(form));
    site.town.patch(if c.unit() < 0.5 { Cover::Pavement } else { Cover::Yard }, wide);
    site.reserve(Oblong { half_width: wide.half_width - 3.0, ..plan });
}
