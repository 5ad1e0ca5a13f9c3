//! How blocks are built on: kinds of quarters, and those with large buildings.

use super::builder::Builder;
use super::closed::{Closed, closed};
use super::gardens::gardens;
use super::house::{Form, part, turned};
use super::objects::Cover;
use super::plot::Plot;
use super::primitive::{Oblong, intersect_convex};
use crate::noise::noise2;
use gable_geometry::{Counter, DVec2};

/// Builds on a convex block. Kinds lie in quarters of some hundred metres, dense ones and green ones.
pub(crate) fn fill(town: &mut Builder, ring: Vec<DVec2>, c: &mut Counter) {
    let mut plot = Plot::new(ring);
    let Some(front) = plot.longest() else { return };
    let middle = plot.middle();
    let dense = c.unit() + 0.3 * noise2(town.seed ^ 0x71, 260.0, middle.x, middle.y);
    let ground = match c.unit() {
        d if d < 0.62 => Cover::Grass,
        d if d < 0.82 => Cover::Pavement,
        _ => Cover::Yard,
    };
    let large = plot.area() > 6_500.0;
    match dense {
        d if d < 0.03 => park(town, &plot, c),
        d if d < 0.4 => {
            town.area(Cover::Grass, &plot.ring.clone(), front.along);
            gardens(town, &mut plot, c);
        }
        d if d < 0.56 && large => slabs(town, &mut plot, c),
        d if d < 0.78 => {
            town.area(ground, &plot.ring.clone(), front.along);
            closed(town, &mut plot, &Closed::tenements(c), c);
        }
        d if d < 0.92 || large => flats(town, &plot, c),
        _ => old_town(town, &mut plot, c),
    }
}

/// Ground cover on the part of a plan that lies in the plot.
pub(crate) fn cover(town: &mut Builder, plot: &Plot, cover: Cover, plan: &Oblong) {
    town.area(cover, &intersect_convex(&plan.ring(), &plot.ring), plan.axis);
}

/// Tall flat slabs in lawn, with groves and a car park.
fn slabs(town: &mut Builder, plot: &mut Plot, c: &mut Counter) {
    let Some(front) = plot.longest() else { return };
    town.area(Cover::Grass, &plot.ring.clone(), front.along);
    town.begin_row();
    let (eave, crosswise) = (c.range(8.0, 24.0), c.unit() < 0.5);
    let deep = plot.ring.iter().map(|p| front.depth(*p)).fold(0.0, f64::max);
    let mut t = c.range(4.0, 8.0);
    while t + 12.0 < deep {
        let (length, width) = (c.range(22.0, 52.0), c.range(10.0, 13.0));
        let mut s = c.range(2.0, 10.0);
        while s + length < front.length + 20.0 {
            let plan = front.rectangle(s, s + length, t, t + width);
            let plan = if crosswise { turned(&plan) } else { plan };
            let form = if c.unit() < 0.8 { Form::Flat } else { Form::Hip };
            if plot.is_free(&plan.ring(), 3.0, 14.0) && town.house(form, &plan, eave + c.range(-3.0, 3.0), 0.4, c) {
                plot.take(plan.ring());
                let path = Oblong { half_width: 1.2, half_length: plan.half_length + 3.0, ..plan };
                cover(
                    town,
                    plot,
                    Cover::Pavement,
                    &Oblong { centre: plan.at(0.0, -1.0 - 3.0 / plan.half_width), ..path },
                );
            }
            s += length + 4.0;
        }
        t += width + c.range(2.0, 5.0);
    }
    for _ in 0..(plot.area() / 420.0) as usize {
        let at = front.at(c.range(0.0, front.length), c.range(0.0, deep));
        if plot.holds(at, 2.0) {
            town.grove(at, 1 + c.index(6), c);
        }
    }
    let bays = front.rectangle(front.length * 0.2, front.length * 0.75, 0.8, 5.8);
    if plot.is_free(&bays.ring(), 0.0, 1.0) {
        cover(town, plot, Cover::Parking, &bays);
        town.cars(bays.at(-1.0, 0.0), bays.at(1.0, 0.0), 2.6, 0.65, true, c);
    }
}

/// Large flat roofs, terraces, halls and a car park.
fn flats(town: &mut Builder, plot: &Plot, c: &mut Counter) {
    let Some(plan) = plot.inscribed() else { return };
    town.area(Cover::Parking, &plot.ring, plan.axis);
    let split = c.range(0.1, 0.45);
    let body = part(&plan, -0.97, split, -0.92, c.range(0.1, 0.5));
    let form = [Form::Flat, Form::Terraces, Form::LShape, Form::Gable][c.index(4)];
    let slope = if form == Form::Gable { 0.25 } else { 0.5 };
    town.house(form, &body, c.range(6.0, 18.0), slope, c);
    let low = part(&plan, split, (split + 0.45).min(0.95), -0.7, 0.05);
    town.house(Form::Flat, &low, c.range(3.5, 6.0), 0.0, c);
    for t in [0.62, 0.92] {
        town.cars(plan.at(-0.9, t), plan.at(0.9, t), 2.7, c.range(0.3, 0.9), true, c);
    }
    town.tree_row(plan.at(-0.9, 0.77), plan.at(0.9, 0.77), c.range(7.0, 13.0), c);
    let beds = Oblong { half_width: 1.0, half_length: plan.half_length * 0.9, ..plan };
    cover(town, plot, Cover::Grass, &Oblong { centre: plan.at(0.0, 0.77), ..beds });
}

/// Narrow houses wall to wall, or a hall with a tower and odd houses about it.
fn old_town(town: &mut Builder, plot: &mut Plot, c: &mut Counter) {
    let Some(plan) = plot.inscribed() else { return };
    town.area(Cover::Yard, &plot.ring.clone(), plan.axis);
    if c.unit() < 0.55 {
        closed(town, plot, &Closed::old(c), c);
        return;
    }
    let hall = part(&plan, -0.55, 0.45, -0.3, 0.45);
    if town.house(Form::Tower, &hall, c.range(7.0, 10.0), c.range(0.8, 1.1), c) {
        plot.take(hall.ring());
    }
    for front in plot.fronts() {
        let mut s = c.range(1.0, 5.0);
        while s + 8.0 < front.length {
            let form = [Form::Skew, Form::HalfHip, Form::CrossGable, Form::LShape, Form::Pyramid][c.index(5)];
            let (length, width) = (c.range(7.5, 10.0), c.range(7.0, 8.6));
            let house = front.rectangle(s, s + length, 0.8, 0.8 + width);
            let house = Oblong { axis: DVec2::from_angle(c.range(-0.12, 0.12)).rotate(house.axis), ..house };
            if c.unit() < 0.7
                && plot.is_free(&house.ring(), 0.0, 3.0)
                && town.house(form, &house, c.range(4.0, 7.0), c.range(0.7, 1.1), c)
            {
                plot.take(house.ring());
            }
            s += length + c.range(1.0, 6.0);
        }
    }
    town.grove(plan.at(c.range(-0.4, 0.4), c.range(0.5, 0.8)), 3 + c.index(5), c);
}

/// Lawn, paths, groves, a pond and a pavilion.
fn park(town: &mut Builder, plot: &Plot, c: &mut Counter) {
    let Some(plan) = plot.inscribed() else { return };
    town.area(Cover::Grass, &plot.ring, plan.axis);
    for (s, t) in [(-0.6, -0.5), (0.55, -0.55), (-0.5, 0.55), (0.0, -0.8), (-0.85, 0.0), (0.9, 0.0)] {
        if c.unit() < 0.8 {
            town.grove(plan.at(s + c.range(-0.1, 0.1), t + c.range(-0.1, 0.1)), 3 + c.index(9), c);
        }
    }
    for angle in [c.range(-0.4, 0.4), c.range(1.2, 1.9)] {
        let axis = DVec2::from_angle(angle).rotate(plan.axis);
        cover(town, plot, Cover::Soil, &Oblong { axis, half_length: plan.half_width * 1.2, half_width: 1.3, ..plan });
    }
    town.water(part(&plan, 0.3, 0.85, 0.25, 0.85));
    let pavilion = Oblong { half_length: 4.0, half_width: 4.0, ..plan };
    town.house(Form::Pyramid, &pavilion, 3.2, 0.6, c);
}
