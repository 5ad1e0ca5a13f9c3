//! Eaves of about a metre on pitched roofs, and flat roofs that project.

use crate::scene::site::Site;
use gable_geometry::Counter;

/// Widens the eaves of all buildings, a bit more in one than in another.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let usual = c.range(0.7, 1.4);
    for building in &mut site.town.buildings {
        building.style.overhang = (usual + c.range(-0.2, 0.2)).max(0.5);
        building.style.parapet = 0.0;
    }
}
