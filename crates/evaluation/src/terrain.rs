//! How well the ground fits.

use crate::city::City;
use crate::height_raster::{HeightRaster, NONE};
use crate::statistics::{Spread, mean};
use gable_city_model::{CityModel, Terrain};
use gable_geometry::{Box2, DVec3};
use serde::{Deserialize, Serialize};

/// Lattice of the comparison, metres.
const STEP: f64 = 1.0;

/// Heights of the result's terrain against the truth's, on a lattice of 1 m where both are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TerrainFit {
    /// Outside the truth's roofs, metres.
    pub open: Spread,
    /// Mean of result minus truth there, metres.
    pub open_bias: f64,
    /// Under the truth's roofs, where no camera sees the ground, metres.
    pub under_roofs: Spread,
}

pub(crate) fn terrain(truth: &CityModel, result: &CityModel, city: &City<'_>, shift: DVec3) -> Option<TerrainFit> {
    let (ours, theirs) = (truth.terrain.as_ref()?, result.terrain.as_ref()?);
    let bounds = |t: &Terrain, shift: DVec3| Box2::of(t.vertices.iter().map(|&p| (p + shift).truncate()));
    let (a, b) = (bounds(ours, DVec3::ZERO), bounds(theirs, shift));
    let shared = Box2 { min: a.min.max(b.min), max: a.max.min(b.max) };
    let draw = |terrain: &Terrain, shift: DVec3| {
        let mut raster = HeightRaster::covering(shared, STEP);
        raster.draw_terrain(terrain, shift);
        raster
    };
    let (ours, theirs) = (draw(ours, DVec3::ZERO), draw(theirs, shift));
    let mut roofs = HeightRaster::covering(shared, STEP);
    for facet in city.objects.iter().flat_map(|o| o.roof()) {
        roofs.draw(facet.corners, 0);
    }
    let (mut open, mut hidden) = (Vec::new(), Vec::new());
    for at in (0..ours.tag.len()).filter(|&at| ours.tag[at] != NONE && theirs.tag[at] != NONE) {
        let error = theirs.z[at] - ours.z[at];
        if roofs.tag[at] == NONE { open.push(error) } else { hidden.push(error) }
    }
    let absolute = |v: &[f64]| Spread::of(v.iter().map(|e| e.abs()).collect());
    Some(TerrainFit { open: absolute(&open), under_roofs: absolute(&hidden), open_bias: mean(open) })
}
