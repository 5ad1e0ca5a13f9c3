//! Glass halls: greenhouses and halls with glass roofs, of which matching finds bumps between roof and floor.

use crate::scene::building::Covering;
use crate::scene::house::Form;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// One to three halls of 12 to 45 m.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    for _ in 0..1 + c.index(3) {
        let Some(plan) = site.find(c.range(6.0, 22.0), c.range(3.5, 8.0), 2.0, c) else { continue };
        let form = [Form::Gable, Form::Gable, Form::Flat, Form::Hip][c.index(4)];
        let first = site.town.buildings.len();
        if site.house(form, &plan, c.range(3.0, 9.0), c.range(0.3, 0.7), 1.0, c) {
            let style = &mut site.town.buildings[first].style;
            (style.covering, style.roof, style.facade) =
                (Covering::Glass, [128.0, 146.0, 150.0], [110.0, 128.0, 132.0]);
            (style.overhang, style.parapet) = (0.0, 0.0);
        }
    }
}
