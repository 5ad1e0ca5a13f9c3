//! Cloths on poles over stalls, yards and cars, and heaps under sheets: no buildings.

use crate::scene::objects::{Clutter, Thing};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Five to twenty cloths, a third of them in rows, and some heaps.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    for _ in 0..3 + c.index(6) {
        let (half_length, half_width) = (c.range(1.5, 7.0), c.range(1.2, 4.0));
        let Some(plan) = site.find(half_length, half_width, 0.3, c) else { continue };
        let height = c.range(2.3, 3.8);
        let stalls = if c.unit() < 0.35 { 2 + c.index(5) } else { 1 };
        for k in 0..stalls {
            let next = Oblong { centre: plan.at(0.0, 2.1 * k as f64), ..plan };
            if k > 0 && !site.is_free(&next, -0.5) {
                break;
            }
            cloth(site, next, height + c.range(-0.2, 0.2), c);
        }
    }
    heaps(site, c);
}

fn cloth(site: &mut Site, plan: Oblong, height: f64, c: &mut Counter) {
    let ground = plan.ring().iter().map(|p| site.town.relief.height(*p)).fold(f64::NEG_INFINITY, f64::max);
    let high = ground + height;
    site.town.clutter.push(Clutter { thing: Thing::Tarpaulin, plan, low: high - 0.35, high, seed: c.bits() });
    site.take(&plan);
}

/// Hay, silage, gravel: heaps of 1 to 4 m.
pub(crate) fn heaps(site: &mut Site, c: &mut Counter) {
    for _ in 0..2 + c.index(5) {
        let Some(plan) = site.find(c.range(2.0, 11.0), c.range(1.5, 5.0), 0.5, c) else { continue };
        let ground = plan.ring().iter().map(|p| site.town.relief.height(*p)).fold(f64::INFINITY, f64::min);
        let high = ground + c.range(1.0, 4.0);
        site.town.clutter.push(Clutter { thing: Thing::Heap, plan, low: ground - 0.2, high, seed: c.bits() });
        site.take(&plan);
    }
}
