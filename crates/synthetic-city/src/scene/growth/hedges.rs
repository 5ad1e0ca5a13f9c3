//! Hedges and climbers against the walls of houses, and hedges around their ground.

use crate::scene::objects::{Clutter, Thing};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Along half of the walls, up to the eaves.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let buildings = std::mem::take(&mut site.town.buildings);
    for building in &buildings {
        let dense = c.range(0.2, 0.9);
        for rim in &building.rims {
            let length = rim.from.distance(rim.to);
            let wall = building.roof[rim.face].plane.height(rim.from.midpoint(rim.to)) - building.base;
            if length < 2.5 || c.unit() > dense {
                continue;
            }
            let axis = (rim.to - rim.from) / length;
            let half_width = c.range(0.4, 1.2);
            let off = half_width + building.style.overhang * c.range(0.0, 1.0) + c.range(-0.2, 0.3);
            let plan = Oblong {
                centre: rim.from.midpoint(rim.to) - axis.perp() * off,
                axis,
                half_length: length / 2.0 * c.range(0.3, 1.1),
                half_width,
            };
            let low = site.town.relief.height(plan.centre);
            let high = low + (wall * c.range(0.3, 1.05)).clamp(0.8, 6.0);
            site.town.clutter.push(Clutter { thing: Thing::Hedge, plan, low: low - 0.5, high, seed: c.bits() });
        }
        let size = building.bounds.size();
        if c.unit() < 0.5 {
            let around = building.bounds.grown(c.range(2.0, 6.0));
            let height = c.range(1.0, 3.5);
            let far = gable_geometry::dvec2(around.max.x, around.min.y);
            site.town.fence(around.min, far, Thing::Hedge, height, c);
            if size.x < 30.0 {
                site.town.fence(far, around.max, Thing::Hedge, height, c);
            }
        }
    }
    site.town.buildings = buildings;
}
