//! Works: halls with flat, gabled and saw-tooth roofs on concrete, with lean-tos, tanks, containers and trailers.

use crate::scene::building::Covering;
use crate::scene::fabric::sheets::{lean_tos, paint};
use crate::scene::house::{Form, part};
use crate::scene::objects::{Clutter, Cover, Thing};
use crate::scene::primitive::{Oblong, Primitive};
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Fills a site.
pub(super) fn fill(site: &mut Site, c: &mut Counter) {
    super::whole(site, [Cover::Concrete, Cover::Concrete, Cover::Asphalt, Cover::Soil][c.index(4)]);
    let road = site.strip(if c.unit() < 0.5 { -0.9 } else { 0.9 }, c.range(3.5, 8.0), c);
    site.town.patch(Cover::Asphalt, road);
    site.take(&road);
    site.town.tree_row(road.at(-1.0, 1.3), road.at(1.0, 1.3), c.range(5.0, 10.0), c);
    for _ in 0..2 + (site.area() / 4_500.0) as usize {
        let Some(plan) = site.find(c.range(10.0, 45.0), c.range(7.0, 24.0), 7.0, c) else { continue };
        hall(site, &plan, c);
    }
    lean_tos(site, c);
    for _ in 0..c.index(5) {
        tank(site, c);
    }
    for _ in 0..2 + (site.area() / 6_000.0) as usize {
        if let Some(lane) = site.find(c.range(8.0, 25.0), c.range(1.5, 6.0), 1.0, c) {
            site.take(&lane);
            containers(site, &lane, c);
        }
    }
    for _ in 0..(site.area() / 1_800.0) as usize {
        let place = site.anywhere(c);
        site.town.grove(place, 1 + c.index(4), c);
    }
}

fn hall(site: &mut Site, plan: &Oblong, c: &mut Counter) {
    let eave = c.range(5.0, 13.0);
    let first = site.town.buildings.len();
    let built = if c.unit() < 0.25 {
        let teeth = 3 + c.index(6);
        let shape: Vec<Primitive> = (0..teeth)
            .map(|k| {
                let at = |k: usize| 2.0 * k as f64 / teeth as f64 - 1.0;
                let tooth = part(plan, at(k), at(k + 1), -1.0, 1.0);
                let across = Oblong {
                    axis: tooth.axis.perp(),
                    half_length: tooth.half_width,
                    half_width: tooth.half_length,
                    ..tooth
                };
                Primitive::shed(&across, eave, 0.35)
            })
            .collect();
        site.is_free(plan, 4.0) && site.town.add("saw-tooth", &shape, false, c)
    } else {
        let form = [Form::Gable, Form::Gable, Form::Flat, Form::Flat, Form::Terraces][c.index(5)];
        site.house(form, plan, eave, c.range(0.06, 0.25), 4.0, c)
    };
    if !built {
        return;
    }
    site.take(plan);
    let style = &mut site.town.buildings[first].style;
    style.overhang = style.overhang.min(0.3);
    if c.unit() < 0.7 {
        (style.covering, style.roof) = (Covering::Corrugated, paint(c));
    }
}

/// A round tank of 3 to 12 m with a shallow roof.
fn tank(site: &mut Site, c: &mut Counter) {
    let radius = c.range(2.0, 8.0);
    let Some(plan) = site.find(radius, radius, 1.0, c) else { return };
    let shape = [Primitive::cone(plan.centre, radius, 16, c.range(3.0, 12.0), c.range(0.05, 0.25))];
    if site.town.add("tank", &shape, false, c) {
        site.take(&plan);
        if let Some(building) = site.town.buildings.last_mut() {
            (building.style.covering, building.style.roof) = (Covering::Metal, [196.0, 198.0, 198.0]);
            building.style.overhang = 0.0;
        }
    }
}

/// Containers, trailers and trucks in rows along a lane.
pub(crate) fn containers(site: &mut Site, lane: &Oblong, c: &mut Counter) {
    let half_length = if c.unit() < 0.5 { 3.0 } else { c.range(5.0, 7.5) };
    let mut s = -lane.half_length + half_length;
    while s + half_length <= lane.half_length {
        if c.unit() < 0.6 {
            let centre = lane.at(s / lane.half_length, c.range(-0.6, 0.6));
            let plan = Oblong { centre, axis: lane.axis, half_length, half_width: 1.25 };
            let low = site.town.relief.height(centre);
            let stacked = if c.unit() < 0.2 { 2.0 } else { 1.0 };
            let high = low + stacked * c.range(2.5, 3.0) + if half_length > 4.0 { 0.9 } else { 0.0 };
            site.town.clutter.push(Clutter { thing: Thing::Container, plan, low: low - 0.3, high, seed: c.bits() });
        }
        s += 2.0 * half_length + c.range(0.3, 4.0);
    }
}
