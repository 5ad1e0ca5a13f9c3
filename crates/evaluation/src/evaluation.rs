//! All metrics of a result against the truth.

use crate::agreement::Agreement;
use crate::budget::check_samples;
use crate::city::City;
use crate::coherence::{Coherence, coherence};
use crate::complexity::{Complexity, complexity};
use crate::distances::{Distances, Furthest, distances, mesh_near};
use crate::error::positive;
use crate::footprints::{Footprints, footprints, match_blocks};
use crate::labels::{LabelRasters, Labels, labels};
use crate::objects::{COVERED, Coverage, Detection, detection};
use crate::planes::RoofPlanes;
use crate::regularity::{Regularity, regularity};
use crate::roofs::{RoofFit, Roofs, roof_fits, roofs};
use crate::terrain::{TerrainFit, terrain};
use crate::validity::{Validity, validity};
use crate::{Error, table};
use gable_city_model::CityModel;
use gable_city_model::validate::Tolerances;
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
        Self { roof_step: 0.25, density: 2.0, seed: 1 }
    }
}

/// What is measured against what. Models may have different origins.
pub struct Inputs<'a> {
    /// The truth, with LOD0 and LOD2 (LOD1 where there is no LOD2).
    pub truth: &'a CityModel,
    /// The result to judge.
    pub result: &'a CityModel,
    /// Triangles of the mesh that the result was made from, in the truth's local frame. Read once; only those near
    /// buildings are kept.
    pub mesh: Option<Box<dyn Iterator<Item = [DVec3; 3]> + 'a>>,
    /// Labels of pixels.
    pub labels: Option<LabelRasters<'a>>,
    /// The same city, made with another grid of blocks or other threads.
    pub again: Option<&'a CityModel>,
}

impl<'a> Inputs<'a> {
    /// Two models, without mesh and labels.
    #[must_use]
    pub fn new(truth: &'a CityModel, result: &'a CityModel) -> Self {
        Self { truth, result, mesh: None, labels: None, again: None }
    }
}

/// Every figure about a result. Lengths are metres, areas m², angles degrees, shares in [0, 1].
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
    /// Found buildings from 50 m² that the RMS from truth to model comes from most, the largest share first.
    pub furthest: Vec<Furthest>,
    /// Polygons, triangles and vertices.
    pub complexity: Complexity,
    /// Validity at val3dity's default tolerances.
    pub validity: Validity,
    /// Validity at strict tolerances (0.1 mm, 1 mm).
    pub validity_strict: Validity,
    /// Regularity of the truth.
    pub regularity_truth: Regularity,
    /// Regularity of the result.
    pub regularity: Regularity,
    /// Coherence of the result's levels of detail.
    pub coherence: Coherence,
    /// Fit of the terrain, where both models have one.
    pub terrain: Option<TerrainFit>,
    /// Labels of pixels, where given.
    pub labels: Option<Labels>,
    /// Agreement with another run, where given.
    pub agreement: Option<Agreement>,
}

impl Evaluation {
    /// The figures as text for a terminal.
    #[must_use]
    pub fn table(&self) -> String {
        table::text(&table::sections(self))
    }
}

/// Measures a result against the truth. Time is O(n log n) in what the models hold, the same on any number of threads.
///
/// # Errors
/// If the label rasters do not have the size that they say, a step or density is not positive, or a model is larger than any city.
pub fn evaluate(inputs: Inputs<'_>, options: &Options) -> Result<Evaluation, Error> {
    let Inputs { truth, result, mesh, labels: rasters, again } = inputs;
    positive("roof_step", options.roof_step)?;
    positive("density", options.density)?;
    let pair = Pair::new(truth, result, options)?;
    let Pair { truth: t, result: r, coverage, .. } = &pair;
    let matches = match_blocks(t, r);
    let uncovered = |city: &City<'_>, shares: &[f64]| {
        let lost = city.objects.iter().zip(shares).filter(|(o, s)| o.area >= 10.0 && **s < COVERED);
        lost.map(|(o, _)| o.building.id.clone()).collect()
    };
    let mesh = mesh.map(|m| mesh_near(m, &[t, r])).transpose()?;
    let origin = DVec3::from_array(truth.origin);
    let (distances, furthest) = distances(t, origin, r, coverage, mesh, options.density, options.seed);
    Ok(Evaluation {
        objects: AREA_CLASSES.map(|from| detection(t, r, coverage, from)).to_vec(),
        missed: uncovered(t, &coverage.truth),
        invented: uncovered(r, &coverage.result),
        footprints: footprints(t, r, &matches),
        roofs: roofs(t, r, &pair.fits, [&pair.planes[0], &pair.planes[1]], &matches),
        distances,
        furthest,
        complexity: complexity(t, r, &matches),
        validity: validity(result, &Tolerances::default()),
        validity_strict: validity(result, &Tolerances::strict()),
        regularity_truth: regularity(truth),
        regularity: regularity(result),
        coherence: coherence(result),
        terrain: terrain(truth, result, t, pair.shift),
        labels: rasters.map(|l| labels(&l)).transpose()?,
        agreement: again.map(|again| crate::agreement(result, again)).transpose()?,
    })
}

/// Truth and result made ready for measuring, and what several metrics and the report need of them.
pub(crate) struct Pair<'a> {
    pub(crate) truth: City<'a>,
    pub(crate) result: City<'a>,
    /// From the result's coordinates to the truth's.
    pub(crate) shift: DVec3,
    pub(crate) coverage: Coverage,
    pub(crate) planes: [RoofPlanes; 2],
    /// For each building of the truth.
    pub(crate) fits: Vec<RoofFit>,
}

impl<'a> Pair<'a> {
    pub(crate) fn new(truth: &'a CityModel, result: &'a CityModel, options: &Options) -> Result<Self, Error> {
        let shift = DVec3::from_array(result.origin) - DVec3::from_array(truth.origin);
        let (truth, result) = (City::new(truth, DVec3::ZERO)?, City::new(result, shift)?);
        check_samples(&truth, options.density)?;
        check_samples(&result, options.density)?;
        let coverage = Coverage::new(&truth, &result);
        let planes = [RoofPlanes::new(&truth), RoofPlanes::new(&result)];
        let fits = roof_fits(&truth, &result, [&planes[0], &planes[1]], options.roof_step);
        Ok(Self { truth, result, shift, coverage, planes, fits })
    }
}
