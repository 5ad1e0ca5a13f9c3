//! Ponds: a hollow with banks and level water in it.

use super::{Landform, ramp};
use crate::scene::objects::{Cover, Patch};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};
use std::sync::Arc;

#[derive(Debug)]
struct Hollow {
    plan: Oblong,
    /// Height of the water.
    level: f64,
    /// Width of the banks, metres; 0 is a wall.
    bank: f64,
}

impl Landform for Hollow {
    fn height(&self, p: DVec2, below: f64) -> f64 {
        let d = p - self.plan.centre;
        let (s, t) =
            (d.dot(self.plan.axis) / self.plan.half_length, d.dot(self.plan.axis.perp()) / self.plan.half_width);
        let out = ((s * s + t * t).sqrt() - 1.0) * self.plan.half_width;
        let share = if out <= 0.0 { 0.0 } else { ramp(0.0, self.bank, out) };
        self.level + (below - self.level) * share
    }
}

/// An ellipse in an oblong, counter-clockwise.
fn ellipse(plan: &Oblong) -> Vec<DVec2> {
    let corner = |k: i32| {
        let (t, s) = (f64::from(k) / 24.0 * std::f64::consts::TAU).sin_cos();
        plan.at(s, t)
    };
    (0..24).map(corner).collect()
}

/// One or two ponds 8 to 50 m long, 0.5 to 3 m under their surroundings.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    for _ in 0..1 + c.index(2) {
        let (half_length, half_width) = (c.range(5.0, 25.0), c.range(4.0, 14.0));
        let bank = if c.unit() < 0.3 { 0.0 } else { c.range(1.0, 6.0) };
        let Some(whole) = site.find(half_length + bank, half_width + bank, 2.0, c) else { continue };
        let plan = Oblong { half_length, half_width, ..whole };
        let lowest = whole.ring().iter().map(|p| site.town.relief.height(*p)).fold(f64::INFINITY, f64::min);
        let level = lowest - c.range(0.5, 3.0);
        site.town.relief.add(Arc::new(Hollow { plan, level, bank }));
        site.town.patch(Cover::Grass, whole);
        site.town.patches.push(Patch { cover: Cover::Water, plan, outline: ellipse(&plan), level: Some(level) });
        site.reserve(whole);
        for _ in 0..c.index(6) {
            let place = whole.at(c.range(-1.0, 1.0), c.range(0.9, 1.1));
            site.town.tree(place, c);
        }
    }
}
