//! Palms along ways and between houses, bananas in dense groves and at walls.

use crate::scene::objects::{Cover, Species};
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};

/// Groves of bananas, as dense as they are planted.
pub(crate) fn bananas(site: &mut Site, c: &mut Counter) {
    for _ in 0..2 + (site.area() / 5_000.0) as usize {
        let Some(plan) = site.find(c.range(4.0, 18.0), c.range(3.0, 12.0), 0.3, c) else { continue };
        site.town.patch(Cover::Thicket, plan);
        let count = (plan.half_length * plan.half_width * 4.0 / 5.0) as usize;
        let size = c.range(0.2, 0.9);
        for _ in 0..count {
            let place = plan.at(c.range(-1.0, 1.0), c.range(-1.0, 1.0));
            site.town.tree_of(Species::Banana, (size + c.range(-0.2, 0.2)).clamp(0.0, 1.0), place, c);
        }
    }
}

/// Palms: rows, groups and single ones.
pub(crate) fn palms(site: &mut Site, c: &mut Counter) {
    for _ in 0..2 + c.index(3) {
        let way = site.strip(c.range(-0.8, 0.8), 1.0, c);
        let (size, pitch) = (c.unit(), c.range(5.0, 12.0));
        let count = (2.0 * way.half_length / pitch) as usize;
        for i in 0..count {
            let place = way.at((2 * i + 1) as f64 / count as f64 - 1.0, 0.0);
            if c.unit() < 0.85 {
                site.town.tree_of(Species::Palm, (size + c.range(-0.15, 0.15)).clamp(0.0, 1.0), place, c);
            }
        }
    }
    for _ in 0..(site.area() / 700.0) as usize {
        let middle = site.anywhere(c);
        for _ in 0..1 + c.index(4) {
            let place = middle + DVec2::from_angle(c.range(0.0, 6.3)) * c.range(0.5, 6.0);
            site.town.tree_of(Species::Palm, c.unit(), place, c);
        }
    }
}
