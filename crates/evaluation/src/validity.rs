//! Whether the solids are valid (ISO 19107, with val3dity's error codes).

use crate::statistics::ratio;
use gable_city_model::validate::{Tolerances, validate_building};
use gable_city_model::{Building, CityModel};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Validity at one set of tolerances. A building without solids of a LOD is not valid in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Validity {
    /// Buildings.
    pub buildings: usize,
    /// Share whose footprint and roof edge are valid surfaces (missing ones count as not valid).
    pub lod0: f64,
    /// Share whose LOD1 solids are all valid.
    pub lod1: f64,
    /// Share whose LOD2 solids are all valid.
    pub lod2: f64,
    /// Buildings without LOD2 solids.
    pub without_lod2: usize,
    /// How many buildings show each error code, in any LOD.
    pub codes: BTreeMap<u16, usize>,
}

pub(crate) fn validity(model: &CityModel, tolerances: &Tolerances) -> Validity {
    let one = |building: &Building| {
        let mut codes: Vec<u16> = Vec::new();
        let mut valid =
            [building.lods.footprint.is_some(), !building.lods.lod1.is_empty(), !building.lods.lod2.is_empty()];
        for found in validate_building(building, tolerances) {
            valid[usize::from(found.lod)] = false;
            codes.push(found.issue.code.number());
        }
        codes.sort_unstable();
        codes.dedup();
        (valid, codes)
    };
    let each: Vec<([bool; 3], Vec<u16>)> = model.buildings.par_iter().map(one).collect();
    let share = |lod: usize| ratio(each.iter().filter(|e| e.0[lod]).count() as f64, each.len() as f64);
    let mut codes = BTreeMap::new();
    for code in each.iter().flat_map(|e| &e.1) {
        *codes.entry(*code).or_default() += 1;
    }
    Validity {
        buildings: each.len(),
        lod0: share(0),
        lod1: share(1),
        lod2: share(2),
        without_lod2: model.buildings.iter().filter(|b| b.lods.lod2.is_empty()).count(),
        codes,
    }
}
