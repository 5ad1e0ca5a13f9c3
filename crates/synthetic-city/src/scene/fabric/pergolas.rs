//! Pergolas and open frames: beams on posts, some against walls. No buildings.

use crate::scene::objects::{Clutter, Species, Thing};
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Three to ten frames of 4 to 30 m, one in three overgrown.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    for _ in 0..3 + c.index(8) {
        let Some(plan) = site.find(c.range(2.0, 15.0), c.range(1.2, 4.0), 0.2, c) else { continue };
        site.take(&plan);
        let ground = plan.ring().iter().map(|p| site.town.relief.height(*p)).fold(f64::NEG_INFINITY, f64::max);
        let high = ground + c.range(2.4, 4.0);
        site.town.clutter.push(Clutter { thing: Thing::Pergola, plan, low: high - 0.35, high, seed: c.bits() });
        if c.unit() < 0.33 {
            for _ in 0..(plan.half_length * plan.half_width) as usize {
                let place = plan.at(c.range(-1.0, 1.0), c.range(-1.0, 1.0));
                site.town.tree_of(Species::Fruit, c.range(0.1, 0.5), place, c);
            }
        }
    }
}
