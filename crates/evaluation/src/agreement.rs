//! Whether two runs found the same buildings.

use crate::Error;
use crate::city::City;
use crate::region::iou;
use crate::statistics::ratio;
use gable_city_model::CityModel;
use gable_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Footprints with at least this intersection over union are the same.
const SAME: f64 = 0.98;

/// How much two models agree, building by building.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Identifiers that either model has.
    pub buildings: usize,
    /// Identifiers that both have.
    pub same_id: usize,
    /// Identifiers that both have, with footprints whose IoU is at least 0.98.
    pub same: usize,
    /// `same` / `buildings`; 1 if there are none.
    pub share: f64,
}

/// Compares two results for one city, such as those of two different grids of blocks.
///
/// # Errors
/// If a model is larger than any city.
pub fn agreement(a: &CityModel, b: &CityModel) -> Result<Agreement, Error> {
    let shift = DVec3::from_array(b.origin) - DVec3::from_array(a.origin);
    let (a, b) = (City::new(a, DVec3::ZERO)?, City::new(b, shift)?);
    let by_id: BTreeMap<&str, usize> = b.objects.iter().enumerate().map(|(i, o)| (o.building.id.as_str(), i)).collect();
    let (mut same_id, mut same) = (0, 0);
    for object in &a.objects {
        let Some(&other) = by_id.get(object.building.id.as_str()) else { continue };
        let other = &b.objects[other];
        same_id += 1;
        let shared = object.footprint.intersection(&other.footprint).area();
        same += usize::from(iou(object.area, other.area, shared) >= SAME);
    }
    let buildings = a.objects.len() + b.objects.len() - same_id;
    let share = if buildings == 0 { 1.0 } else { ratio(same as f64, buildings as f64) };
    Ok(Agreement { buildings, same_id, same, share })
}
