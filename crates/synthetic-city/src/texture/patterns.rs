//! Patterns of materials: albedo in sRGB 0–255 as a function of the place.

use crate::noise::{lattice_unit, noise2, noise3};
use crate::scene::building::{Covering, SceneBuilding};
use crate::scene::objects::{Clutter, Cover, Patch, Species, Thing, Tree};
use gable_geometry::{DVec2, DVec3};

pub(crate) type Rgb = [f32; 3];

pub(crate) fn scale(c: Rgb, gain: f64) -> Rgb {
    c.map(|x| x * gain as f32)
}

pub(crate) fn blend(a: Rgb, b: Rgb, t: f64) -> Rgb {
    let t = t.clamp(0.0, 1.0) as f32;
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

/// Ground: the cover's own colour and markings.
pub(crate) fn ground(seed: u64, cover: Cover, patch: Option<&Patch>, p: DVec2) -> Rgb {
    let wide = noise2(seed ^ 1, 7.0, p.x, p.y);
    let fine = noise2(seed ^ 2, 0.5, p.x, p.y);
    match cover {
        Cover::Asphalt => {
            let base = scale([92.0, 92.0, 95.0], 1.0 + 0.1 * wide + 0.05 * fine);
            if patch.is_some_and(|patch| marked(patch, p)) { [206.0, 206.0, 200.0] } else { base }
        }
        Cover::Parking => {
            let base = scale([104.0, 103.0, 104.0], 1.0 + 0.1 * wide + 0.04 * fine);
            let bay = patch.is_some_and(|patch| {
                let d = p - patch.plan.centre;
                d.dot(patch.plan.axis).rem_euclid(2.7) < 0.14
                    && d.dot(patch.plan.axis.perp()) > patch.plan.half_width * 0.3
            });
            if bay { [196.0, 196.0, 192.0] } else { base }
        }
        Cover::Pavement => {
            let slab = lattice_unit(seed ^ 3, (p.x / 0.6).floor() as i64, (p.y / 0.6).floor() as i64, 0);
            scale([158.0, 153.0, 146.0], 0.95 + 0.09 * slab + 0.06 * wide)
        }
        Cover::Yard => {
            let slab = lattice_unit(seed ^ 4, (p.x / 0.4).floor() as i64, (p.y / 0.4).floor() as i64, 0);
            scale([142.0, 128.0, 114.0], 0.9 + 0.14 * slab + 0.1 * wide)
        }
        Cover::Water => {
            // What it mirrors differs from picture to picture, in patches of metres.
            let mirrored = 0.5 + 0.5 * noise2(seed ^ 6, 9.0, p.x, p.y);
            scale(blend([46.0, 58.0, 50.0], [92.0, 104.0, 106.0], mirrored * mirrored), 1.0 + 0.1 * wide + 0.05 * fine)
        }
        Cover::Soil => scale([150.0, 126.0, 94.0], 1.0 + 0.12 * wide + 0.08 * fine),
        Cover::Grass => {
            let dry = 0.5 + 0.5 * noise2(seed ^ 5, 14.0, p.x, p.y);
            let green = blend([88.0, 112.0, 56.0], [134.0, 132.0, 78.0], dry * dry);
            scale(green, 1.0 + 0.1 * wide + 0.13 * fine)
        }
    }
}

/// A dashed line in the middle of a street.
fn marked(patch: &Patch, p: DVec2) -> bool {
    let d = p - patch.plan.centre;
    let (along, across) = (d.dot(patch.plan.axis), d.dot(patch.plan.axis.perp()));
    across.abs() < 0.09 && along.rem_euclid(6.0) < 3.0 && along.abs() < patch.plan.half_length - 8.0
}

/// Roof coverings, with rows along the eaves.
pub(crate) fn roof(building: &SceneBuilding, face: usize, p: DVec2) -> Rgb {
    let style = &building.style;
    let plane = building.roof.get(face).map_or(DVec2::ZERO, |f| f.plane.normal().truncate());
    let down = plane.try_normalize().unwrap_or(DVec2::X);
    let (s, t) = (p.dot(down.perp()), p.dot(down) / (1.0 - plane.length_squared()).max(0.1).sqrt());
    let seed = building.seed;
    let stain = noise2(seed, 2.8, p.x, p.y);
    let cell = |a: f64, b: f64| lattice_unit(seed, (s / a).floor() as i64, (t / b).floor() as i64, 0);
    // Flat parts of tiled and slated buildings have gravel.
    if plane.length() < 0.1 && matches!(style.covering, Covering::Tiles | Covering::Slate) {
        return scale([150.0, 145.0, 138.0], 0.9 + 0.2 * cell(0.15, 0.15) + 0.1 * stain);
    }
    match style.covering {
        Covering::Tiles => {
            let groove = if t.rem_euclid(0.34) < 0.08 { 0.86 } else { 1.0 };
            scale(style.roof, groove * (0.9 + 0.2 * cell(0.24, 0.34)) * (1.0 + 0.1 * stain))
        }
        Covering::Slate => scale(style.roof, (0.88 + 0.24 * cell(0.3, 0.2)) * (1.0 + 0.08 * stain)),
        Covering::Metal => {
            let seam = if s.rem_euclid(0.6) < 0.08 { 0.8 } else { 1.0 };
            scale(style.roof, seam * (1.0 + 0.06 * stain))
        }
        Covering::Bitumen => {
            let lap = if s.rem_euclid(1.0) < 0.06 { 0.88 } else { 1.0 };
            scale(style.roof, lap * (1.0 + 0.12 * stain))
        }
        Covering::Gravel => scale(style.roof, 0.9 + 0.2 * cell(0.15, 0.15) + 0.1 * stain),
        Covering::Green => {
            let bloom = 0.5 + 0.5 * noise2(seed ^ 9, 1.1, p.x, p.y);
            scale(blend(style.roof, [128.0, 98.0, 70.0], 0.6 * bloom * bloom), 1.0 + 0.12 * stain)
        }
    }
}

/// Facades with windows; `u` runs along the wall, `corner` is the distance to its nearer end.
pub(crate) fn facade(building: &SceneBuilding, u: f64, corner: f64, z: f64, wall: usize) -> Rgb {
    let style = &building.style;
    let height = z - building.base;
    let stain = noise2(building.seed ^ wall as u64, 1.9, u, z);
    let mut colour = scale(style.facade, 1.0 + 0.07 * stain);
    if height < 0.6 {
        colour = scale(colour, 0.72);
    }
    let (bay, row) = ((u / style.bay).floor(), (height / style.storey).floor());
    let (a, b) = (u / style.bay - bay, height - row * style.storey);
    let draw = lattice_unit(building.seed, wall as i64, bay as i64, row as i64);
    let window = (0.3..0.7).contains(&a) && (0.95..2.3).contains(&b) && corner > 0.7 && draw > 0.12;
    let door = row == 0.0 && (0.35..0.65).contains(&a) && b < 2.1 && draw < 0.25;
    if window {
        let frame = !(0.34..0.66).contains(&a) || !(1.03..2.22).contains(&b) || (a - 0.5).abs() < 0.02;
        return if frame { [206.0, 204.0, 200.0] } else { scale([62.0, 72.0, 86.0], 0.6 + 0.9 * draw) };
    }
    if door { [86.0, 62.0, 46.0] } else { colour }
}

/// Leaves.
pub(crate) fn leaves(tree: &Tree, p: DVec3) -> Rgb {
    let tint = lattice_unit(tree.seed, 1, 2, 3);
    let base = match tree.species {
        // Copper beeches and blood plums are dark red to purple, other brown crowns dry or in autumn.
        Species::Copper if lattice_unit(tree.seed, 4, 5, 6) < 0.5 => {
            blend([66.0, 38.0, 46.0], [96.0, 52.0, 56.0], tint)
        }
        Species::Copper => blend([104.0, 66.0, 46.0], [138.0, 96.0, 52.0], tint),
        Species::Conifer => blend([48.0, 72.0, 46.0], [62.0, 84.0, 56.0], tint),
        Species::Poplar => blend([84.0, 108.0, 52.0], [100.0, 120.0, 60.0], tint),
        _ => blend([66.0, 94.0, 42.0], [104.0, 122.0, 54.0], tint),
    };
    let clump = noise3(tree.seed, 1.2, p);
    let leaf = noise3(tree.seed ^ 3, 0.35, p);
    // Between leaves it is dark: a crown has about three quarters of a leaf's albedo.
    scale(base, 0.76 * (1.0 + 0.28 * clump + 0.25 * leaf))
}

/// Cars, walls, hedges and what stands on roofs.
pub(crate) fn thing(building: Option<&SceneBuilding>, thing: &Clutter, p: DVec3, steep: bool) -> Rgb {
    let draw = lattice_unit(thing.seed, 0, 0, 0);
    match thing.thing {
        Thing::Car => {
            let paints: [Rgb; 7] = [
                [214.0, 214.0, 216.0],
                [40.0, 42.0, 46.0],
                [126.0, 130.0, 136.0],
                [150.0, 34.0, 34.0],
                [42.0, 62.0, 112.0],
                [84.0, 86.0, 90.0],
                [190.0, 184.0, 170.0],
            ];
            let d = p.truncate() - thing.plan.centre;
            let s = d.dot(thing.plan.axis) / thing.plan.half_length;
            let glass = ((-0.68..-0.5).contains(&s) || (0.22..0.45).contains(&s)) && p.z > thing.low + 0.9;
            let paint = paints[((draw * 7.0) as usize).min(6)];
            if glass || (steep && p.z > thing.low + 1.25) { [46.0, 52.0, 58.0] } else { paint }
        }
        Thing::Hedge => scale([62.0, 88.0, 42.0], 1.0 + 0.3 * noise3(thing.seed, 0.5, p)),
        Thing::Wall => scale([168.0, 156.0, 138.0], 1.0 + 0.1 * noise3(thing.seed, 0.8, p)),
        Thing::Chimney => scale([140.0, 82.0, 64.0], 0.8 + 0.4 * draw),
        Thing::Plant => scale([176.0, 178.0, 180.0], 0.75 + 0.4 * draw),
        Thing::Dormer | Thing::Balcony | Thing::Floater => {
            let style = building.map(|b| &b.style);
            match style {
                Some(s) if !steep && thing.thing == Thing::Dormer => s.roof,
                Some(s) => scale(s.facade, 0.92),
                None => [150.0, 150.0, 150.0],
            }
        }
    }
}
