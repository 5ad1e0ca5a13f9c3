//! All metrics of a result against the truth.

use crate::city::City;
use crate::complexity::{Complexity, complexity};
use crate::distances::{Distances, distances, mesh_near};
use crate::footprints::{Footprints, footprints, match_blocks};
use crate::objects::{COVERED, Coverage, Detection, detection};
use crate::planes::RoofPlanes;
use crate::roofs::{Roofs, roof_fits, roofs};
use gable_city_model::CityModel;
use gable_geometry::DVec3;
use serde::{Deserialize, Serialize};

/// Footprint areas from which buildings are counted, m².
pub const AREA_CLASSES: [f64; 3] = [0.0, 10.0, 50.0];

/// How finely is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Lattice of the roof samples, metres.
    pub roof_step: f64,
    /// Points for distances, to the square metre of surface.
    pub density: f64,
    /// Seed of those points.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { roof_step: 0.25, density: 4.0, seed: 1 }
    }
}

/// Every figure about a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Which buildings were found: all, from 10 m² and from 50 m².
    pub objects: Vec<Detection>,
    /// Buildings of the truth, from 10 m², that are not covered by half.
    pub missed: Vec<String>,
    /// Buildings of the result, from 10 m², that the truth does not cover by half.
    pub invented: Vec<String>,
    /// Fit of footprints.
    pub footprints: Footprints,
    /// Fit of roofs.
    pub roofs: Roofs,
    /// Distances between surfaces.
    pub distances: Distances,
    /// Polygons, triangles and vertices.
    pub complexity: Complexity,
}

/// Measures `result` against `truth`. `mesh` is the mesh that the result was made from, in the truth's local frame.
///
/// Models may have different origins. Time is O(n log n) in what they hold; a thousand buildings take a second or two.
pub fn evaluate(
    truth: &CityModel,
    result: &CityModel,
    mesh: Option<&mut dyn Iterator<Item = [DVec3; 3]>>,
    options: &Options,
) -> Evaluation {
    let shift = DVec3::from_array(result.origin) - DVec3::from_array(truth.origin);
    let (truth, result) = (City::new(truth, DVec3::ZERO), City::new(result, shift));
    let coverage = Coverage::new(&truth, &result);
    let matches = match_blocks(&truth, &result);
    let planes = [&RoofPlanes::new(&truth), &RoofPlanes::new(&result)];
    let fits = roof_fits(&truth, &result, planes, options.roof_step);
    let uncovered = |city: &City<'_>, shares: &[f64]| {
        let lost = city.objects.iter().zip(shares).filter(|(o, s)| o.area >= 10.0 && **s < COVERED);
        lost.map(|(o, _)| o.building.id.clone()).collect()
    };
    Evaluation {
        objects: AREA_CLASSES.map(|from| detection(&truth, &result, &coverage, from)).to_vec(),
        missed: uncovered(&truth, &coverage.truth),
        invented: uncovered(&result, &coverage.result),
        footprints: footprints(&truth, &result, &matches),
        roofs: roofs(&truth, &result, &fits, planes, &matches),
        distances: {
            let mesh = mesh.map(|m| mesh_near(m, [&truth, &result]));
            distances(&truth, &result, &coverage, mesh, options.density, options.seed)
        },
        complexity: complexity(&truth, &result, &matches),
    }
}
