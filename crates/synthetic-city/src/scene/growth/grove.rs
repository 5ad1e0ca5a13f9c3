//! Groves whose crowns meet and hide the ground, up to the walls of houses.

use crate::noise::noise2;
use crate::scene::objects::{Cover, Species};
use crate::scene::site::Site;
use gable_geometry::{Counter, dvec2};

const KINDS: [[Species; 3]; 4] = [
    [Species::Broadleaf, Species::Broadleaf, Species::Copper],
    [Species::Conifer, Species::Conifer, Species::Conifer],
    [Species::Broadleaf, Species::Poplar, Species::Fruit],
    [Species::Broadleaf, Species::Conifer, Species::Broadleaf],
];

/// Covers 25 to 75 % of the site.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let (seed, wide) = (c.bits(), c.range(35.0, 90.0));
    let bare = c.range(-0.35, 0.2);
    let kinds = KINDS[c.index(KINDS.len())];
    let pitch = c.range(2.8, 5.5);
    let clear = c.range(0.8, 4.0);
    let probe = site.town.probe();
    let [columns, rows] = [site.size().x, site.size().y].map(|side| (side / pitch) as usize);
    for j in 0..rows {
        for i in 0..columns {
            let shift = dvec2(c.range(0.1, 0.9), c.range(0.1, 0.9));
            let place = site.town.extent.min + (dvec2(i as f64, j as f64) + shift) * pitch;
            let inside = noise2(seed, wide, place.x, place.y) + 0.2 * noise2(seed ^ 1, 11.0, place.x, place.y);
            let (kind, size) = (kinds[c.index(3)], noise2(seed ^ 2, 30.0, place.x, place.y));
            let size = (0.55 + 0.5 * size + c.range(-0.25, 0.25)).clamp(0.0, 1.0);
            let near = [dvec2(clear, 0.0), dvec2(-clear, 0.0), dvec2(0.0, clear), dvec2(0.0, -clear)];
            let built = near.iter().any(|d| probe.building_at(place + *d).is_some());
            if inside > bare && !built && !site.is_reserved(place) {
                site.town.tree_of(kind, size, place, c);
            }
        }
    }
    site.town.buildings = probe.buildings;
    // Between the trunks grows what is lower.
    let patches = site.area() / 900.0;
    for _ in 0..patches as usize {
        let Some(plan) = site.find(c.range(4.0, 14.0), c.range(3.0, 9.0), -1.0, c) else { continue };
        if noise2(seed, wide, plan.centre.x, plan.centre.y) > bare {
            site.town.patch(Cover::Thicket, plan);
        }
    }
}
