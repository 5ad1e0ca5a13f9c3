//! Pits of 3 to 20 m under the ground: mirrored water, glass and wrong matches. Truth knows nothing of them.

use super::Blob;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2};

#[derive(Debug)]
pub(crate) struct Pit {
    blob: Blob,
    deepest: f64,
    /// How steep: 0.15 is a shaft, 1 a funnel.
    shape: f64,
}

impl Pit {
    /// How far the surface sinks at a place, metres.
    pub(crate) fn depth(&self, p: DVec2) -> f64 {
        if !self.blob.contains(p) {
            return 0.0;
        }
        self.deepest * (1.0 - self.blob.share(p)).max(0.0).powf(self.shape)
    }
}

/// Two to five pits of 2 to 14 m on open ground.
pub(super) fn draw(site: &Site, c: &mut Counter) -> Vec<Pit> {
    let count = 2 + c.index(4);
    let mut pits = Vec::new();
    for _ in 0..count {
        let radius = c.range(1.2, 7.0);
        let Some(plan) = site.find(radius, radius, 0.5, c) else { continue };
        let blob = Blob { seed: c.bits(), centre: plan.centre, radius, swing: c.range(0.0, 0.4) };
        pits.push(Pit { blob, deepest: c.range(3.0, 20.0), shape: c.range(0.15, 1.0) });
    }
    pits
}
