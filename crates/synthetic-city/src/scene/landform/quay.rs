//! A canal or a harbour with quay walls, 1.5 to 5 m deep, across the site or along its rim.

use crate::scene::objects::{Cover, Patch};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Water in pieces, each level under the lowest ground beside it; the piece's ends are weirs.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let half_width = c.range(3.5, 14.0);
    // One in three runs along the rim.
    let off = if c.unit() < 0.33 { c.range(0.8, 0.95) } else { c.range(-0.4, 0.4) };
    let plan = site.strip(off, half_width, c);
    let depth = c.range(1.5, 5.0);
    let promenade = c.range(2.0, 6.0);
    let banks = Oblong { half_width: half_width + promenade, ..plan };
    site.town.patch(if c.unit() < 0.5 { Cover::Pavement } else { Cover::Grass }, banks);
    let piece = c.range(25.0, 70.0);
    let count = (2.0 * plan.half_length / piece).ceil();
    for k in 0..count as usize {
        let s = -1.0 + (2.0 * k as f64 + 1.0) / count;
        let part = Oblong { centre: plan.at(s, 0.0), half_length: plan.half_length / count, ..plan };
        let border = part.ring().into_iter().chain([part.at(0.0, -1.0), part.at(0.0, 1.0)]);
        let lowest = border.map(|p| site.town.relief.height(p)).fold(f64::INFINITY, f64::min);
        let level = Some(lowest - depth);
        site.town.patches.push(Patch { cover: Cover::Water, plan: part, outline: Vec::new(), level });
    }
    site.reserve(banks);
    for side in [-1.0, 1.0] {
        if c.unit() < 0.5 {
            let beside = 1.0 + 1.2 / half_width;
            site.town.tree_row(plan.at(-1.0, side * beside), plan.at(1.0, side * beside), c.range(7.0, 14.0), c);
        }
    }
}
