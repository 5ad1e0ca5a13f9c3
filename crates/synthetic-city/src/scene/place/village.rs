//! A village: houses, sheds and walls along winding lanes, on hillsides too.

use crate::scene::house::Form;
use crate::scene::objects::{Cover, Thing};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};

const FORMS: [Form; 9] = [
    Form::Gable,
    Form::Gable,
    Form::Hip,
    Form::HalfHip,
    Form::LShape,
    Form::TShape,
    Form::Flat,
    Form::Shed,
    Form::CrossGable,
];

/// Fills a site.
pub(super) fn fill(site: &mut Site, c: &mut Counter) {
    super::whole(site, Cover::Grass);
    let lanes = lanes(site, c);
    let dense = c.range(0.4, 1.0);
    for lane in &lanes {
        let mut s = -lane.half_length + c.range(0.0, 8.0);
        while s < lane.half_length {
            for side in [-1.0, 1.0] {
                if c.unit() < dense {
                    homestead(site, lane, s + c.range(-2.0, 2.0), side, c);
                }
            }
            s += c.range(11.0, 22.0);
        }
    }
    for _ in 0..(site.area() / 160.0 * c.range(0.2, 1.0)) as usize {
        let place = site.anywhere(c);
        if !site.is_reserved(place) && !lanes.iter().any(|l| l.contains(place)) {
            site.town.tree(place, c);
        }
    }
    for _ in 0..(site.area() / 2_500.0) as usize {
        let place = site.anywhere(c);
        if !site.is_reserved(place) {
            site.town.grove(place, 3 + c.index(9), c);
        }
    }
}

/// A lane in bends through the site, and some that leave it.
fn lanes(site: &mut Site, c: &mut Counter) -> Vec<Oblong> {
    let whole = site.strip(c.range(-0.2, 0.2), c.range(1.8, 3.2), c);
    let mut lanes = Vec::new();
    let pieces = 3 + c.index(4);
    let mut from = whole.at(-1.0, 0.0);
    let mut bends = Vec::new();
    for k in 1..=pieces {
        let to = whole.at(2.0 * k as f64 / pieces as f64 - 1.0, c.range(-5.0, 5.0));
        bends.push(piece(from, to, whole.half_width));
        from = to;
    }
    for bend in &bends {
        if c.unit() < 0.7 {
            let turn = if c.unit() < 0.5 { 1.0 } else { -1.0 } * c.range(1.1, 1.9);
            let out = DVec2::from_angle(turn).rotate(bend.axis);
            lanes.push(piece(bend.centre, bend.centre + out * c.range(30.0, 90.0), c.range(1.4, 2.4)));
        }
    }
    lanes.extend(bends);
    let cover = [Cover::Asphalt, Cover::Asphalt, Cover::Soil, Cover::Concrete][c.index(4)];
    for lane in &lanes {
        site.town.patch(cover, *lane);
        site.take(lane);
    }
    lanes
}

fn piece(from: DVec2, to: DVec2, half_width: f64) -> Oblong {
    let axis = (to - from).normalize_or(DVec2::X);
    Oblong { centre: from.midpoint(to), axis, half_length: from.distance(to) / 2.0 + 1.0, half_width }
}

/// A house beside a lane with its yard, a shed, borders and a car.
fn homestead(site: &mut Site, lane: &Oblong, s: f64, side: f64, c: &mut Counter) {
    let form = FORMS[c.index(FORMS.len())];
    let (half_length, half_width) = (c.range(4.0, 9.0), c.range(3.4, 5.8));
    let off = lane.half_width + half_width + c.range(1.0, 9.0);
    let place = lane.at(s / lane.half_length, side * off / lane.half_width);
    let axis = DVec2::from_angle(c.range(-0.25, 0.25)).rotate(lane.axis);
    let plan = Oblong { centre: place, axis, half_length, half_width };
    let yard =
        Oblong { half_length: half_length + c.range(2.0, 6.0), half_width: half_width + c.range(2.0, 6.0), ..plan };
    if !site.house(form, &plan, c.range(2.6, 7.5), c.range(0.35, 1.0), 1.2, c) {
        return;
    }
    let cover = [Cover::Grass, Cover::Soil, Cover::Yard, Cover::Concrete][c.index(4)];
    site.town.patch(cover, yard);
    if c.unit() < 0.7 {
        let shed = Oblong {
            centre: yard.at(c.range(-1.1, 1.1), side * c.range(1.1, 1.6)),
            axis,
            half_length: c.range(1.6, 4.5),
            half_width: c.range(1.3, 2.6),
        };
        let form = [Form::Shed, Form::Flat, Form::Gable][c.index(3)];
        site.house(form, &shed, c.range(2.1, 3.2), c.range(0.15, 0.5), 0.4, c);
    }
    let ring = yard.ring();
    for k in 0..4 {
        if c.unit() < 0.55 {
            let thing = if c.unit() < 0.5 { Thing::Hedge } else { Thing::Wall };
            site.town.fence(ring[k], ring[(k + 1) % 4], thing, c.range(0.8, 2.4), c);
        }
    }
    if c.unit() < 0.5 {
        let at = yard.at(0.9, -side * 0.9);
        site.town.cars(at, at + axis * 6.0, 5.9, 1.0, false, c);
    }
}
