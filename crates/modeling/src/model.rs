//! Models a connected component.

use crate::fill::pixels_inside;
use crate::input::BuildingInput;
use crate::methods::Reconstruction;
use crate::params::ModelParams;
use crate::partition::Partition;
use crate::reason::Reason;
use crate::roof::{RoofType, round};
use crate::roof_partition::RoofPartition;
use crate::{lods, party_walls, work};
use gable_city_model::{Attributes, Lods, Value};
use gable_geometry::{Box2, Plane, Polygon};
use gable_parameters::Settings;
use gable_raster::{GridWindow, Raster};

/// A building as modelled, with what is known of how well it fits.
#[derive(Clone, Debug)]
pub struct BuildingModel {
    /// The geometries that hold.
    pub lods: Lods,
    /// Attributes with their units in the names.
    pub attributes: Attributes,
    /// Why an LOD is missing; `None` if none is.
    pub reason: Option<Reason>,
    /// How the model is simpler than the building, and why; `None` if it is not.
    pub note: Option<String>,
    /// Roof surfaces on the ground, each with its plane, in local metres.
    pub roofs: Vec<(Polygon, Plane)>,
    /// Footprint area, m².
    pub area: f64,
    /// Highest roof point above the ground, metres.
    pub height: f64,
    /// Pixels of the mask that were seen and that the roof covers, on the smallest window. No pixel is another building's.
    pub pixels: Raster<bool>,
    /// RMS of the vertical distances between the roof and the sampled surface, without the strip along the outline, metres.
    pub rmse: f64,
}

/// Models a connected component in LOD0, LOD1 and LOD2 by one method: one building, or several that steps in the roof divide
/// (`party_wall_step`). `settings` are values of the method's own parameters.
///
/// # Errors
/// The reason if there is nothing to model, such as no pixel with a height or no roof above the ground.
pub fn model(
    input: &BuildingInput,
    method: &dyn Reconstruction,
    settings: &Settings,
    params: &ModelParams,
) -> Result<Vec<BuildingModel>, Reason> {
    let base = ground_height(input, &input.mask).ok_or(Reason::NoHeights)?;
    let seen = &input.mask;
    let completed = method.completed(input);
    let input = completed.as_ref().unwrap_or(input);
    let pixels = input.mask.values().iter().filter(|&&inside| inside).count();
    let found = method.reconstruct(input, base, work::most(pixels, params.work), settings)?;
    let one = |found: &RoofPartition| {
        let mut model = building(input, found, base, method.name(), params);
        // What is completed under a crown may be completed on both sides of it.
        let seen = seen.crop(model.pixels.window(), false);
        model.pixels.values_mut().iter_mut().zip(seen.values()).for_each(|(pixel, seen)| *pixel &= seen);
        model
    };
    if params.party_wall_step <= 0.0 {
        return Ok(vec![one(&found)]);
    }
    let buildings = party_walls::buildings(&found.partition, &found.planes, params.party_wall_step);
    if buildings.len() < 2 {
        return Ok(vec![one(&found)]);
    }
    Ok(found.parts(&buildings).iter().map(one).collect())
}

/// One building over ground at `base`, or higher where the ground at the building is higher.
fn building(
    input: &BuildingInput,
    found: &RoofPartition,
    base: f64,
    method: &str,
    params: &ModelParams,
) -> BuildingModel {
    let RoofPartition { partition, planes, .. } = found;
    let roofs: Vec<(Polygon, Plane)> = partition
        .polygons()
        .into_iter()
        .zip(planes)
        .flat_map(|(polygons, &plane)| polygons.into_iter().map(move |p| (p, plane)))
        .collect();
    let covered = Covered::by(input, &roofs);
    let ground = ground_height(input, &covered.pixels).unwrap_or(base);
    let base = ground.min(lowest_roof(partition, planes) - LOWEST_EAVE).max(base);
    let pixels = covered.pixels.values().iter().filter(|&&covered| covered).count();
    let levels = lods::build(partition, planes, base, &params.tolerances, work::most(pixels, params.work));
    let ridge = ridge_height(partition, planes);
    let area: f64 = roofs.iter().map(|r| r.0.area()).sum();
    let mut model = BuildingModel {
        lods: levels.lods,
        attributes: Attributes::new(),
        reason: levels.reason,
        note: found.note.clone(),
        area,
        height: ridge - base,
        rmse: covered.rmse,
        roofs,
        pixels: covered.pixels,
    };
    model.attributes = attributes(&model, partition, planes, base, covered.seen, method);
    model
}

/// A roof stands at least so far above the underside, metres.
pub(crate) const LOWEST_EAVE: f64 = 0.5;

/// Height of the ground at a building: the lowest terrain on its pixels, without the lowest 2 %.
fn ground_height(input: &BuildingInput, pixels: &Raster<bool>) -> Option<f64> {
    let window = pixels.window();
    let terrain = input.terrain.crop(window, f32::NAN);
    let inside = terrain.values().iter().zip(pixels.values()).filter(|&(z, &m)| m && z.is_finite());
    let mut heights: Vec<f32> = inside.map(|(&z, _)| z).collect();
    heights.sort_by(f32::total_cmp);
    heights.get(heights.len() / 50).map(|&z| f64::from(z))
}

fn roof_heights(partition: &Partition, planes: &[Plane]) -> impl Iterator<Item = f64> {
    partition.edges.iter().map(|e| planes[e.region].height(partition.vertices[e.from as usize]))
}

fn ridge_height(partition: &Partition, planes: &[Plane]) -> f64 {
    roof_heights(partition, planes).fold(f64::NEG_INFINITY, f64::max)
}

fn lowest_roof(partition: &Partition, planes: &[Plane]) -> f64 {
    roof_heights(partition, planes).fold(f64::INFINITY, f64::min)
}

/// What a roof covers, and how it fits the sampled surface there.
struct Covered {
    /// Pixels of the mask under the roof, on the smallest window.
    pixels: Raster<bool>,
    /// See [`BuildingModel::rmse`].
    rmse: f64,
    /// Share of what the roof covers with a sampled surface.
    seen: f64,
}

/// Width of the strip along the outline that does not count for the fit, metres: there the sampled surface leans from the
/// roof to the ground, whatever the model.
const EDGE: f64 = 0.6;

impl Covered {
    fn by(input: &BuildingInput, roofs: &[(Polygon, Plane)]) -> Self {
        let step = input.window().step;
        let bounds = Box2::of(roofs.iter().flat_map(|(p, _)| [p.bounds().min, p.bounds().max]));
        let window = GridWindow::covering(bounds, step).intersection(&input.window());
        let (height, mask) = (input.height.crop(window, f32::NAN), input.mask.crop(window, false));
        let mut roof = Raster::filled(window, f64::NAN);
        for (polygon, plane) in roofs {
            let area = GridWindow::covering(polygon.bounds(), step).intersection(&window);
            pixels_inside(polygon, area, |x, y| {
                let at = area.centre(x, y);
                if let Some(pixel) = window.pixel(at) {
                    roof[pixel] = plane.height(at);
                }
            });
        }
        let reach = (EDGE / step).ceil() as i64;
        let covered = |x: i64, y: i64| {
            let inside = x >= 0 && y >= 0 && x < window.width as i64 && y < window.height as i64;
            inside && roof[(x as usize, y as usize)].is_finite()
        };
        let (mut squares, mut inner, mut seen, mut count) = (0.0, 0usize, 0usize, 0usize);
        let mut pixels = Raster::filled(window, false);
        for (p, top) in roof.values().iter().enumerate().filter(|(_, top)| top.is_finite()) {
            let (x, y) = ((p % window.width) as i64, (p / window.width) as i64);
            let z = f64::from(height.values()[p]);
            pixels.values_mut()[p] = mask.values()[p];
            count += 1;
            if !z.is_finite() {
                continue;
            }
            seen += 1;
            if [(reach, 0), (-reach, 0), (0, reach), (0, -reach)].iter().all(|(dx, dy)| covered(x + dx, y + dy)) {
                inner += 1;
                squares += (z - top).powi(2);
            }
        }
        Self { pixels, rmse: (squares / inner.max(1) as f64).sqrt(), seen: seen as f64 / count.max(1) as f64 }
    }
}

fn attributes(
    model: &BuildingModel,
    partition: &Partition,
    planes: &[Plane],
    base: f64,
    seen: f64,
    method: &str,
) -> Attributes {
    let number = |v: f64, digits: i32| Value::Number(round(v, digits));
    let areas = partition.areas();
    let weighted: Vec<(Plane, f64)> = planes.iter().copied().zip(areas).collect();
    let volume: f64 = model
        .lods
        .lod2
        .iter()
        .chain(model.lods.lod1.iter().filter(|_| model.lods.lod2.is_empty()))
        .map(gable_city_model::Shell::volume)
        .sum();
    let mut out = Attributes::new();
    let mut put = |name: &str, value: Value| out.insert(name.to_owned(), value);
    put("ground_height_m", number(base, 2));
    put("eave_height_m", number(lods::eave_height(partition, planes), 2));
    put("ridge_height_m", number(base + model.height, 2));
    // The names that CityGML and CityJSON have for them.
    put("measuredHeight", number(model.height, 2));
    put("footprint_area_m2", number(model.area, 2));
    put("volume_m3", number(volume, 2));
    put("roofType", Value::Text(RoofType::of(&weighted).name().to_owned()));
    put("rmse_m", number(model.rmse, 3));
    put("completeness", number(seen, 3));
    put("method", Value::Text(method.to_owned()));
    out
}
