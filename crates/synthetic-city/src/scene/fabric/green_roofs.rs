//! Green roofs: lawns and bushes on flat roofs, from above like gardens.

use crate::scene::building::Covering;
use crate::scene::objects::{Clutter, Thing};
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};

/// Makes most flat roofs green, half of them with bushes.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let share = c.range(0.6, 1.0);
    let mut bushes = Vec::new();
    for building in &mut site.town.buildings {
        let slope = building.roof.iter().map(|f| f.plane.slope()).fold(0.0, f64::max);
        if slope > 0.4 || c.unit() > share {
            continue;
        }
        let lush = c.unit();
        let roof = std::array::from_fn(|k| {
            [112.0, 122.0, 70.0][k] + (([82.0, 116.0, 52.0][k] - [112.0, 122.0, 70.0][k]) * lush) as f32
        });
        (building.style.covering, building.style.roof) = (Covering::Green, roof);
        if c.unit() < 0.5 {
            continue;
        }
        let area: f64 = building.roof.iter().map(|f| f.polygon.area()).sum();
        let size = building.bounds.size();
        for _ in 0..((area / 25.0) as usize).min(120) {
            let p = building.bounds.min + DVec2::new(size.x * c.unit(), size.y * c.unit());
            let (half_length, half_width) = (c.range(0.4, 2.5), c.range(0.4, 1.2));
            let Some((z, face)) = building.roof_at(p) else { continue };
            if building.roof[face].polygon.boundary_distance(p) > 1.0 + half_length {
                let plan = Oblong { centre: p, axis: site.axis, half_length, half_width };
                bushes.push(Clutter {
                    thing: Thing::Bush,
                    plan,
                    low: z - 0.1,
                    high: z + c.range(0.4, 2.5),
                    seed: c.bits(),
                });
            }
        }
    }
    site.town.clutter.extend(bushes);
}
