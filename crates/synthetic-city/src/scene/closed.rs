//! Closed blocks: houses wall to wall around a yard.

use super::builder::Builder;
use super::house::Form;
use super::objects::Cover;
use super::plot::{Front, Plot, inset};
use super::primitive::{Oblong, Primitive, Rise, clip};
use super::quarters::cover;
use gable_geometry::{Counter, DVec2, Plane, ring_area};

/// How a closed block looks.
pub(crate) struct Closed {
    depth: f64,
    width: [f64; 2],
    eaves: [f64; 2],
    slope: f64,
    forms: [Form; 4],
    gap: f64,
    wings: f64,
}

impl Closed {
    pub(crate) fn tenements(c: &mut Counter) -> Self {
        let low = c.range(8.0, 14.0);
        let forms = [
            [Form::Gable, Form::Gable, Form::Mansard, Form::Flat],
            [Form::Gable; 4],
            [Form::Mansard, Form::Mansard, Form::Gable, Form::Flat],
            [Form::Flat, Form::Flat, Form::Flat, Form::Gable],
        ];
        Self {
            depth: c.range(9.5, 13.0),
            width: [8.0, 17.0],
            eaves: [low, low + c.range(0.5, 4.0)],
            slope: c.range(0.5, 0.95),
            forms: forms[c.index(4)],
            gap: c.range(0.0, 0.15),
            wings: 0.3,
        }
    }

    pub(crate) fn old(c: &mut Counter) -> Self {
        let low = c.range(4.5, 7.0);
        Self {
            depth: c.range(8.0, 12.0),
            width: [4.2, 9.0],
            eaves: [low, low + 4.0],
            slope: c.range(0.85, 1.2),
            forms: [Form::Gable, Form::Gable, Form::Gable, Form::Mansard],
            gap: 0.08,
            wings: 0.5,
        }
    }
}

/// Houses wall to wall around a yard, up to the corners; wings, sheds, gardens and trees in the yard.
pub(crate) fn closed(town: &mut Builder, plot: &mut Plot, how: &Closed, c: &mut Counter) {
    if c.unit() < 0.2
        && let Some(plan) = plot.inscribed()
        && plan.half_width > 16.0
    {
        let small = c.range(0.8, 0.97);
        let body = Oblong { half_length: plan.half_length * small, half_width: plan.half_width * small, ..plan };
        town.house(Form::Courtyard, &body, c.range(8.0, 14.0), how.slope.min(0.8), c);
        town.grove(plan.centre, 1 + c.index(3), c);
        return;
    }
    let yard = inset(&plot.ring, how.depth);
    let fronts = plot.fronts();
    for (n, front) in fronts.iter().enumerate() {
        town.begin_row();
        let strip = clip(&plot.ring, |p| how.depth - front.depth(p));
        let strip = fronts[..n].iter().fold(strip, |ring, other| clip(&ring, |p| other.depth(p) - how.depth));
        let span = |f: fn(f64, f64) -> f64, from: f64| strip.iter().map(|p| front.distance_along(*p)).fold(from, f);
        let (mut at, end) = (span(f64::min, f64::INFINITY), span(f64::max, f64::NEG_INFINITY));
        while end - at > 3.0 {
            let mut width = c.range(how.width[0], how.width[1]);
            if end - at - width < how.width[0] {
                width = end - at;
            }
            let (s0, s1) = (at, at + width);
            at += width;
            if c.unit() < how.gap {
                continue;
            }
            let ring = clip(&clip(&strip, |p| front.distance_along(p) - s0), |p| s1 - front.distance_along(p));
            if ring.len() < 3 || ring_area(&ring) < 20.0 || !town.fits(&ring) {
                continue;
            }
            let form = how.forms[c.index(4)];
            let (eave, slope) = (c.range(how.eaves[0], how.eaves[1]), how.slope * c.range(0.9, 1.1));
            let mut shape = vec![between(form, ring, front, [0.0, how.depth], eave, slope)];
            if c.unit() < how.wings && width > 6.0 {
                shape.extend(wing(plot, front, [s0, s1], how.depth, eave, &yard, c));
            }
            if !town.add(form.name(), &shape, form == Form::Flat, c) {
                town.add(form.name(), &shape[..1], form == Form::Flat, c);
            }
        }
    }
    let Some(longest) = plot.longest() else { return };
    court(town, yard, longest.along, c);
}

/// A lower wing from a house into the yard, along one of its party walls.
fn wing(
    plot: &mut Plot,
    front: &Front,
    along: [f64; 2],
    depth: f64,
    eave: f64,
    yard: &[DVec2],
    c: &mut Counter,
) -> Option<Primitive> {
    let (length, width) = (c.range(3.0, 11.0), c.range(4.0, 6.0).min(0.6 * (along[1] - along[0])));
    let (s0, s1) = if c.unit() < 0.5 { (along[0], along[0] + width) } else { (along[1] - width, along[1]) };
    let outside = front.rectangle(s0, s1, depth + 0.01, depth + length);
    let open = Plot::new(yard.to_vec());
    if !outside.ring().iter().all(|p| open.holds(*p, -0.02)) || !plot.is_free(&outside.ring(), 0.0, 2.5) {
        return None;
    }
    plot.take(outside.ring());
    let body = front.rectangle(s0, s1, 0.6 * depth, depth + length);
    let low = (eave - c.range(0.0, 3.5)).max(3.0);
    Some(if c.unit() < 0.5 {
        Primitive::flat(body.ring(), low)
    } else {
        let rises = [Rise { edge: if s0 == along[0] { 1 } else { 3 }, eave: low, slope: 0.35 }];
        Primitive::rising(body.ring(), &rises)
    })
}

/// The inside of a closed block.
fn court(town: &mut Builder, yard: Vec<DVec2>, axis: DVec2, c: &mut Counter) {
    if yard.len() < 3 || ring_area(&yard) < 150.0 {
        return;
    }
    let green = c.unit() < 0.55;
    town.area(if green { Cover::Grass } else { Cover::Yard }, &yard, axis);
    let mut plot = Plot::new(yard);
    let area = plot.area();
    let Some(front) = plot.longest() else { return };
    let deep = plot.ring.iter().map(|p| front.depth(*p)).fold(0.0, f64::max);
    for _ in 0..(area / 90.0) as usize {
        let (s, t) = (c.range(0.0, front.length), c.range(0.0, deep));
        let (length, width) = (c.range(2.5, 9.0), c.range(2.2, 5.0));
        let low = front.rectangle(s, s + length, t, t + width);
        let draw = c.unit();
        if !plot.is_free(&low.ring(), 0.7, 2.0) {
            continue;
        }
        if draw < 0.3 {
            if town.house([Form::Flat, Form::Shed, Form::Gable][c.index(3)], &low, c.range(2.3, 4.2), 0.4, c) {
                plot.take(low.ring());
            }
        } else if draw < 0.6 {
            town.grove(low.centre, 1 + c.index(4), c);
        } else if draw < 0.75 {
            cover(town, &plot, if green { Cover::Yard } else { Cover::Grass }, &low);
        } else if !green {
            town.cars(low.centre, low.at(2.5, 0.0), 2.6, 0.8, true, c);
        }
    }
    let mut s = c.range(5.0, 12.0);
    while s < front.length - 3.0 {
        if c.unit() < 0.7 && plot.holds(front.at(s, 0.5), 0.3) {
            let reach = (4..deep as i32).take_while(|t| plot.holds(front.at(s, f64::from(*t)), 0.4)).last();
            if let Some(reach) = reach {
                town.border(front.at(s, 0.3), front.at(s, f64::from(reach) * c.range(0.5, 1.0)), c);
            }
        }
        s += c.range(7.0, 14.0);
    }
}

/// A roof between party walls: planes rise from the front and from the back only.
pub(crate) fn between(form: Form, ring: Vec<DVec2>, front: &Front, deep: [f64; 2], eave: f64, slope: f64) -> Primitive {
    let n = front.inward();
    let rising = |from: f64, side: f64, height: f64, slope: f64| {
        let g = n * (side * slope);
        Plane { a: g.x, b: g.y, c: height - g.dot(front.at(0.0, from)) }
    };
    let [near, far] = deep;
    let planes = match form {
        Form::Flat => vec![Plane::horizontal(eave)],
        Form::Shed => vec![rising(near, 1.0, eave, slope.min(0.3))],
        Form::Mansard => {
            let (steep, shallow, rise) = (2.1, 0.4, 2.5);
            let knee = eave + rise - shallow * rise / steep;
            vec![
                rising(near, 1.0, eave, steep),
                rising(far, -1.0, eave, steep),
                rising(near, 1.0, knee, shallow),
                rising(far, -1.0, knee, shallow),
            ]
        }
        _ => vec![rising(near, 1.0, eave, slope), rising(far, -1.0, eave, slope)],
    };
    Primitive { ring, planes }
}
