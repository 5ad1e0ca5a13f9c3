//! Holes of 5 to 50 m where matching found nothing: water, shade, the edge of what was flown over.

use super::Blob;
use crate::scene::site::Site;
use gable_geometry::Counter;

/// Two to six holes, more small ones than large ones.
pub(super) fn draw(site: &Site, c: &mut Counter) -> Vec<Blob> {
    let most = (site.size().min_element() / 6.0).min(25.0);
    let count = 2 + c.index(5);
    let mut draw = || {
        let radius = (2.5 * (most / 2.5).powf(c.unit())).max(2.5);
        Blob { seed: c.bits(), centre: site.anywhere(c), radius, swing: c.range(0.2, 0.8) }
    };
    (0..count).map(|_| draw()).collect()
}
