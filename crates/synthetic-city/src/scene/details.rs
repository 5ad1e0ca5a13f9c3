//! Details beyond LOD2: chimneys, dormers, roof machinery, balconies; and styles.

use super::building::{Covering, SceneBuilding, Style};
use super::objects::{Clutter, Thing};
use super::primitive::Oblong;
use gable_geometry::{Counter, DVec2};

/// A style with the variety of a European town: one flat roof in five green, one of the colour of roads.
pub(crate) fn style(flat: bool, c: &mut Counter) -> Style {
    let jitter = |base: [f64; 3], amount: f64, c: &mut Counter| {
        let gain = c.range(1.0 - amount, 1.0 + amount);
        base.map(|x| (x * gain + c.range(-6.0, 6.0)).clamp(10.0, 245.0) as f32)
    };
    let draw = c.unit();
    let (covering, roof) = if flat {
        match draw {
            d if d < 0.2 => (Covering::Green, [104.0, 116.0, 66.0]),
            d if d < 0.45 => (Covering::Bitumen, [104.0, 104.0, 106.0]),
            d if d < 0.8 => (Covering::Gravel, [158.0, 152.0, 142.0]),
            _ => (Covering::Metal, [188.0, 192.0, 196.0]),
        }
    } else {
        match draw {
            d if d < 0.3 => (Covering::Tiles, [150.0, 84.0, 60.0]),
            d if d < 0.44 => (Covering::Tiles, [128.0, 84.0, 66.0]),
            d if d < 0.58 => (Covering::Tiles, [104.0, 74.0, 60.0]),
            d if d < 0.7 => (Covering::Tiles, [88.0, 82.0, 76.0]),
            d if d < 0.8 => (Covering::Tiles, [76.0, 78.0, 82.0]),
            d if d < 0.91 => (Covering::Slate, [84.0, 86.0, 92.0]),
            d if d < 0.94 => (Covering::Green, [96.0, 112.0, 62.0]),
            d if d < 0.97 => (Covering::Metal, [150.0, 152.0, 154.0]),
            _ => (Covering::Metal, [120.0, 150.0, 138.0]),
        }
    };
    let facades = [
        [214.0, 206.0, 188.0],
        [226.0, 222.0, 214.0],
        [196.0, 164.0, 128.0],
        [164.0, 96.0, 76.0],
        [200.0, 190.0, 140.0],
        [142.0, 84.0, 66.0],
        [176.0, 128.0, 100.0],
        [150.0, 150.0, 150.0],
        [186.0, 176.0, 164.0],
    ];
    let facade = facades[c.index(facades.len())];
    Style {
        covering,
        roof: jitter(roof, 0.18, c),
        facade: jitter(facade, 0.1, c),
        overhang: if flat { 0.0 } else { [0.0, 0.2, 0.3, 0.4][c.index(4)] },
        parapet: if flat && c.unit() < 0.7 { c.range(0.35, 0.7) } else { 0.0 },
        storey: c.range(2.8, 3.4),
        bay: c.range(2.0, 3.2),
    }
}

/// The style of the next house of a row: the same materials, colours a little older or newer.
pub(crate) fn alike(first: &Style, c: &mut Counter) -> Style {
    let (roof, facade) = (c.range(0.92, 1.08) as f32, c.range(0.94, 1.06) as f32);
    Style { roof: first.roof.map(|x| x * roof), facade: first.facade.map(|x| x * facade), ..first.clone() }
}

/// Clutter on and at a building.
pub(crate) fn details(building: &SceneBuilding, c: &mut Counter, out: &mut Vec<Clutter>) {
    let size = building.bounds.size();
    let place = |c: &mut Counter| building.bounds.min + DVec2::new(size.x * c.unit(), size.y * c.unit());
    let area: f64 = building.roof.iter().map(|f| f.polygon.area()).sum();
    for _ in 0..((area / 70.0).ceil() as usize).min(30) {
        let p = place(c);
        let (draw, seed) = (c.unit(), c.bits());
        let Some((z, face)) = building.roof_at(p) else { continue };
        let roof = &building.roof[face];
        let slope = roof.plane.slope();
        if slope > 0.15 && draw < 0.5 {
            let plan =
                Oblong { centre: p, axis: across(roof.plane.normal().truncate()), half_length: 0.5, half_width: 0.35 };
            out.push(Clutter { thing: Thing::Chimney, plan, low: z - 1.5, high: z + c.range(0.7, 1.3), seed });
        } else if slope > 0.45 && draw < 0.95 {
            dormer(building, face, p, seed, c, out);
        } else if slope < 0.1 && area > 100.0 && roof.polygon.boundary_distance(p) > 2.5 {
            let plan = Oblong {
                centre: p,
                axis: across(DVec2::from_angle(building.seed as f64)),
                half_length: c.range(0.5, 2.0),
                half_width: c.range(0.5, 1.3),
            };
            out.push(Clutter { thing: Thing::Plant, plan, low: z - 0.2, high: z + c.range(0.5, 1.8), seed });
        }
    }
    if building.style.overhang == 0.0 && c.unit() < 0.3 {
        balconies(building, c, out);
    }
}

fn across(normal: DVec2) -> DVec2 {
    normal.try_normalize().unwrap_or(DVec2::X)
}

/// A row of dormers at the height of `p`.
fn dormer(building: &SceneBuilding, face: usize, p: DVec2, seed: u64, c: &mut Counter, out: &mut Vec<Clutter>) {
    let roof = &building.roof[face];
    let down = across(roof.plane.normal().truncate());
    let along = down.perp();
    for k in -3..=3 {
        let q = p + along * (f64::from(k) * 3.1);
        if !roof.polygon.contains(q) || roof.polygon.boundary_distance(q) < 1.5 {
            continue;
        }
        let front = roof.plane.height(q + down * 0.8);
        let plan = Oblong { centre: q, axis: down, half_length: 0.8, half_width: 0.8 };
        let high = front + 1.35 + 0.1 * (seed % 4) as f64;
        out.push(Clutter { thing: Thing::Dormer, plan, low: front - 0.3, high, seed: c.bits() });
    }
}

/// Balconies on one facade, a column for each second bay.
fn balconies(building: &SceneBuilding, c: &mut Counter, out: &mut Vec<Clutter>) {
    if building.rims.is_empty() {
        return;
    }
    let rim = building.rims[c.index(building.rims.len())];
    let length = rim.from.distance(rim.to);
    let top = building.roof[rim.face].plane.height(rim.from.midpoint(rim.to));
    if length < 8.0 || top - building.base < 7.0 {
        return;
    }
    let axis = (rim.to - rim.from) / length;
    let mut at = 2.5;
    while at < length - 2.5 {
        let mut z = building.base + building.style.storey;
        while z < top - 2.0 {
            let plan =
                Oblong { centre: rim.from + axis * at - axis.perp() * 0.6, axis, half_length: 1.3, half_width: 0.6 };
            out.push(Clutter { thing: Thing::Balcony, plan, low: z - 0.2, high: z + 0.9, seed: building.seed });
            z += building.style.storey;
        }
        at += 2.0 * building.style.bay;
    }
}
