//! Whether the levels of detail of a building tell the same story.

use crate::city::region;
use crate::region::iou;
use crate::roofs::volume;
use crate::statistics::ratio;
use gable_city_model::{Building, CityModel, Semantic};
use gable_geometry::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Footprints are equal from this intersection over union on.
const EQUAL: f64 = 0.999;
/// Volumes are coherent up to this difference.
const VOLUME: f64 = 0.05;

/// Coherence of the levels of detail of the result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coherence {
    /// Buildings with LOD0, LOD1 and LOD2.
    pub complete: usize,
    /// Share of those whose LOD1 stands exactly on the LOD0 footprint (IoU of at least 0.999).
    pub lod1_on_lod0: f64,
    /// Share of those whose LOD2 stands exactly on the LOD0 footprint.
    pub lod2_on_lod0: f64,
    /// Share of those whose LOD1 has the volume of LOD2 to 5 %.
    pub volumes: f64,
}

pub(crate) fn coherence(model: &CityModel) -> Coherence {
    let one = |b: &Building| {
        let lods = &b.lods;
        let footprint = lods.footprint.as_ref()?;
        if lods.lod1.is_empty() || lods.lod2.is_empty() {
            return None;
        }
        let lod0 = region(std::slice::from_ref(footprint), DVec3::ZERO, |_| true);
        let on = |shells| {
            let ground = region(shells, DVec3::ZERO, |s| s == Semantic::GroundSurface);
            iou(lod0.area(), ground.area(), ground.intersection(&lod0).area()) >= EQUAL
        };
        let (v1, v2) = (volume(&lods.lod1), volume(&lods.lod2));
        Some([on(&lods.lod1), on(&lods.lod2), (v1 - v2).abs() <= VOLUME * v2])
    };
    let each: Vec<[bool; 3]> = model.buildings.par_iter().filter_map(one).collect();
    let share = |k: usize| ratio(each.iter().filter(|e| e[k]).count() as f64, each.len() as f64);
    Coherence { complete: each.len(), lod1_on_lod0: share(0), lod2_on_lod0: share(1), volumes: share(2) }
}
