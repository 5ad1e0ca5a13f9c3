//! Blocks of gardens: rows, pairs and single houses along the streets, with what lies behind them.

use super::builder::Builder;
use super::closed::between;
use super::house::{Form, part, turned};
use super::objects::Cover;
use super::plot::{Front, Plot};
use super::primitive::{Oblong, Primitive};
use super::quarters::cover;
use gable_geometry::{Counter, DVec2, dvec2};

const DETACHED: [Form; 12] = [
    Form::Gable,
    Form::Hip,
    Form::HalfHip,
    Form::Mansard,
    Form::Shed,
    Form::Pyramid,
    Form::CrossGable,
    Form::LShape,
    Form::TShape,
    Form::Flat,
    Form::Skew,
    Form::Gable,
];

/// Rows, pairs and single houses along the sides, each with a garden behind.
pub(crate) fn gardens(town: &mut Builder, plot: &mut Plot, c: &mut Counter) {
    let terraces = c.unit() < 0.55;
    for front in plot.fronts() {
        let behind = plot.ring.iter().map(|p| front.depth(*p)).fold(0.0, f64::max);
        let depth = (behind / 2.0).min(26.0);
        if front.length < 16.0 || depth < 13.0 {
            continue;
        }
        let setback = c.range(2.0, 6.0);
        if terraces && c.unit() < 0.85 {
            terrace(town, plot, &front, setback, depth, c);
        } else {
            villas(town, plot, &front, setback, depth, c);
        }
    }
    // What is left in the middle is thickets and lawn.
    for _ in 0..c.index(3) {
        let at = plot.middle() + dvec2(c.range(-8.0, 8.0), c.range(-8.0, 8.0));
        town.grove(at, 3 + c.index(6), c);
    }
}

/// Single houses and pairs on parcels of their own.
fn villas(town: &mut Builder, plot: &mut Plot, front: &Front, setback: f64, depth: f64, c: &mut Counter) {
    let mut at = c.range(1.0, 4.0);
    while at + 12.0 < front.length {
        let width = c.range(13.0, 21.0).min(front.length - at);
        let form = DETACHED[c.index(DETACHED.len())];
        let wide = matches!(form, Form::LShape | Form::TShape);
        let (length, breadth) =
            if wide { (c.range(6.0, 8.0), c.range(5.6, 7.4)) } else { (c.range(4.6, 7.5), c.range(3.8, 5.6)) };
        let lean = DVec2::from_angle(c.range(-0.05, 0.05));
        let half_width = breadth.min((depth - setback) / 2.0 - 1.0);
        let house = Oblong {
            centre: front.at(at + width / 2.0 + c.range(-1.0, 1.0), setback + half_width + c.range(0.0, 2.5)),
            axis: lean.rotate(front.along),
            half_length: length.min(width / 2.0 - 1.4),
            half_width,
        };
        let house = if c.unit() < 0.3 && !wide { turned(&house) } else { house };
        if plot.is_free(&house.ring(), 0.5, 2.0) && town.house(form, &house, c.range(3.0, 6.6), c.range(0.5, 1.0), c) {
            plot.take(house.ring());
            if c.unit() < 0.4 {
                garage(town, plot, front, at, setback, c);
            }
        }
        garden(town, plot, front, [at, at + width], [setback + 2.0 * half_width, depth], c);
        if c.unit() < 0.6 {
            town.border(front.at(at + 0.6, 0.6), front.at(at + width - 3.6, 0.6), c);
        }
        at += width;
    }
}

/// A garage beside the house, with the way to it.
fn garage(town: &mut Builder, plot: &mut Plot, front: &Front, at: f64, setback: f64, c: &mut Counter) {
    let plan = front.rectangle(at + 0.4, at + 3.6, setback, setback + 6.2);
    cover(town, plot, Cover::Yard, &front.rectangle(at + 0.4, at + 3.6, 0.0, setback));
    if plot.is_free(&plan.ring(), 0.3, 0.6) && town.house(Form::Flat, &plan, c.range(2.5, 2.9), 0.0, c) {
        plot.take(plan.ring());
    }
}

/// What lies behind a house between two places along the street: trees, a shed, a terrace, borders.
fn garden(town: &mut Builder, plot: &mut Plot, front: &Front, along: [f64; 2], deep: [f64; 2], c: &mut Counter) {
    let ([s0, s1], [t0, t1]) = (along, deep);
    if t1 - t0 < 3.0 {
        return;
    }
    if c.unit() < 0.6 {
        cover(town, plot, Cover::Yard, &front.rectangle(s0 + 0.8, s1 - 0.8, t0, t0 + c.range(2.0, 3.5)));
    }
    if c.unit() < 0.12 {
        cover(town, plot, Cover::Soil, &front.rectangle(s0 + 0.8, s1 - 0.8, t1 - 3.5, t1 - 0.8));
    }
    if c.unit() < 0.45 {
        let (length, width) = (c.range(2.2, 4.0), c.range(2.0, 3.0));
        let begin = if c.unit() < 0.5 { s0 + 0.7 } else { s1 - 0.7 - length };
        let shed = front.rectangle(begin, begin + length, t1 - 0.8 - width, t1 - 0.8);
        let form = [Form::Flat, Form::Shed, Form::Gable][c.index(3)];
        if plot.is_free(&shed.ring(), 0.5, 1.0) && town.house(form, &shed, c.range(2.1, 2.6), 0.3, c) {
            plot.take(shed.ring());
        }
    }
    for _ in 0..((s1 - s0) * (t1 - t0) * c.range(0.0, 0.025)).ceil() as usize {
        let place = front.at(c.range(s0 + 0.8, s1 - 0.8), c.range(t0 + 1.5, t1));
        if plot.holds(place, 0.5) {
            town.tree(place, c);
        }
    }
    // Borders end before the gardens of the other side begin.
    let end = (0..10).map(|k| t1 - f64::from(k)).find(|t| plot.holds(front.at(s1, *t), 0.5));
    if let Some(end) = end.filter(|end| end - t0 > 2.0) {
        town.border(front.at(s1, t0), front.at(s1, end), c);
        if c.unit() < 0.5 {
            town.border(front.at(s0, end), front.at(s1, end), c);
        }
    }
}

/// A row of houses with party walls, straight or in steps, with some wings behind.
fn terrace(town: &mut Builder, plot: &mut Plot, front: &Front, setback: f64, depth: f64, c: &mut Counter) {
    town.begin_row();
    let deep = c.range(8.0, 11.0).min(depth - setback - 3.0);
    let (eave, slope) = (c.range(4.6, 8.0), c.range(0.5, 1.0));
    let main = match c.unit() {
        d if d < 0.16 => Form::Flat,
        d if d < 0.24 => Form::Mansard,
        _ => Form::Gable,
    };
    let (mut at, end) = (c.range(1.5, 5.0), front.length - c.range(1.5, 5.0));
    let unit_width = c.range(5.0, 7.6);
    let (mut shift, mut row) = (0.0, Vec::new());
    let stepped = c.unit() < 0.3;
    while at + unit_width <= end {
        // A passage now and then; rows are never longer than ten or so.
        if row.len() > 3 && c.unit() < 0.12 {
            row.drain(..).for_each(|ring| plot.take(ring));
            at += c.range(2.0, 5.0);
            continue;
        }
        if stepped && c.unit() < 0.35 {
            shift = c.range(-1.5, 1.5);
        }
        let width = unit_width * if c.unit() < 0.15 { c.range(1.0, 1.4) } else { 1.0 };
        let (near, far) = ((setback + shift).max(0.3), (setback + shift).max(0.3) + deep);
        let plan = front.rectangle(at, at + width, near, far);
        let lift = if c.unit() < 0.25 { c.range(-1.2, 1.2) } else { 0.0 };
        let form = if c.unit() < 0.08 { Form::CrossGable } else { main };
        let free = town.fits(&plan.ring()) && plot.is_free(&plan.ring(), 0.2, 2.0);
        if free && unit(town, form, &plan, front, eave + lift, slope, [near, far], c) {
            row.push(plan.ring());
            garden(town, plot, front, [at, at + width], [far, depth], c);
        }
        at += width;
    }
    row.into_iter().for_each(|ring| plot.take(ring));
    if c.unit() < 0.4 {
        town.border(front.at(1.0, 0.5), front.at(front.length - 1.0, 0.5), c);
    }
}

/// A house between party walls; one in five has a lower wing behind.
fn unit(
    town: &mut Builder,
    form: Form,
    plan: &Oblong,
    front: &Front,
    eave: f64,
    slope: f64,
    deep: [f64; 2],
    c: &mut Counter,
) -> bool {
    let mut shape = vec![between(form, plan.ring(), front, deep, eave, slope)];
    if c.unit() < 0.2 && plan.half_length > 2.6 {
        let reach = c.range(2.0, 4.5) / plan.half_width;
        let share = c.range(-0.2, 0.4);
        let wing = part(plan, -1.0, share, 0.3, 1.0 + reach);
        let low = (eave - c.range(0.4, 2.8)).max(2.6);
        shape.push(Primitive::flat(wing.ring(), low));
    }
    town.add(form.name(), &shape, form == Form::Flat, c)
}
