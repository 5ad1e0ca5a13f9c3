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
            let (a, b) = ((p.x * 0.9 + p.y * 0.44) / 6.5, (p.y * 0.9 - p.x * 0.44) / 3.3);
            let mended = lattice_unit(seed ^ 7, a.floor() as i64, b.floor() as i64, 0) < 0.06;
            let base = scale([92.0, 92.0, 95.0], (1.0 + 0.1 * wide + 0.05 * fine) * if mended { 0.84 } else { 1.0 });
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
        Cover::Field => {
            let row = (0.5 + 0.5 * along(patch, p, 0.9).sin()) * 0.35;
            let grown = blend([96.0, 118.0, 58.0], [150.0, 140.0, 84.0], 0.5 + 0.5 * noise2(seed ^ 8, 60.0, p.x, p.y));
            scale(blend(grown, [134.0, 112.0, 84.0], row), 1.0 + 0.08 * wide + 0.1 * fine)
        }
        Cover::Ploughed => {
            let furrow = 0.06 * along(patch, p, 0.7).sin() + 0.05 * along(patch, p, 6.0).sin();
            let clod = noise2(seed ^ 10, 1.3, p.x, p.y);
            scale([128.0, 98.0, 72.0], 1.0 + furrow + 0.12 * wide + 0.12 * clod + 0.1 * fine)
        }
        Cover::Thicket => {
            let clump = noise2(seed ^ 11, 1.8, p.x, p.y);
            scale(blend([70.0, 100.0, 44.0], [122.0, 118.0, 66.0], 0.5 + 0.5 * wide), 1.0 + 0.22 * clump + 0.18 * fine)
        }
        Cover::Concrete => {
            let joint = p.x.rem_euclid(5.0) < 0.08 || p.y.rem_euclid(5.0) < 0.08;
            let worn = 1.0 + 0.1 * wide + 0.06 * noise2(seed ^ 12, 2.5, p.x, p.y) + 0.03 * fine;
            scale([166.0, 160.0, 150.0], if joint { 0.82 * worn } else { worn })
        }
        Cover::Soil => scale([150.0, 126.0, 94.0], 1.0 + 0.12 * wide + 0.08 * fine),
        Cover::Grass => {
            let dry = 0.5 + 0.5 * noise2(seed ^ 5, 14.0, p.x, p.y);
            let green = blend([88.0, 112.0, 56.0], [134.0, 132.0, 78.0], dry * dry);
            scale(green, 1.0 + 0.1 * wide + 0.13 * fine)
        }
    }
}

/// Phase of rows that run along a patch with a pitch in metres.
fn along(patch: Option<&Patch>, p: DVec2, pitch: f64) -> f64 {
    let across = patch.map_or(p.x, |patch| (p - patch.plan.centre).dot(patch.plan.axis.perp()));
    across / pitch * std::f64::consts::TAU
}

/// A dashed line in the middle of a street that has a carriageway of two lanes or more.
fn marked(patch: &Patch, p: DVec2) -> bool {
    if !(3.0..12.0).contains(&patch.plan.half_width) {
        return false;
    }
    let d = p - patch.plan.centre;
    let (along, across) = (d.dot(patch.plan.axis), d.dot(patch.plan.axis.perp()));
    across.abs() < 0.09 && along.rem_euclid(6.0) < 3.0 && along.abs() < patch.plan.half_length - 8.0
}

/// Roof coverings, with rows along the eaves, and what lies flat on them.
pub(crate) fn roof(building: &SceneBuilding, face: usize, p: DVec2) -> Rgb {
    let style = &building.style;
    let (plane, middle) = building.roof.get(face).map_or((DVec2::ZERO, p), |f| (f.plane.normal().truncate(), f.middle));
    let down = plane.try_normalize().unwrap_or(DVec2::X);
    let stretch = (1.0 - plane.length_squared()).max(0.1).sqrt();
    let (s, t) = (p.dot(down.perp()), p.dot(down) / stretch);
    let seed = building.seed;
    let stain = noise2(seed, 2.8, p.x, p.y);
    let cell = |a: f64, b: f64| lattice_unit(seed, (s / a).floor() as i64, (t / b).floor() as i64, 0);
    let flat = plane.length() < 0.1;
    let within = ((p - middle).dot(down.perp()), (p - middle).dot(down) / stretch);
    if let Some(colour) = on_roof(seed, face, flat, (s, t), within) {
        return colour;
    }
    let covered = match style.covering {
        // Flat parts of tiled and slated buildings have gravel.
        Covering::Tiles | Covering::Slate if flat => {
            scale([150.0, 145.0, 138.0], 0.9 + 0.2 * cell(0.15, 0.15) + 0.1 * stain)
        }
        Covering::Tiles => {
            let groove = if t.rem_euclid(0.34) < 0.08 { 0.86 } else { 1.0 };
            scale(style.roof, groove * (0.9 + 0.2 * cell(0.24, 0.34)) * (1.0 + 0.1 * stain))
        }
        Covering::Slate => scale(style.roof, (0.88 + 0.24 * cell(0.3, 0.2)) * (1.0 + 0.08 * stain)),
        Covering::Metal => {
            let seam = if s.rem_euclid(0.6) < 0.08 { 0.8 } else { 1.0 };
            scale(style.roof, seam * (1.0 + 0.06 * stain))
        }
        Covering::Corrugated => {
            let rib = 1.0 + 0.07 * (s / 0.25 * std::f64::consts::TAU).sin();
            let (sheet, light) = (cell(1.05, 3.2), lattice_unit(seed ^ 0x5ee, (s / 1.05).floor() as i64, 0, 0));
            let rust = (noise2(seed ^ 0x4057, 2.4, p.x, p.y) + lattice_unit(seed, 8, 8, 8) - 0.75).max(0.0);
            let painted = if light < 0.06 { [196.0, 204.0, 196.0] } else { style.roof };
            scale(blend(painted, [126.0, 78.0, 52.0], 1.2 * rust), rib * (0.93 + 0.14 * sheet) * (1.0 + 0.06 * stain))
        }
        Covering::Glass => {
            let bar = s.rem_euclid(1.2) < 0.09 || t.rem_euclid(2.4) < 0.1;
            let mirrored = 0.5 + 0.5 * noise2(seed ^ 0x61, 3.3, p.x, p.y);
            let pane = blend(style.roof, [206.0, 214.0, 220.0], mirrored * mirrored);
            if bar { [206.0, 208.0, 206.0] } else { scale(pane, 0.8 + 0.3 * cell(1.2, 2.4)) }
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
    };
    weathered(seed, style.covering, flat, p, covered)
}

/// Solar panels and skylights; (`s`, `t`) run along the eave and down the slope, `within` from the middle of the face.
fn on_roof(seed: u64, face: usize, flat: bool, (s, t): (f64, f64), within: (f64, f64)) -> Option<Rgb> {
    let draw = lattice_unit(seed ^ 0x501a, face as i64, 0, 0);
    let size = lattice_unit(seed ^ 0x501a, face as i64, 1, 0);
    let frame = s.rem_euclid(1.0) < 0.07 || t.rem_euclid(1.65) < 0.09;
    let panel = if frame { [112.0, 116.0, 122.0] } else { [34.0, 39.0, 56.0] };
    if flat {
        // Rows on stands, with gaps.
        if draw < 0.1 && within.0.abs() < 3.0 + 8.0 * size && within.1.abs() < 2.5 + 4.0 * size {
            return (t.rem_euclid(2.3) < 1.1).then_some(panel);
        }
    } else if draw < 0.14 && within.0.abs() < 1.5 + 2.5 * size && within.1.abs() < 0.9 + 1.2 * size {
        return Some(panel);
    }
    let (a, b) = ((s / 4.3).floor(), (t / 3.1).floor());
    let light = lattice_unit(seed ^ 0x5c7, a as i64, b as i64, 2);
    let (u, v) = (s - 4.3 * a, t - 3.1 * b);
    if light < 0.07 && (1.7..2.5).contains(&u) && (1.0..2.1).contains(&v) {
        let edge = !(1.8..2.4).contains(&u) || !(1.1..2.0).contains(&v);
        return Some(match (edge, flat) {
            (true, _) => [150.0, 150.0, 150.0],
            (_, true) => [206.0, 212.0, 216.0],
            _ => [64.0, 76.0, 92.0],
        });
    }
    None
}

/// Lichen on old tiles; puddles and repairs on flat roofs.
fn weathered(seed: u64, covering: Covering, flat: bool, p: DVec2, colour: Rgb) -> Rgb {
    let age = lattice_unit(seed ^ 0xa6e, 0, 0, 0);
    let wide = noise2(seed ^ 0xa6f, 2.1, p.x, p.y);
    match covering {
        Covering::Green | Covering::Metal | Covering::Corrugated | Covering::Glass => colour,
        _ if flat => {
            let (a, b) = ((p.x * 0.8 + p.y * 0.6) / 5.3, (p.y * 0.8 - p.x * 0.6) / 2.2);
            let repaired = lattice_unit(seed ^ 0x9e7, a.floor() as i64, b.floor() as i64, 0) < 0.03;
            let puddle = if wide > 0.35 { 0.84 } else { 1.0 };
            scale(colour, puddle * if repaired { 0.8 } else { 1.0 })
        }
        _ => blend(colour, [104.0, 104.0, 82.0], 0.55 * age * (0.3 + wide).max(0.0)),
    }
}

/// Facades with windows; `u` runs along the wall, `corner` is the distance to its nearer end.
pub(crate) fn facade(building: &SceneBuilding, u: f64, corner: f64, z: f64, wall: usize) -> Rgb {
    let style = &building.style;
    let height = z - building.base;
    let stain = noise2(building.seed ^ wall as u64, 1.9, u, z);
    let mut colour = scale(style.facade, 1.0 + 0.07 * stain);
    let of_house = |k: i64| lattice_unit(building.seed ^ 0xfac, k, 0, 0);
    let (bay, row) = ((u / style.bay).floor(), (height / style.storey).floor());
    let (a, b) = (u / style.bay - bay, height - row * style.storey);
    let draw = lattice_unit(building.seed, wall as i64, bay as i64, row as i64);
    let glass = |shade: f64| match shade {
        // Some mirror the sky, some have blinds.
        s if s < 0.14 => [126.0, 140.0, 156.0],
        s if s < 0.24 => [176.0, 172.0, 162.0],
        s => scale([54.0, 62.0, 74.0], 0.6 + 0.9 * s),
    };
    if row == 0.0 && of_house(0) < 0.22 && style.storey > 2.9 {
        // A shop: glass from pier to pier, a sign above.
        if (2.5..3.0).contains(&b) {
            let tint = of_house(1);
            return blend([62.0, 70.0, 96.0], [158.0, 120.0, 70.0], tint);
        }
        if (0.3..2.5).contains(&b) && (0.08..0.92).contains(&a) && corner > 0.4 {
            return glass(0.3 + 0.6 * draw);
        }
    }
    if height < 0.6 {
        colour = scale(colour, 0.72);
    } else if of_house(2) < 0.3 && b < 0.16 {
        colour = blend(colour, [222.0, 218.0, 208.0], 0.7);
    }
    let half = 0.13 + 0.12 * of_house(3);
    let (sill, lintel) = (0.75 + 0.3 * of_house(4), 2.1 + 0.35 * of_house(5));
    // Bands of windows, or one for each bay.
    let ribbon = of_house(6) < 0.14;
    let across = if ribbon { (0.03..0.97).contains(&a) } else { (a - 0.5).abs() < half };
    let window = across && (sill..lintel).contains(&b) && corner > 0.7 && draw > 0.1;
    let door = row == 0.0 && (a - 0.5).abs() < 0.15 && b < 2.1 && draw < 0.25;
    if window {
        let side = if ribbon { !(0.06..0.94).contains(&a) } else { (a - 0.5).abs() > half - 0.035 };
        let frame = side || b < sill + 0.08 || b > lintel - 0.08 || (a - 0.5).abs() < 0.018;
        return if frame {
            [206.0, 204.0, 200.0]
        } else {
            glass(lattice_unit(building.seed ^ 0x91a, wall as i64, bay as i64, row as i64))
        };
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
        Species::Palm => blend([70.0, 96.0, 48.0], [104.0, 118.0, 62.0], tint),
        Species::Banana => blend([86.0, 124.0, 46.0], [128.0, 150.0, 66.0], tint),
        _ => blend([66.0, 94.0, 42.0], [104.0, 122.0, 54.0], tint),
    };
    let clump = noise3(tree.seed, 1.2, p);
    let leaf = noise3(tree.seed ^ 3, 0.35, p);
    // Between leaves it is dark: a crown has about three quarters of a leaf's albedo.
    scale(base, 0.76 * (1.0 + 0.28 * clump + 0.25 * leaf))
}

/// Paints of containers, trailers and cloths.
const SHEETS: [Rgb; 8] = [
    [52.0, 98.0, 160.0],
    [164.0, 58.0, 46.0],
    [214.0, 214.0, 212.0],
    [62.0, 112.0, 84.0],
    [196.0, 128.0, 48.0],
    [120.0, 122.0, 124.0],
    [104.0, 148.0, 186.0],
    [140.0, 92.0, 70.0],
];

/// What hangs over the ground: decks, beams, cloths.
pub(crate) fn canopy(thing: &Clutter, p: DVec3) -> Rgb {
    let draw = lattice_unit(thing.seed, 0, 0, 0);
    let fold = 1.0 + 0.1 * noise3(thing.seed, 0.9, p);
    match thing.thing {
        Thing::Bridge if draw < 0.5 => scale([96.0, 95.0, 96.0], fold),
        Thing::Bridge => scale([156.0, 150.0, 140.0], fold),
        Thing::Pergola => scale([164.0, 152.0, 132.0], fold * (0.8 + 0.3 * draw)),
        _ => scale(SHEETS[((draw * 8.0) as usize).min(7)], fold),
    }
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
        Thing::Crop | Thing::Bush => {
            let green = blend([74.0, 104.0, 44.0], [126.0, 136.0, 64.0], draw);
            scale(green, 0.9 + 0.3 * noise3(thing.seed, 0.5, p))
        }
        Thing::Container => scale(SHEETS[((draw * 8.0) as usize).min(7)], 1.0 + 0.08 * noise3(thing.seed, 1.1, p)),
        Thing::Heap => {
            let heaps: [Rgb; 5] = [
                [172.0, 148.0, 96.0],
                [42.0, 42.0, 44.0],
                [150.0, 140.0, 128.0],
                [64.0, 104.0, 150.0],
                [122.0, 96.0, 72.0],
            ];
            scale(heaps[((draw * 5.0) as usize).min(4)], 1.0 + 0.14 * noise3(thing.seed, 0.7, p))
        }
        Thing::Bridge | Thing::Pergola | Thing::Tarpaulin => canopy(thing, p),
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
