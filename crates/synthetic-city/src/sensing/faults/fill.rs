//! Holes that a program has filled: a membrane from rim to rim, coarse and without texture.

use super::Blob;
use crate::scene::site::Site;
use gable_geometry::{Counter, DVec2, DVec3};

/// Places of the rim that hold the membrane.
const HOLDERS: i32 = 16;

#[derive(Debug)]
pub(crate) struct Membrane {
    blob: Blob,
    holders: Vec<DVec3>,
}

impl Membrane {
    pub(crate) fn contains(&self, p: DVec2) -> bool {
        self.blob.contains(p)
    }

    /// Mean of the heights of the rim, by the inverse square of the distance.
    pub(crate) fn height(&self, p: DVec2) -> f64 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for holder in &self.holders {
            let weight = 1.0 / (p.distance_squared(holder.truncate()) + 0.5);
            sum += weight * holder.z;
            weights += weight;
        }
        sum / weights
    }
}

/// Three to six membranes of 6 to 40 m; some are held by crowns or roofs here and there, and bulge.
pub(super) fn draw(site: &Site, c: &mut Counter) -> Vec<Membrane> {
    let most = (site.size().min_element() / 7.0).min(20.0);
    let count = 3 + c.index(4);
    let mut all = Vec::new();
    for _ in 0..count {
        let radius = 3.0 * (most / 3.0).powf(c.unit());
        let centre = site.anywhere(c);
        let blob = Blob { seed: c.bits(), centre, radius, swing: c.range(0.1, 0.5) };
        let bulge = if c.unit() < 0.4 { c.range(0.5, 4.0) } else { 0.0 };
        let holders = (0..HOLDERS)
            .map(|k| {
                let p = centre + DVec2::from_angle(f64::from(k) / f64::from(HOLDERS) * std::f64::consts::TAU) * radius;
                p.extend(site.town.relief.height(p) + bulge * c.unit() * c.unit())
            })
            .collect();
        all.push(Membrane { blob, holders });
    }
    all
}
