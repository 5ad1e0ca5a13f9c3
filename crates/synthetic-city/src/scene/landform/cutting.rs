//! A road in a cutting between walls or slopes, and bridges over it.

use super::{Landform, ramp};
use crate::scene::objects::{Clutter, Cover, Thing};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};
use std::sync::Arc;

#[derive(Debug)]
struct Cutting {
    /// Floor.
    plan: Oblong,
    depth: f64,
    /// Width of the slopes, metres; 0 are walls.
    run: f64,
    /// Share of the length over which the floor comes up to the ground at the ends.
    ends: f64,
}

impl Cutting {
    fn depth_at(&self, p: DVec2) -> f64 {
        let along = (p - self.plan.centre).dot(self.plan.axis).abs() / self.plan.half_length;
        self.depth * (1.0 - ramp(1.0 - self.ends, 1.0, along))
    }
}

impl Landform for Cutting {
    fn height(&self, p: DVec2, below: f64) -> f64 {
        let out = (p - self.plan.centre).dot(self.plan.axis.perp()).abs() - self.plan.half_width;
        let share = if out <= 0.0 { 0.0 } else { ramp(0.0, self.run, out) };
        below - self.depth_at(p) * (1.0 - share)
    }
}

/// A cutting 3 to 9 m deep; with `bridges`, one to three decks over it.
pub(crate) fn place(site: &mut Site, bridges: bool, c: &mut Counter) {
    let half_width = c.range(4.0, 10.0);
    let depth = if bridges { c.range(5.0, 9.0) } else { c.range(3.0, 9.0) };
    let run = if c.unit() < 0.45 { 0.0 } else { depth * c.range(0.6, 1.6) };
    let plan = site.strip(c.range(-0.3, 0.3), half_width, c);
    let form = Cutting { plan, depth, run, ends: c.range(0.05, 0.6) };
    let whole = Oblong { half_width: half_width + run + 1.5, ..plan };
    let mut decks = Vec::new();
    for k in 0..if bridges { 1 + c.index(3) } else { 0 } {
        let middle = plan.at(c.range(-0.25, 0.25) + 0.45 * (k as f64 - 0.5), 0.0);
        let half_length = whole.half_width + 2.0;
        let axis = DVec2::from_angle(c.range(-0.3, 0.3)).rotate(plan.axis.perp());
        let deck = Oblong { centre: middle, axis, half_length, half_width: c.range(1.5, 6.0) };
        let ends = [deck.at(-0.97, 0.0), deck.at(0.97, 0.0)].map(|p| site.town.relief.height(p));
        decks.push((deck, ends[0].max(ends[1]) + 0.15));
    }
    site.town.relief.add(Arc::new(form));
    site.town.patch(Cover::Grass, whole);
    site.town.patch(Cover::Asphalt, plan);
    site.reserve(whole);
    for side in [-1.0, 1.0] {
        site.town.cars(plan.at(-1.0, side * 0.5), plan.at(1.0, side * 0.5), 14.0, 0.4, false, c);
    }
    for (deck, high) in decks {
        let approach = Oblong { half_length: deck.half_length + 25.0, ..deck };
        for side in [-1.0, 1.0] {
            let ramp = Oblong { centre: approach.at(side * 0.8, 0.0), half_length: 0.2 * approach.half_length, ..deck };
            site.town.patch(Cover::Asphalt, ramp);
            site.reserve(ramp);
        }
        site.town.clutter.push(Clutter { thing: Thing::Bridge, plan: deck, low: high - 1.1, high, seed: c.bits() });
    }
}
