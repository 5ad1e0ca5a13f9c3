//! A hall of 100 to 180 m, low for its size.

use super::sheets::paint;
use crate::scene::building::Covering;
use crate::scene::house::Form;
use crate::scene::objects::Cover;
use crate::scene::primitive::Oblong;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// One hall through most of the site, with a yard around it.
pub(crate) fn place(site: &mut Site, c: &mut Counter) {
    let longest = (site.size().min_element() / 2.0 - 12.0).max(15.0);
    let half_length = c.range(50.0, 90.0).min(longest);
    let half_width = c.range(18.0, 45.0).min(longest * 0.7);
    let Some(yard) = (0..4).find_map(|k| {
        let shrunk = 1.0 - 0.15 * f64::from(k);
        site.find(half_length * shrunk, half_width * shrunk, 1.0, c)
    }) else {
        return;
    };
    let form = [Form::Gable, Form::Flat, Form::Gable][c.index(3)];
    let first = site.town.buildings.len();
    if site.house(form, &yard, c.range(6.0, 14.0), c.range(0.04, 0.15), 0.0, c) {
        let around = Oblong { half_length: yard.half_length + 9.0, half_width: yard.half_width + 9.0, ..yard };
        // Under what lies there already.
        site.town.patch(Cover::Concrete, around);
        let style = &mut site.town.buildings[first].style;
        style.covering = if c.unit() < 0.6 { Covering::Corrugated } else { Covering::Bitumen };
        style.roof = if c.unit() < 0.5 { paint(c) } else { [84.0, 82.0, 82.0] };
        let bays = Oblong { half_width: 1.0, ..yard };
        for t in [-1.0, 1.0] {
            let lane = Oblong { centre: yard.at(0.0, t * (1.0 + 5.0 / yard.half_width)), ..bays };
            super::super::place::containers(site, &lane, c);
        }
    }
}
