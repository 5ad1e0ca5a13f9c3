//! A campus: long flat blocks, joined by low wings, on lawns with paths, hedges, a sports field and a car park.

use crate::scene::house::Form;
use crate::scene::objects::{Cover, Thing};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Fills a site.
pub(super) fn fill(site: &mut Site, c: &mut Counter) {
    super::whole(site, if c.unit() < 0.6 { Cover::Grass } else { Cover::Pavement });
    for _ in 0..2 + c.index(3) {
        let path = site.strip(c.range(-0.9, 0.9), c.range(1.0, 4.0), c);
        let cover = [Cover::Pavement, Cover::Asphalt, Cover::Concrete][c.index(3)];
        site.town.patch(cover, path);
        let turned = Oblong { axis: path.axis.perp(), centre: path.at(c.range(-0.5, 0.5), 0.0), ..path };
        site.town.patch(cover, turned);
    }
    sports(site, c);
    let eave = c.range(6.0, 26.0);
    for _ in 0..2 + (site.area() / 4_500.0) as usize {
        let Some(plan) = site.find(c.range(14.0, 42.0), c.range(6.0, 10.0), 9.0, c) else { continue };
        let form = [Form::Flat, Form::Flat, Form::Flat, Form::Hip, Form::Courtyard, Form::Terraces][c.index(6)];
        let plan = if form == Form::Courtyard { Oblong { half_width: plan.half_length * 0.8, ..plan } } else { plan };
        if site.house(form, &plan, eave + c.range(-3.0, 3.0), 0.5, 6.0, c) {
            around(site, &plan, eave, c);
        }
    }
    car_park(site, c);
    for _ in 0..(site.area() / 500.0) as usize {
        let place = site.anywhere(c);
        if !site.is_reserved(place) {
            site.town.tree(place, c);
        }
    }
}

/// A low wing, a bed with a hedge and an avenue beside a block.
fn around(site: &mut Site, plan: &Oblong, eave: f64, c: &mut Counter) {
    if c.unit() < 0.5 {
        let wing = Oblong {
            centre: plan.at(c.range(-0.7, 0.7), 1.0 + 4.05 / plan.half_width),
            axis: plan.axis,
            half_length: c.range(3.0, 9.0),
            half_width: 4.0,
        };
        let low = c.range(3.2, 5.0).min(eave - 1.0);
        if site.is_free(&wing, -0.2) && site.town.house(Form::Flat, &wing, low, 0.0, c) {
            site.take(&wing);
        }
    }
    let bed = Oblong { centre: plan.at(0.0, -1.0 - 3.5 / plan.half_width), half_width: 2.4, ..*plan };
    if site.is_free(&bed, 0.2) {
        site.town.patch(Cover::Grass, bed);
        let height = c.range(0.8, 2.0);
        for t in [-1.0, 1.0] {
            site.town.fence(bed.at(-1.0, t), bed.at(1.0, t), Thing::Hedge, height, c);
        }
        site.town.tree_row(bed.at(-1.0, 0.0), bed.at(1.0, 0.0), c.range(5.0, 10.0), c);
    }
}

fn sports(site: &mut Site, c: &mut Counter) {
    if c.unit() < 0.5
        && let Some(plan) = site.find(c.range(14.0, 30.0), c.range(8.0, 18.0), 3.0, c)
    {
        site.take(&plan);
        site.town.patch(if c.unit() < 0.5 { Cover::Soil } else { Cover::Grass }, plan);
    }
}

fn car_park(site: &mut Site, c: &mut Counter) {
    let Some(plan) = site.find(c.range(12.0, 30.0), c.range(7.0, 9.0), 1.0, c) else { return };
    site.take(&plan);
    site.town.patch(Cover::Parking, plan);
    let share = c.range(0.2, 0.9);
    for t in [-0.7, 0.7] {
        site.town.cars(plan.at(-0.95, t), plan.at(0.95, t), 2.7, share, true, c);
    }
}
