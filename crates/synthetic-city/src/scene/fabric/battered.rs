//! Battered walls: halls whose walls lean inward by metres, as museums and forts have. The walls are steep roof planes of the truth.

use crate::scene::building::Covering;
use crate::scene::primitive::Primitive;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Two to four halls of 15 to 50 m.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    for _ in 0..2 + c.index(3) {
        let Some(plan) = site.find(c.range(7.0, 25.0), c.range(6.0, 15.0), 3.0, c) else { continue };
        // A plinth of a bit over a metre, then walls of 72 to 79 degrees up to a nearly flat roof.
        let (steep, rise) = (c.range(3.1, 5.0), c.range(4.0, 9.0));
        let shape = [Primitive::mansard(&plan, c.range(1.1, 1.6), steep, rise, c.range(0.02, 0.3))];
        if site.town.add("battered", &shape, true, c) {
            site.take(&plan);
            if let Some(building) = site.town.buildings.last_mut() {
                let (covering, roof) = [
                    (Covering::Bitumen, [150.0, 146.0, 138.0]),
                    (Covering::Gravel, [176.0, 158.0, 128.0]),
                    (Covering::Metal, [140.0, 110.0, 88.0]),
                ][c.index(3)];
                (building.style.covering, building.style.roof) = (covering, roof);
                (building.style.parapet, building.style.overhang) = (0.0, 0.0);
            }
        }
    }
}
