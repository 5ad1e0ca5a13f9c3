//! Farms: barns, silos, a farmhouse and a yard with what stands about, between fields, hedges and strips of wood.

use crate::scene::building::Covering;
use crate::scene::fabric::sheets::paint;
use crate::scene::fabric::tarpaulins::heaps;
use crate::scene::house::Form;
use crate::scene::objects::{Clutter, Cover, Thing};
use crate::scene::primitive::{Oblong, Primitive};
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Fills a site.
pub(super) fn fill(site: &mut Site, c: &mut Counter) {
    fields(site, c);
    for _ in 0..1 + (site.area() / 40_000.0) as usize {
        farmstead(site, c);
    }
}

/// Fields, meadows and fallow with hedges, tracks and a strip of wood between them.
pub(super) fn fields(site: &mut Site, c: &mut Counter) {
    super::whole(site, [Cover::Grass, Cover::Ploughed, Cover::Field, Cover::Soil][c.index(4)]);
    let strips = 2 + c.index(3);
    let mut before = -1.0;
    for k in 0..strips {
        let after = 2.0 * (k as f64 + 1.0) / strips as f64 - 1.0 + c.range(-0.15, 0.15);
        let wide = site.size().max_element() * (after - before) / 4.0;
        let plan = site.strip(f64::midpoint(before, after), wide, c);
        before = after;
        let cover =
            [Cover::Grass, Cover::Ploughed, Cover::Field, Cover::Field, Cover::Soil, Cover::Thicket][c.index(6)];
        site.town.patch(cover, plan);
        let edge = |t: f64| (plan.at(-1.0, t), plan.at(1.0, t));
        match c.unit() {
            d if d < 0.4 => {
                let (from, to) = edge(1.0);
                site.town.fence(from, to, Thing::Hedge, c.range(1.2, 4.0), c);
            }
            d if d < 0.6 => {
                let (from, to) = edge(1.0);
                site.town.tree_row(from, to, c.range(4.0, 9.0), c);
            }
            d if d < 0.8 => {
                let track = Oblong { centre: plan.at(0.0, 1.0), half_width: c.range(1.2, 2.5), ..plan };
                site.town.patch(if c.unit() < 0.5 { Cover::Soil } else { Cover::Asphalt }, track);
            }
            _ => wood(site, &plan, c),
        }
    }
    for _ in 0..c.index(6) {
        let place = site.anywhere(c);
        site.town.tree(place, c);
    }
}

/// A strip of wood along a field.
fn wood(site: &mut Site, field: &Oblong, c: &mut Counter) {
    let half = c.range(3.0, 14.0) / field.half_width;
    let count = (2.0 * field.half_length * 2.0 * half * field.half_width / 14.0) as usize;
    for _ in 0..count {
        let place = field.at(c.range(-1.0, 1.0), 1.0 + c.range(-half, half));
        if !site.is_reserved(place) {
            site.town.tree(place, c);
        }
    }
}

fn farmstead(site: &mut Site, c: &mut Counter) {
    let (half_length, half_width) = (c.range(22.0, 45.0), c.range(18.0, 34.0));
    let found = (0..5).find_map(|k| {
        let shrunk = 1.0 - 0.14 * f64::from(k);
        site.find(half_length * shrunk, half_width * shrunk, 1.0, c)
    });
    let Some(yard) = found else { return };
    site.town.patch([Cover::Concrete, Cover::Soil, Cover::Yard][c.index(3)], yard);
    for _ in 0..6 + c.index(8) {
        let barn = Oblong {
            centre: yard.at(c.range(-0.8, 0.8), c.range(-0.8, 0.8)),
            axis: if c.unit() < 0.6 { yard.axis } else { yard.axis.perp() },
            half_length: c.range(8.0, 24.0),
            half_width: c.range(5.0, 12.0),
        };
        let form = [Form::Gable, Form::Gable, Form::Gable, Form::Shed][c.index(4)];
        let first = site.town.buildings.len();
        if site.house(form, &barn, c.range(3.5, 7.0), c.range(0.18, 0.5), c.range(0.3, 5.0), c) {
            let style = &mut site.town.buildings[first].style;
            if c.unit() < 0.75 {
                style.covering = Covering::Corrugated;
                style.roof = if c.unit() < 0.5 { [124.0, 120.0, 114.0] } else { paint(c) };
            }
        }
    }
    let house = Oblong { centre: yard.at(c.range(-1.2, 1.2), 1.25), half_length: 7.0, half_width: 4.4, ..yard };
    site.house(Form::Gable, &house, c.range(3.5, 6.0), c.range(0.6, 1.0), 1.0, c);
    for _ in 0..c.index(5) {
        silo(site, &yard, c);
    }
    heaps(site, c);
    for _ in 0..4 + c.index(12) {
        let plan = Oblong {
            centre: yard.at(c.range(-1.0, 1.0), c.range(-1.0, 1.0)),
            axis: if c.unit() < 0.5 { yard.axis } else { yard.axis.perp() },
            half_length: c.range(1.2, 4.0),
            half_width: c.range(0.8, 1.4),
        };
        if site.is_free(&plan, 0.2) {
            let low = site.town.relief.height(plan.centre);
            let high = low + c.range(1.0, 3.2);
            site.take(&plan);
            site.town.clutter.push(Clutter { thing: Thing::Container, plan, low: low - 0.3, high, seed: c.bits() });
        }
    }
}

/// A silo: round, of 5 to 14 m, with a shallow cone.
fn silo(site: &mut Site, yard: &Oblong, c: &mut Counter) {
    let radius = c.range(1.6, 4.2);
    let centre = yard.at(c.range(-1.0, 1.0), c.range(-1.0, 1.0));
    let plan = Oblong { centre, axis: yard.axis, half_length: radius, half_width: radius };
    let shape = [Primitive::cone(centre, radius, 14, c.range(5.0, 14.0), c.range(0.2, 0.6))];
    if site.is_free(&plan, 0.3) && site.town.add("silo", &shape, false, c) {
        site.take(&plan);
        if let Some(building) = site.town.buildings.last_mut() {
            (building.style.covering, building.style.roof) = (Covering::Metal, [178.0, 182.0, 184.0]);
            building.style.overhang = 0.0;
        }
    }
}
