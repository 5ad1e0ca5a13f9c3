//! Fields with crops in rows: low ones, vines, maize, orchards.

use crate::noise::{hash, unit};
use crate::scene::objects::{Clutter, Cover, Species, Thing};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Length of a piece of a row, metres.
const PIECE: f64 = 9.0;

/// Two to five fields.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    for _ in 0..2 + c.index(4) {
        let Some(plan) = site.find(c.range(14.0, 45.0), c.range(10.0, 30.0), 1.0, c) else { continue };
        site.take(&plan);
        site.town.patch(if c.unit() < 0.5 { Cover::Ploughed } else { Cover::Field }, plan);
        if c.unit() < 0.25 {
            orchard(site, &plan, c);
        } else {
            rows(site, &plan, c);
        }
    }
}

fn rows(site: &mut Site, plan: &Oblong, c: &mut Counter) {
    let height = if c.unit() < 0.4 { c.range(0.3, 1.0) } else { c.range(1.0, 2.8) };
    let half = c.range(0.3, 0.8);
    let pitch = 2.0 * half + c.range(0.5, 2.0);
    let (lines, pieces) = ((2.0 * plan.half_width / pitch) as usize, (2.0 * plan.half_length / PIECE) as usize);
    for j in 0..lines {
        for i in 0..pieces {
            let seed = c.bits();
            // Here and there nothing grew.
            if unit(hash(seed, 0, 0, 0)) < 0.06 {
                continue;
            }
            let (s, t) = ((2 * i + 1) as f64 / pieces as f64 - 1.0, (2 * j + 1) as f64 / lines as f64 - 1.0);
            let centre = plan.at(s, t);
            let half_length = plan.half_length / pieces as f64;
            let piece = Oblong { centre, half_length, half_width: half, ..*plan };
            let low = site.town.relief.height(centre);
            site.town.clutter.push(Clutter { thing: Thing::Crop, plan: piece, low, high: low + height, seed });
        }
    }
}

fn orchard(site: &mut Site, plan: &Oblong, c: &mut Counter) {
    let pitch = c.range(4.0, 6.5);
    let size = c.unit();
    let (lines, count) = ((2.0 * plan.half_width / pitch) as usize, (2.0 * plan.half_length / pitch) as usize);
    for j in 0..lines {
        for i in 0..count {
            let (s, t) = ((2 * i + 1) as f64 / count as f64 - 1.0, (2 * j + 1) as f64 / lines as f64 - 1.0);
            if c.unit() > 0.08 {
                site.town.tree_of(Species::Fruit, size, plan.at(s, t), c);
            }
        }
    }
}
