//! Sunken courts with walls, some with a ramp or a stair down into them.

use super::Landform;
use crate::scene::objects::Cover;
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};
use std::sync::Arc;

/// Height of a step of a stair, metres.
const STEP: f64 = 0.17;

#[derive(Debug)]
struct Court {
    plan: Oblong,
    /// Height of its floor.
    floor: f64,
    /// Way down; its far end lies at the ground.
    way: Option<Oblong>,
    stairs: bool,
}

impl Landform for Court {
    fn height(&self, p: DVec2, below: f64) -> f64 {
        if self.plan.contains(p) {
            return self.floor;
        }
        match self.way.filter(|way| way.contains(p)) {
            Some(way) => {
                let share = 0.5 + 0.5 * (p - way.centre).dot(way.axis) / way.half_length;
                let up = share * (below - self.floor);
                let up = if self.stairs { (up / STEP).round() * STEP } else { up };
                (self.floor + up).min(below)
            }
            None => below,
        }
    }
}

/// One to three courts of 30 to 400 m², 2.5 to 6 m deep.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    for _ in 0..1 + c.index(3) {
        let (half_length, half_width) = (c.range(3.0, 11.0), c.range(2.5, 9.0));
        let Some(plan) = site.find(half_length, half_width, 4.0, c) else { continue };
        let depth = c.range(2.5, 6.0);
        let lowest = plan.ring().iter().map(|p| site.town.relief.height(*p)).fold(f64::INFINITY, f64::min);
        let stairs = c.unit() < 0.5;
        let length = depth * if stairs { 1.8 } else { 6.0 } / 2.0;
        let way = (c.unit() < 0.7).then(|| Oblong {
            centre: plan.at(1.0 + length / plan.half_length, c.range(-0.5, 0.5)),
            axis: plan.axis,
            half_length: length,
            half_width: plan.half_width.min(if stairs { 2.0 } else { 3.0 }),
        });
        site.town.relief.add(Arc::new(Court { plan, floor: lowest - depth, way, stairs }));
        site.town.patch(if c.unit() < 0.5 { Cover::Yard } else { Cover::Pavement }, plan);
        site.reserve(plan);
        if let Some(way) = way {
            site.town.patch(Cover::Pavement, way);
            site.reserve(way);
        }
        if plan.half_length > 6.0 && c.unit() < 0.5 {
            site.town.tree(plan.at(0.4, 0.3), c);
        }
    }
}
