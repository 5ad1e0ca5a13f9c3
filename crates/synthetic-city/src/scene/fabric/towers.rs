//! What is slender and tall: minarets beside a domed hall, and stacks of works. They are buildings.

use crate::scene::building::Covering;
use crate::scene::primitive::{Oblong, Primitive};
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};

/// Draws of a shape before it is left out.
const TRIES: usize = 6;

/// A hall with a dome and one to four minarets of 25 to 60 m.
pub(crate) fn minarets(site: &mut Site, c: &mut Counter) {
    let half = c.range(8.0, 16.0);
    let Some(whole) = site.find(half + 5.0, half + 5.0, 2.0, c) else { return };
    site.take(&whole);
    let hall = Oblong { half_length: half, half_width: half, ..whole };
    let eave = c.range(7.0, 12.0);
    // Rings with different numbers of sides, so that no two edges lie in one line; where two come too close, others are drawn.
    let built = (0..TRIES).any(|_| {
        let radius = half * c.range(0.4, 0.75);
        let (low, slope) = (eave + c.range(1.0, 2.5), c.range(0.9, 1.5));
        let shape = [
            Primitive::flat(hall.ring(), eave),
            Primitive::cone(hall.centre, radius, 16, low, slope),
            Primitive::cone(hall.centre, radius * c.range(0.6, 0.8), 11, low + 0.45 * radius * slope, 0.6 * slope),
        ];
        site.town.add("mosque", &shape, true, c)
    });
    if built && let Some(building) = site.town.buildings.last_mut() {
        (building.style.covering, building.style.roof) = (Covering::Metal, [196.0, 198.0, 190.0]);
        building.style.parapet = 0.0;
    }
    let (height, thick) = (c.range(25.0, 60.0), c.range(1.3, 2.2));
    for corner in [(1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)].into_iter().take(1 + c.index(4)) {
        let at = hall.centre + (hall.at(corner.0, corner.1) - hall.centre) * (1.0 + (thick + 0.8) / half);
        for _ in 0..TRIES {
            // A shaft in two widths under a pointed cap.
            let shape = [
                Primitive::cone(at, thick, 12, height * 0.62, 0.3),
                Primitive::cone(at, thick * c.range(0.6, 0.8), 9, height * 0.88, 2.2),
            ];
            if slender(site, "minaret", &shape, [214.0, 206.0, 190.0], c) {
                break;
            }
        }
    }
}

/// One to four stacks of 15 to 60 m, some beside a building.
pub(crate) fn stacks(site: &mut Site, c: &mut Counter) {
    for _ in 0..1 + c.index(4) {
        let radius = c.range(0.9, 2.8);
        let Some(plan) = site.find(radius, radius, 0.3, c) else { continue };
        let n = 14;
        let corner =
            |k: i32| plan.centre + DVec2::from_angle(f64::from(k) / f64::from(n) * std::f64::consts::TAU) * radius;
        let shape = [Primitive::flat((0..n).map(corner).collect(), c.range(15.0, 60.0))];
        let colour = if c.unit() < 0.5 { [150.0, 92.0, 74.0] } else { [176.0, 174.0, 168.0] };
        if slender(site, "stack", &shape, colour, c) {
            site.take(&plan);
        }
    }
}

fn slender(site: &mut Site, kind: &str, shape: &[Primitive], colour: [f32; 3], c: &mut Counter) -> bool {
    let clutter = site.town.clutter.len();
    let built = site.town.add(kind, shape, true, c);
    site.town.clutter.truncate(clutter);
    if built && let Some(building) = site.town.buildings.last_mut() {
        (building.style.covering, building.style.roof, building.style.facade) = (Covering::Metal, colour, colour);
        (building.style.parapet, building.style.overhang) = (0.0, 0.0);
    }
    built
}
