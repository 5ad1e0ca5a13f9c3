//! What stands between given buildings: cars and trees along the streets, gardens with trees and borders, groves, water.

use super::Scene;
use super::builder::Builder;
use super::building::Rim;
use super::cover_map::{Ground, Kind};
use super::layout::nothing_in_water;
use super::objects::Cover;
use super::primitive::Oblong;
use crate::noise::noise2;
use gable_geometry::{Box2, Counter, DVec2, dvec2};

/// Distance of parked cars from walls, metres.
const KERB: f64 = 2.9;

/// Fills the space between the buildings; the map of covers must be there.
pub(crate) fn surroundings(builder: &mut Builder) {
    let probe = builder.probe();
    let Some(covers) = builder.covers.take() else { return };
    let ground = |p: DVec2| covers.ground(p);
    let mut c = Counter::keyed(builder.seed, &[21]);
    for building in &probe.buildings {
        for rim in &building.rims {
            let length = rim.from.distance(rim.to);
            let outward = -(rim.to - rim.from).normalize_or(DVec2::X).perp();
            let Some(here) = ground(rim.from.midpoint(rim.to) + outward * 1.5) else { continue };
            match here.kind {
                Kind::Street if length > 4.0 => along_facade(builder, rim, outward, &ground, &mut c),
                Kind::Garden if length > 3.2 && here.distance > 0.9 => {
                    behind_house(builder, rim, outward, &ground, &mut c);
                }
                _ => {}
            }
        }
    }
    let extent = builder.extent;
    let open = |p: DVec2, clear: f64| {
        extent.contains(p) && ground(p).is_none_or(|g| g.kind == Kind::Open && g.distance > clear)
    };
    avenues(builder, &probe, &open, &mut c);
    car_parks(builder, &probe, &open, &mut c);
    for _ in 0..(extent.size().x * extent.size().y / 260.0) as usize {
        let p = extent.min + extent.size() * dvec2(c.unit(), c.unit());
        let kind = c.unit();
        match ground(p) {
            Some(g) if g.distance < 1.0 || g.kind == Kind::Street => {}
            Some(g) if g.kind == Kind::Garden => builder.tree(p, &mut c),
            _ if builder.is_paved(p) => {}
            _ if kind < 0.3 => builder.grove(p, 2 + c.index(9), &mut c),
            _ if kind < 0.5 => builder.tree(p, &mut c),
            _ => {}
        }
    }
    ponds(builder, &probe);
    let free = |p: DVec2| {
        let around = [dvec2(0.5, 0.0), dvec2(-0.5, 0.0), dvec2(0.0, 0.5), dvec2(0.0, -0.5)];
        around.iter().all(|d| probe.building_at(p + *d).is_none())
    };
    let inside = extent.grown(-1.0);
    builder.trees.retain(|t| inside.contains(t.place) && free(t.place));
    builder.clutter.retain(|t| t.thing.on_building() || (inside.contains(t.plan.centre) && free(t.plan.centre)));
    builder.covers = Some(covers);
    builder.buildings = probe.buildings;
    nothing_in_water(builder);
}

type Known<'a> = dyn Fn(DVec2) -> Option<Ground> + 'a;

/// Cars at the kerb in most streets, trees in some of them.
fn along_facade(builder: &mut Builder, rim: &Rim, outward: DVec2, ground: &Known<'_>, c: &mut Counter) {
    let (from, to) = (rim.from + outward * KERB, rim.to + outward * KERB);
    let middle = from.midpoint(to);
    let at_kerb = |p: DVec2| ground(p).is_some_and(|g| g.kind == Kind::Street && (g.distance - KERB).abs() < 0.7);
    if !at_kerb(middle) {
        return;
    }
    let full = 0.45 + 0.5 * noise2(builder.seed ^ 0xca5, 70.0, middle.x, middle.y);
    let first = builder.clutter.len();
    builder.cars(from, to, 5.9, full, false, c);
    let kept: Vec<_> = builder.clutter.drain(first..).filter(|t| at_kerb(t.plan.centre)).collect();
    builder.clutter.extend(kept);
    // Trees stand between the cars: a street has them or not.
    if noise2(builder.seed ^ 0x7ee, 110.0, middle.x, middle.y) > 0.08 {
        let wide = ground(middle + outward * 4.0).is_some_and(|g| g.distance > 5.5);
        if wide && c.unit() < 0.75 * (from.distance(to) / 9.0).min(1.0) {
            builder.tree_row(from - outward * 0.5, to - outward * 0.5, c.range(7.0, 11.0), c);
        }
    }
}

/// Borders between the gardens, and what grows there.
fn behind_house(builder: &mut Builder, rim: &Rim, outward: DVec2, ground: &Known<'_>, c: &mut Counter) {
    // Up to where the next house is nearer.
    let reach = |from: DVec2| {
        let mut last = 0.0;
        for step in 1..16 {
            let t = f64::from(step);
            match ground(from + outward * t) {
                Some(g) if g.kind == Kind::Garden && g.distance > last + 0.3 => last = g.distance,
                _ => return t - 1.0,
            }
        }
        15.0
    };
    let begin = rim.to + outward * 0.4;
    let end = reach(begin);
    if end > 2.0 && c.unit() < 0.75 {
        builder.border(begin, begin + outward * end, c);
        if c.unit() < 0.5 {
            let other = reach(rim.from + outward * 0.4);
            builder.border(begin + outward * end, rim.from + outward * (0.4 + other), c);
        }
    }
    let length = rim.from.distance(rim.to);
    for _ in 0..(length * end * c.range(0.0, 0.03)).round() as usize {
        let at = rim.from.lerp(rim.to, c.unit()) + outward * c.range(1.2, end.max(1.3));
        builder.tree(at, c);
    }
}

/// The direction of a building near a place.
fn direction(probe: &Scene, p: DVec2, reach: f64) -> Option<DVec2> {
    let near = probe.buildings_in(&Box2 { min: p, max: p }.grown(reach));
    let rim = probe.buildings[*near.first()?].rims.first()?;
    (rim.to - rim.from).try_normalize()
}

/// Straight roads through open land, parallel to buildings, with trees and cars: one try for each 15,000 m².
fn avenues(builder: &mut Builder, probe: &Scene, open: &dyn Fn(DVec2, f64) -> bool, c: &mut Counter) {
    let extent = builder.extent;
    for _ in 0..(extent.size().x * extent.size().y / 15_000.0) as usize {
        let begin = extent.min + extent.size() * dvec2(c.unit(), c.unit());
        let Some(axis) = direction(probe, begin, 60.0) else { continue };
        let axis = if c.unit() < 0.5 { axis.perp() } else { axis };
        let reach =
            |axis: DVec2| (0..40).map(|k| f64::from(k) * 6.0).take_while(|t| open(begin + axis * *t, 6.0)).last();
        let (Some(ahead), Some(back)) = (reach(axis), reach(-axis)) else { continue };
        if ahead + back < 48.0 {
            continue;
        }
        let (from, to) = (begin - axis * (back + 4.0), begin + axis * (ahead + 4.0));
        let plan = Oblong {
            centre: from.midpoint(to),
            axis,
            half_length: from.distance(to) / 2.0,
            half_width: c.range(3.0, 4.0),
        };
        builder.patch(Cover::Pavement, Oblong { half_width: plan.half_width + 1.7, ..plan });
        builder.patch(Cover::Asphalt, plan);
        for side in [-1.0, 1.0] {
            let edge = |t: f64| axis.perp() * (side * (plan.half_width + t));
            if c.unit() < 0.7 {
                builder.tree_row(from + edge(2.6), to + edge(2.6), c.range(6.5, 12.0), c);
            }
            builder.cars(from + edge(-1.1), to + edge(-1.1), 6.4, c.range(0.1, 0.6), false, c);
        }
    }
}

/// Car parks beside large buildings: one try for each 6,000 m².
fn car_parks(builder: &mut Builder, probe: &Scene, open: &dyn Fn(DVec2, f64) -> bool, c: &mut Counter) {
    let extent = builder.extent;
    for _ in 0..(extent.size().x * extent.size().y / 6_000.0) as usize {
        let centre = extent.min + extent.size() * dvec2(c.unit(), c.unit());
        let Some(axis) = direction(probe, centre, 30.0) else { continue };
        let plan = Oblong { centre, axis, half_length: c.range(12.0, 30.0), half_width: c.range(8.0, 16.0) };
        let lattice = (-4..=4).flat_map(|i| (-4..=4).map(move |j| (f64::from(i) * 0.25, f64::from(j) * 0.25)));
        if !lattice.clone().all(|(s, t)| open(plan.at(s, t), 3.0) && !builder.is_paved(plan.at(s, t))) {
            continue;
        }
        builder.patch(Cover::Parking, plan);
        let share = c.range(0.2, 0.9);
        for t in [-0.75, 0.75] {
            builder.cars(plan.at(-0.95, t), plan.at(0.95, t), 2.7, share, true, c);
        }
        for t in [-1.0, 1.0] {
            if c.unit() < 0.5 {
                builder.tree_row(plan.at(-1.0, 1.15 * t), plan.at(1.0, 1.15 * t), c.range(6.0, 10.0), c);
            } else {
                builder.border(plan.at(-1.0, 1.08 * t), plan.at(1.0, 1.08 * t), c);
            }
        }
    }
}

/// Ponds and straight pieces of water where nothing is built: one try for each 5,000 m².
fn ponds(builder: &mut Builder, probe: &Scene) {
    let mut c = Counter::keyed(builder.seed, &[22]);
    let extent = builder.extent;
    for _ in 0..(extent.size().x * extent.size().y / 5_000.0) as usize {
        let centre = extent.min + extent.size() * dvec2(c.unit(), c.unit());
        // Along the houses, as canals lie.
        let axis = direction(probe, centre, 30.0).unwrap_or_else(|| DVec2::from_angle(c.range(0.0, 3.2)));
        let canal = c.unit() < 0.6;
        let (length, width) =
            if canal { (c.range(14.0, 20.0), c.range(3.0, 4.5)) } else { (c.range(5.0, 14.0), c.range(4.0, 8.0)) };
        let plan = Oblong { centre, axis, half_length: length, half_width: width };
        let lattice = || (-5..=5).flat_map(|i| (-4..=4).map(move |j| (f64::from(i) * 0.22, f64::from(j) * 0.3)));
        let free = |p: DVec2| {
            extent.contains(p) && probe.buildings_in(&Box2 { min: p, max: p }).is_empty() && !builder.is_paved(p)
        };
        if lattice().all(|(s, t)| free(plan.at(s, t))) {
            builder.water(plan);
        }
    }
}
