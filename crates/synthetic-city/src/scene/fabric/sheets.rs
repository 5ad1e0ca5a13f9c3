//! Roofs of corrugated sheets, blue, white, red, rusty or grey, and lean-tos of them along walls.

use crate::scene::building::Covering;
use crate::scene::house::Form;
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Colours of sheets, sRGB 0–255.
const PAINTS: [[f32; 3]; 7] = [
    [52.0, 108.0, 176.0],
    [84.0, 142.0, 196.0],
    [214.0, 216.0, 218.0],
    [168.0, 58.0, 48.0],
    [132.0, 88.0, 66.0],
    [150.0, 152.0, 152.0],
    [92.0, 94.0, 92.0],
];

/// A colour of sheets.
pub(crate) fn paint(c: &mut Counter) -> [f32; 3] {
    let gain = c.range(0.8, 1.1) as f32;
    PAINTS[c.index(PAINTS.len())].map(|x| (x * gain).min(240.0))
}

/// Covers most roofs with sheets, and leans sheds against walls.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let share = c.range(0.5, 1.0);
    for building in &mut site.town.buildings {
        if c.unit() < share {
            (building.style.covering, building.style.roof) = (Covering::Corrugated, paint(c));
        }
    }
    lean_tos(site, c);
}

/// Sheds of 2 to 4 m depth against one wall in four.
pub(crate) fn lean_tos(site: &mut Site, c: &mut Counter) {
    let mut walls = Vec::new();
    for building in &site.town.buildings {
        for rim in &building.rims {
            let high = building.roof[rim.face].plane.height(rim.from.midpoint(rim.to)) - building.base;
            if rim.from.distance(rim.to) > 5.0 && high > 3.0 && c.unit() < 0.25 {
                walls.push((*rim, high));
            }
        }
    }
    for (rim, high) in walls {
        let length = rim.from.distance(rim.to);
        let axis = (rim.to - rim.from) / length;
        let half_width = c.range(1.0, 2.2);
        // The rise of a shed begins at its first long edge: outside, so that it leans against the wall.
        let plan = Oblong {
            centre: rim.from.midpoint(rim.to) - axis.perp() * (half_width + 0.02),
            axis,
            half_length: length / 2.0 * c.range(0.4, 0.95),
            half_width,
        };
        let eave = c.range(1.9, 2.6).min(high - 0.8);
        let first = site.town.buildings.len();
        if site.is_free(&plan, -0.5) && site.town.house(Form::Shed, &plan, eave, 0.2, c) {
            site.take(&plan);
            let style = &mut site.town.buildings[first].style;
            (style.covering, style.roof, style.overhang) = (Covering::Corrugated, paint(c), 0.0);
        }
    }
}
