//! A level pad for a house in a hillside: cut in above, held by a wall below.

use super::Landform;
use crate::scene::primitive::Oblong;
use gable_geometry::DVec2;

#[derive(Debug)]
pub(crate) struct Pad {
    pub(crate) plan: Oblong,
    pub(crate) level: f64,
}

impl Landform for Pad {
    fn height(&self, p: DVec2, below: f64) -> f64 {
        if self.plan.contains(p) { self.level } else { below }
    }
}
