//! Towers of 30 to 110 m on podiums, with slabs, plazas and rows of trees.

use crate::scene::house::Form;
use crate::scene::objects::Cover;
use crate::scene::primitive::{Oblong, Primitive};
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Fills a site.
pub(super) fn fill(site: &mut Site, c: &mut Counter) {
    super::whole(site, [Cover::Pavement, Cover::Grass, Cover::Concrete][c.index(3)]);
    for off in [-0.92, 0.92] {
        let street = site.strip(off, c.range(5.0, 9.0), c);
        site.town.patch(Cover::Asphalt, street);
        site.take(&street);
        site.town.cars(street.at(-1.0, 0.5), street.at(1.0, 0.5), 9.0, 0.6, false, c);
        site.town.tree_row(street.at(-1.0, 1.25), street.at(1.0, 1.25), c.range(6.0, 12.0), c);
    }
    for _ in 0..2 + (site.area() / 5_000.0) as usize {
        tower(site, c);
    }
    for _ in 0..1 + (site.area() / 9_000.0) as usize {
        if let Some(plan) = site.find(c.range(14.0, 30.0), c.range(6.0, 8.0), 10.0, c) {
            site.house(Form::Flat, &plan, c.range(15.0, 45.0), 0.0, 8.0, c);
        }
    }
    for _ in 0..(site.area() / 700.0) as usize {
        let place = site.anywhere(c);
        if c.unit() < 0.5 {
            site.town.grove(place, 2 + c.index(5), c);
        } else {
            site.town.tree(place, c);
        }
    }
}

/// A tower, in half of the cases on a podium of two to five storeys.
fn tower(site: &mut Site, c: &mut Counter) {
    let podium = c.unit() < 0.5;
    let (half_length, half_width) = (c.range(8.0, 15.0), c.range(7.0, 12.0));
    let grown = if podium { c.range(5.0, 14.0) } else { 0.0 };
    let Some(plan) = site.find(half_length + grown, half_width + grown, 12.0, c) else { return };
    let body = Oblong { half_length, half_width, ..plan };
    let body = Oblong { centre: plan.at(c.range(-0.3, 0.3), c.range(-0.3, 0.3)), ..body };
    let high = c.range(30.0, 110.0);
    let mut shape = vec![Primitive::flat(body.ring(), high)];
    // Lift and stairs above the roof.
    let head = Oblong { half_length: half_length * 0.4, half_width: half_width * 0.4, ..body };
    shape.push(Primitive::flat(head.ring(), high + c.range(2.5, 6.0)));
    if podium {
        shape.push(Primitive::flat(plan.ring(), c.range(5.0, 18.0)));
    }
    if site.town.add("tower", &shape, true, c) {
        site.take(&plan);
    }
}
