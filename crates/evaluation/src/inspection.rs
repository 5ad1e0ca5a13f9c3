//! What can be said of a result without truth.

use crate::budget::check_samples;
use crate::city::City;
use crate::coherence::{Coherence, coherence};
use crate::complexity::{PerBuilding, Size, whole};
use crate::distances::{mesh_near, to_mesh};
use crate::error::positive;
use crate::regularity::{Regularity, regularity};
use crate::validity::{Validity, validity};
use crate::{Error, Options, Spread, table};
use gable_city_model::CityModel;
use gable_city_model::validate::Tolerances;
use gable_geometry::DVec3;
use serde::{Deserialize, Serialize};

/// The figures of a result for which there is no truth. Lengths are metres, shares in [0, 1].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inspection {
    /// Polygons, triangles and vertices.
    pub size: Size,
    /// Their means.
    pub per_building: PerBuilding,
    /// Distances from roofs and outer walls to the mesh (10 m at most, as in [`crate::Distances`]).
    pub model_to_mesh: Option<Spread>,
    /// The same from the roof surfaces of LOD2 alone.
    pub lod2_roofs_to_mesh: Option<Spread>,
    /// Validity at val3dity's default tolerances.
    pub validity: Validity,
    /// Validity at strict tolerances (0.1 mm, 1 mm).
    pub validity_strict: Validity,
    /// Regularity.
    pub regularity: Regularity,
    /// Coherence of the levels of detail.
    pub coherence: Coherence,
}

impl Inspection {
    /// The figures as text for a terminal.
    #[must_use]
    pub fn table(&self) -> String {
        table::text(&table::inspection(self))
    }
}

/// Measures a result by itself and, where one is given, against the mesh that it was made from: triangles in the result's local
/// frame. Time is O(n log n).
///
/// # Errors
/// If the density is not positive, or the model or the mesh is larger than any city.
pub fn inspect(
    result: &CityModel,
    mesh: Option<Box<dyn Iterator<Item = [DVec3; 3]> + '_>>,
    options: &Options,
) -> Result<Inspection, Error> {
    positive("density", options.density)?;
    let city = City::new(result, DVec3::ZERO)?;
    check_samples(&city, options.density)?;
    let (size, per_building) = whole(&city);
    let near = mesh.map(|m| mesh_near(m, &[&city])).transpose()?;
    let distances = near.map(|near| to_mesh(&city, near, options.density, options.seed));
    Ok(Inspection {
        size,
        per_building,
        model_to_mesh: distances.map(|d| d[0]),
        lod2_roofs_to_mesh: distances.map(|d| d[1]),
        validity: validity(result, &Tolerances::default()),
        validity_strict: validity(result, &Tolerances::strict()),
        regularity: regularity(result),
        coherence: coherence(result),
    })
}
