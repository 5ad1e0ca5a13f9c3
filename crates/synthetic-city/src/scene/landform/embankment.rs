//! A road, a railway or a dike on an embankment across the site.

use super::{Landform, ramp};
use crate::scene::objects::Cover;
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};
use std::sync::Arc;

#[derive(Debug)]
struct Embankment {
    /// Crest.
    plan: Oblong,
    height: f64,
    /// Widths of the slopes on both sides; 0 is a wall.
    runs: [f64; 2],
}

impl Landform for Embankment {
    fn height(&self, p: DVec2, below: f64) -> f64 {
        let across = (p - self.plan.centre).dot(self.plan.axis.perp());
        let run = self.runs[usize::from(across > 0.0)];
        let out = across.abs() - self.plan.half_width;
        let down = if out <= 0.0 { 0.0 } else { ramp(0.0, run, out) };
        below + self.height * (1.0 - down)
    }
}

/// An embankment 2 to 7 m high through the site, one in three sides held by a wall.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let height = c.range(2.0, 7.0);
    let mut run = || if c.unit() < 0.33 { 0.0 } else { height * c.range(1.0, 2.0) };
    let runs = [run(), run()];
    let half_width = c.range(2.5, 7.0);
    let plan = site.strip(c.range(-0.35, 0.35), half_width, c);
    site.town.relief.add(Arc::new(Embankment { plan, height, runs }));
    let wide = half_width + runs[0].max(runs[1]) + 1.0;
    site.town.patch(Cover::Grass, Oblong { half_width: wide, ..plan });
    let rail = c.unit() < 0.4;
    let way = Oblong { half_width: half_width - 0.8, ..plan };
    site.town.patch(if rail { Cover::Soil } else { Cover::Asphalt }, way);
    site.reserve(Oblong { half_width: wide, ..plan });
    if !rail {
        site.town.cars(way.at(-1.0, 0.5), way.at(1.0, 0.5), 16.0, 0.35, false, c);
    }
    for side in [-1.0_f64, 1.0] {
        if runs[usize::from(side > 0.0)] > 3.0 && c.unit() < 0.6 {
            let foot = 1.0 + runs[usize::from(side > 0.0)] * 0.6 / half_width;
            site.town.tree_row(plan.at(-1.0, side * foot), plan.at(1.0, side * foot), c.range(5.0, 14.0), c);
        }
    }
}
