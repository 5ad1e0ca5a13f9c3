//! Faults of whole meshes, which no truth has: functions of the absolute place, so that tiles need not know of each other.

mod blob;
mod fill;
mod holes;
mod pits;
mod rim;

use super::TriMesh;
use crate::scene::building::SceneBuilding;
use crate::scene::place::Feature;
use crate::scene::site::Site;
use blob::Blob;
use fill::Membrane;
use gable_geometry::{Counter, DVec2, DVec3, dvec2};
use pits::Pit;
use rim::Rim;

/// The faults of a place.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    rim: Option<Rim>,
    holes: Vec<Blob>,
    pits: Vec<Pit>,
    fill: Vec<Membrane>,
}

impl Faults {
    /// Draws those that a place has.
    pub(crate) fn draw(site: &Site, features: &[Feature], seed: u64) -> Self {
        let has = |feature: Feature| features.contains(&feature);
        let counter = |feature: Feature| Counter::keyed(seed, &[46, feature as i64]);
        Self {
            rim: has(Feature::Rim).then(|| Rim::draw(site, &mut counter(Feature::Rim))),
            holes: if has(Feature::Holes) { holes::draw(site, &mut counter(Feature::Holes)) } else { Vec::new() },
            pits: if has(Feature::Pits) { pits::draw(site, &mut counter(Feature::Pits)) } else { Vec::new() },
            fill: if has(Feature::Fill) { fill::draw(site, &mut counter(Feature::Fill)) } else { Vec::new() },
        }
    }

    fn is_empty(&self) -> bool {
        self.rim.is_none() && self.holes.is_empty() && self.pits.is_empty() && self.fill.is_empty()
    }

    /// Whether the mesh has its own surface at a place: inside of the rim, in no hole, not filled.
    pub(crate) fn has_surface(&self, p: DVec2) -> bool {
        self.rim.as_ref().is_none_or(|rim| rim.contains(p))
            && !self.holes.iter().any(|hole| hole.contains(p))
            && !self.fill.iter().any(|fill| fill.contains(p))
    }

    /// Share of a building's roof over which the mesh has its own surface.
    pub(crate) fn share_left(&self, building: &SceneBuilding) -> f64 {
        if self.is_empty() {
            return 1.0;
        }
        let size = building.bounds.size();
        let steps = 24;
        let (mut all, mut left) = (0_usize, 0_usize);
        for k in 0..steps * steps {
            let (i, j) = (f64::from(k % steps) + 0.5, f64::from(k / steps) + 0.5);
            let p = building.bounds.min + size * dvec2(i, j) / f64::from(steps);
            if building.roof_at(p).is_some() {
                all += 1;
                left += usize::from(self.has_surface(p));
            }
        }
        left as f64 / all.max(1) as f64
    }

    /// Changes the mesh of a tile; says which of its faces then have no texture.
    pub(crate) fn apply(&self, mesh: &mut TriMesh) -> Vec<bool> {
        if self.is_empty() {
            return Vec::new();
        }
        let middle = |mesh: &TriMesh, f: &[u32; 3]| {
            (f.iter().map(|&v| mesh.vertices[v as usize]).sum::<DVec3>() / 3.0).truncate()
        };
        for vertex in &mut mesh.vertices {
            let p = vertex.truncate();
            vertex.z -= self.pits.iter().map(|pit| pit.depth(p)).fold(0.0, f64::max);
            if let Some(fill) = self.fill.iter().find(|fill| fill.contains(p)) {
                vertex.z = fill.height(p);
            }
        }
        let kept: Vec<[u32; 3]> =
            mesh.faces.iter().filter(|f| !self.holes.iter().any(|h| h.contains(middle(mesh, f)))).copied().collect();
        mesh.faces = kept;
        if let Some(rim) = &self.rim {
            rim.cut(mesh);
        }
        mesh.compact();
        mesh.faces.iter().map(|f| self.fill.iter().any(|fill| fill.contains(middle(mesh, f)))).collect()
    }
}
