//! Houses: a roof form on an oblong, as primitives with heights above the ground.

use super::primitive::{Oblong, Primitive, Rise};
use gable_geometry::{Counter, DVec2};

/// Forms of roof.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    Gable,
    Hip,
    HalfHip,
    Mansard,
    Shed,
    Pyramid,
    CrossGable,
    LShape,
    TShape,
    Flat,
    Terraces,
    Courtyard,
    Tower,
    Skew,
}

impl Form {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Gable => "gable",
            Self::Hip => "hip",
            Self::HalfHip => "half-hip",
            Self::Mansard => "mansard",
            Self::Shed => "shed",
            Self::Pyramid => "pyramid",
            Self::CrossGable => "cross-gable",
            Self::LShape => "l-shape",
            Self::TShape => "t-shape",
            Self::Flat => "flat",
            Self::Terraces => "terraces",
            Self::Courtyard => "courtyard",
            Self::Tower => "tower",
            Self::Skew => "skew",
        }
    }
}

/// A part of an oblong: from `s0` to `s1` half lengths and `t0` to `t1` half widths.
pub(crate) fn part(plan: &Oblong, s0: f64, s1: f64, t0: f64, t1: f64) -> Oblong {
    Oblong {
        centre: plan.at(f64::midpoint(s0, s1), f64::midpoint(t0, t1)),
        axis: plan.axis,
        half_length: plan.half_length * (s1 - s0) / 2.0,
        half_width: plan.half_width * (t1 - t0) / 2.0,
    }
}

/// The same rectangle with its axis along the other side.
pub(crate) fn turned(plan: &Oblong) -> Oblong {
    Oblong { axis: plan.axis.perp(), half_length: plan.half_width, half_width: plan.half_length, ..*plan }
}

/// Primitives of a form on a plan.
pub(crate) fn primitives(form: Form, plan: &Oblong, eave: f64, slope: f64, c: &mut Counter) -> Vec<Primitive> {
    match form {
        Form::Gable => vec![Primitive::gable(plan, eave, slope)],
        Form::Hip => vec![Primitive::hip(plan, eave, slope, eave, slope * c.range(1.0, 1.35))],
        Form::HalfHip => {
            let lift = slope * plan.half_width * c.range(0.45, 0.6);
            vec![Primitive::hip(plan, eave, slope, eave + lift, slope * 1.3)]
        }
        Form::Mansard => vec![Primitive::mansard(plan, eave, 2.1, c.range(2.2, 3.0), 0.4)],
        Form::Shed => vec![Primitive::shed(plan, eave, slope.min(0.35))],
        Form::Pyramid => {
            let half = plan.half_width.min(plan.half_length);
            let square = Oblong { half_length: half, half_width: half, ..*plan };
            vec![Primitive::hip(&square, eave, slope, eave, slope)]
        }
        Form::CrossGable => {
            let half = (plan.half_width * 0.75).min(plan.half_length * 0.45) / plan.half_length;
            let at = c.range(-0.3, 0.3);
            let out = 1.0 + c.range(0.8, 2.0) / plan.half_width;
            let wing = turned(&part(plan, at - half, at + half, -out, 0.0));
            vec![Primitive::gable(plan, eave, slope), Primitive::gable(&wing, eave, slope)]
        }
        Form::LShape => corner(plan, eave, slope, c),
        Form::TShape => {
            let bar = part(plan, -1.0, 1.0, 0.1, 1.0);
            let half = (bar.half_width * c.range(0.75, 0.95) / plan.half_length).min(0.5);
            let stem = turned(&part(plan, -half, half, -1.0, 0.55));
            vec![Primitive::hip(&bar, eave, slope, eave, slope), Primitive::gable(&stem, eave, slope)]
        }
        Form::Flat => vec![Primitive::flat(plan.ring(), eave)],
        Form::Terraces => {
            let storey = c.range(2.9, 3.4);
            let (s1, t1) = (c.range(0.45, 0.65), c.range(-0.45, -0.2));
            vec![
                Primitive::flat(plan.ring(), eave),
                Primitive::flat(part(plan, -1.0, s1, t1, 1.0).ring(), eave + storey),
                Primitive::flat(part(plan, -1.0, s1 - 0.5, t1 + 0.5, 1.0).ring(), eave + 2.0 * storey),
            ]
        }
        Form::Courtyard => courtyard(plan, eave, slope, c),
        Form::Tower => {
            let radius = plan.half_width * c.range(0.5, 0.6);
            let at = plan.at(0.93, -0.9);
            vec![
                Primitive::hip(plan, eave, slope, eave, slope),
                Primitive::cone(at, radius.min(3.5), 16, eave + c.range(2.0, 3.5), 1.3),
            ]
        }
        Form::Skew => {
            let lean = plan.axis * (plan.half_width * c.range(0.3, 0.7));
            let mut ring = plan.ring();
            ring[2] += lean + plan.axis.perp() * c.range(0.5, 1.5);
            ring[3] += lean;
            let rises = [Rise { edge: 0, eave, slope }, Rise { edge: 2, eave, slope }];
            vec![Primitive::rising(ring, &rises)]
        }
    }
}

/// Two gabled wings in an L, with a valley between them.
fn corner(plan: &Oblong, eave: f64, slope: f64, c: &mut Counter) -> Vec<Primitive> {
    let depth = c.range(0.8, 1.05);
    let bar = part(plan, -1.0, 1.0, 1.0 - depth, 1.0);
    let width = (bar.half_width * 2.0 * c.range(0.8, 0.97) / plan.half_length).min(0.95);
    let stem = turned(&part(plan, -1.0, -1.0 + width, -1.0, 1.0 - depth / 2.0));
    vec![Primitive::gable(&bar, eave, slope), Primitive::gable(&stem, eave, slope)]
}

/// Four hipped wings around a yard.
fn courtyard(plan: &Oblong, eave: f64, slope: f64, c: &mut Counter) -> Vec<Primitive> {
    let wing = (plan.half_width.min(plan.half_length) * c.range(0.42, 0.52)).min(12.0);
    let (s, t) = (wing / plan.half_length, wing / plan.half_width);
    let sides = [
        part(plan, -1.0, 1.0, -1.0, -1.0 + t),
        part(plan, -1.0, 1.0, 1.0 - t, 1.0),
        turned(&part(plan, -1.0, -1.0 + s, -1.0, 1.0)),
        turned(&part(plan, 1.0 - s, 1.0, -1.0, 1.0)),
    ];
    sides.iter().map(|w| Primitive::hip(w, eave, slope, eave, slope)).collect()
}

/// A convex plan with an axis for a row of houses: corners of unit `i` of `n`.
pub(crate) fn row_units(plan: &Oblong, n: usize, c: &mut Counter) -> Vec<Oblong> {
    let mut cuts: Vec<f64> = (0..=n).map(|i| 2.0 * i as f64 / n as f64 - 1.0).collect();
    for cut in &mut cuts[1..n] {
        *cut += c.range(-0.15, 0.15) / n as f64;
    }
    cuts.windows(2).map(|w| part(plan, w[0], w[1], -1.0, 1.0)).collect()
}

/// A direction from an angle in degrees.
pub(crate) fn axis(degrees: f64) -> DVec2 {
    DVec2::from_angle(degrees.to_radians())
}
