//! What models may have at most to be measured. Generous; each is checked before what it limits is made, so that a few wrong numbers
//! in a file are an error and do not fill the memory.

use crate::Error;
use crate::city::City;
use gable_city_model::{CityModel, Shell};
use gable_geometry::{Box2, DVec3};

/// Longest side of a building in plan, metres: longer than any airport.
const BUILDING: f64 = 3_000.0;
/// Cells of 1 m² of the box around a terrain: 16 km × 16 km.
const TERRAIN_CELLS: f64 = 268_435_456.0;
/// Points on all surfaces of a model: at two to the square metre, 100 km² of roofs and walls.
const SAMPLES: f64 = 2e8;
/// Pairs of buildings whose boxes overlap.
pub(crate) const NEIGHBOURS: usize = 100_000_000;
/// Cells of 16 m² of the box around all buildings: 65 km × 65 km.
pub(crate) const MASK_CELLS: f64 = 268_435_456.0;
/// Area of a triangle of a mesh, m².
pub(crate) const MESH_TRIANGLE: f64 = 1e6;

/// Refuses what no city has.
pub(crate) fn check(model: &CityModel) -> Result<(), Error> {
    for building in &model.buildings {
        let lods = &building.lods;
        let flat = [&lods.footprint, &lods.roof_edge].into_iter().flatten();
        let shells: Vec<&Shell> = flat.chain(&lods.lod1).chain(&lods.lod2).collect();
        let plan = Box2::of(shells.iter().flat_map(|shell| &shell.vertices).map(|p| p.truncate()));
        let side = plan.size().max_element();
        if !plan.is_empty() && (side > BUILDING || side.is_nan()) {
            let what = format!(
                "building {:?} measures {:.0} × {:.0} m, more than the {BUILDING} m that are measured",
                building.id,
                plan.size().x,
                plan.size().y
            );
            return Err(Error::NoCity { what });
        }
    }
    let terrain = model.terrain.iter().flat_map(|terrain| &terrain.vertices);
    let plan = Box2::of(terrain.map(|p| p.truncate()));
    let cells = (plan.size().x + 2.0) * (plan.size().y + 2.0);
    if !plan.is_empty() && (cells > TERRAIN_CELLS || cells.is_nan()) {
        let (width, height) = (plan.size().x / 1e3, plan.size().y / 1e3);
        let what = format!("the terrain measures {width:.1} × {height:.1} km, more than can be measured at once");
        return Err(Error::NoCity { what });
    }
    Ok(())
}

/// Refuses surfaces on which more points would be laid than there is room for.
pub(crate) fn check_samples(city: &City<'_>, density: f64) -> Result<(), Error> {
    let area: f64 = city.objects.iter().flat_map(|object| &object.facets).map(|facet| area(facet.corners)).sum();
    if area * density <= SAMPLES {
        return Ok(());
    }
    let what = format!(
        "the buildings have {:.1} km² of surface, more than is measured at {density} points to the square metre",
        area / 1e6
    );
    Err(Error::NoCity { what })
}

/// Area of a triangle, m².
pub(crate) fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
