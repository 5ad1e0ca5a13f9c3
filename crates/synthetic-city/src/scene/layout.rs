//! A procedural town: streets that divide it into blocks, and what stands in them.

use super::Scene;
use super::builder::Builder;
use super::objects::Cover;
use super::plot::widened;
use super::primitive::Oblong;
use super::quarters::fill;
use super::streets::{Street, network};
use crate::bins::Bins;
use gable_geometry::{Box2, Counter, DVec2, dvec2};

/// Share of the trees that stand at walls or under eaves.
const TREES_AT_WALLS: f64 = 0.14;
/// Half the width of a canal's water, metres.
const CANAL: f64 = 4.2;

/// Makes a town of about the given area, km².
pub(crate) fn town(seed: u64, area_km2: f64, slope: f64) -> Scene {
    let side = (area_km2.sqrt() * 1000.0 / 0.4).round() * 0.4;
    let extent = Box2 { min: DVec2::ZERO, max: DVec2::splat(side) };
    let mut town = Builder::new(seed, extent, slope);
    build_town(&mut town);
    town.finish()
}

/// Builds a town on the square of a builder.
pub(crate) fn build_town(town: &mut Builder) {
    let (seed, extent) = (town.seed, town.extent);
    let side = extent.size().x;
    let mut c = Counter::keyed(seed, &[1]);
    let axis = DVec2::from_angle(c.range(0.0, 90.0).to_radians());
    let reach = side / 2.0 * (axis.x.abs() + axis.y.abs()) + 6.0;
    let whole = Oblong { centre: extent.max / 2.0, axis, half_length: reach, half_width: reach };
    let network = network(whole.ring(), &mut c);
    town.patch(Cover::Asphalt, Oblong { half_length: 2.0 * reach, half_width: 2.0 * reach, ..whole });
    for street in &network.streets {
        town.patch(Cover::Asphalt, street.plan);
    }
    for (ring, footway) in &network.blocks {
        town.area(Cover::Pavement, &widened(ring, *footway), axis);
    }
    let boxes: Vec<Box2> = network.streets.iter().map(|s| Box2::of(s.plan.ring())).collect();
    let bins = Bins::new(&boxes);
    for (n, street) in network.streets.iter().enumerate() {
        let others = |p: DVec2| {
            let here = bins.touching(&Box2 { min: p, max: p });
            here.into_iter().any(|k| k != n && network.streets[k].plan.contains(p))
        };
        along_street(town, street, &others, &mut Counter::keyed(seed, &[2, n as i64]));
    }
    for (n, (ring, _)) in network.blocks.into_iter().enumerate() {
        if Box2::of(ring.iter().copied()).intersects(&extent) {
            fill(town, ring, &mut Counter::keyed(seed, &[3, n as i64]));
        }
    }
    trees_at_walls(town);
    let inside = town.extent.grown(-1.0);
    town.trees.retain(|t| inside.contains(t.place));
    town.clutter.retain(|t| inside.contains(t.plan.centre));
    nothing_in_water(town);
}

/// Cars, trees and water of a street; nothing stands where another street meets it.
fn along_street(town: &mut Builder, street: &Street, meets: &dyn Fn(DVec2) -> bool, c: &mut Counter) {
    let plan = street.plan;
    let (trees, clutter) = (town.trees.len(), town.clutter.len());
    let at = |s: f64, t: f64| plan.centre + plan.axis * (s * (plan.half_length - 12.0)) + plan.axis.perp() * t;
    for side in [-1.0, 1.0] {
        let edge = plan.half_width - 1.05;
        if street.canal || plan.half_width > 2.7 {
            town.cars(at(-1.0, side * edge), at(1.0, side * edge), c.range(5.6, 7.0), c.range(0.1, 0.85), false, c);
        }
        if plan.half_width > 4.5 && !street.canal {
            town.cars(at(-1.0, side * 1.6), at(1.0, side * 1.6), 23.0, 0.25, false, c);
        }
        if street.canal {
            let quay = CANAL + 0.9;
            town.tree_row(at(-1.0, side * quay), at(1.0, side * quay), c.range(7.0, 11.0), c);
        } else if c.unit() < if street.footway > 2.0 { 0.7 } else { 0.3 } {
            let edge = plan.half_width + 0.4 * street.footway;
            town.tree_row(at(-1.0, side * edge), at(1.0, side * edge), c.range(6.0, 13.0), c);
        }
    }
    let kept: Vec<_> = town.trees.drain(trees..).filter(|t| !meets(t.place)).collect();
    town.trees.extend(kept);
    let kept: Vec<_> = town.clutter.drain(clutter..).filter(|t| !meets(t.plan.centre)).collect();
    town.clutter.extend(kept);
    if street.canal {
        canal(town, &plan, c);
    }
}

/// Water along the middle of a street. Its level falls from weir to weir; bridges part it now and then.
fn canal(town: &mut Builder, street: &Oblong, c: &mut Counter) {
    let mut s = -street.half_length + 16.0;
    while s + 30.0 < street.half_length - 8.0 {
        let length = c.range(14.0, 22.0);
        let centre = street.centre + street.axis * (s + length / 2.0);
        town.water(Oblong { centre, half_length: length / 2.0, half_width: CANAL, ..*street });
        s += length + if c.unit() < 0.3 { 6.0 } else { 0.0 };
    }
}

/// Takes away what would stand in water.
pub(crate) fn nothing_in_water(town: &mut Builder) {
    let water: Vec<Oblong> = town.patches.iter().filter(|p| p.cover == Cover::Water).map(|p| p.plan).collect();
    let boxes: Vec<Box2> = water.iter().map(|w| Box2::of(w.ring())).collect();
    let bins = Bins::new(&boxes);
    let dry = |p: DVec2| bins.touching(&Box2 { min: p, max: p }).into_iter().all(|n| !water[n].contains(p));
    town.trees.retain(|t| dry(t.place));
    town.clutter.retain(|t| t.thing.on_building() || dry(t.plan.centre));
}

/// Drops trees that stand in buildings and puts some at walls, so that their crowns touch.
fn trees_at_walls(town: &mut Builder) {
    let probe = town.probe();
    let mut c = Counter::keyed(town.seed, &[4]);
    let mut kept = Vec::new();
    for mut tree in std::mem::take(&mut town.trees) {
        if c.unit() < TREES_AT_WALLS && !probe.buildings.is_empty() {
            let near = probe.buildings_in(&Box2 { min: tree.place, max: tree.place }.grown(12.0));
            if !near.is_empty() {
                let rims = &probe.buildings[near[c.index(near.len())]].rims;
                let rim = rims[c.index(rims.len())];
                if let Some(along) = (rim.to - rim.from).try_normalize() {
                    let at = rim.from.lerp(rim.to, c.range(0.15, 0.85));
                    tree.place = at - along.perp() * (tree.radius * c.range(0.45, 0.95)).max(0.7);
                    tree.ground = town.relief.height(tree.place);
                }
            }
        }
        let around = [dvec2(0.6, 0.0), dvec2(-0.6, 0.0), dvec2(0.0, 0.6), dvec2(0.0, -0.6)];
        if around.iter().all(|d| probe.building_at(tree.place + *d).is_none()) {
            kept.push(tree);
        }
    }
    town.trees = kept;
    town.buildings = probe.buildings;
}
