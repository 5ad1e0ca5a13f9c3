//! Models one building.

use crate::input::BuildingInput;
use crate::params::{Method, Params};
use crate::partition::Partition;
use crate::roof::{RoofType, round};
use crate::{gable, lods, zhu2018};
use gable_city_model::{Attributes, Lods, Value};
use gable_geometry::{Plane, Polygon};
use gable_ortho::{GridWindow, Raster};

/// A building as modelled, with what is known of how well it fits.
#[derive(Clone, Debug)]
pub struct BuildingModel {
    /// The geometries that hold.
    pub lods: Lods,
    /// Attributes with their units in the names.
    pub attributes: Attributes,
    /// Why an LOD is missing; `None` if none is.
    pub reason: Option<String>,
    /// Roof surfaces on the ground, each with its plane, in local metres.
    pub roofs: Vec<(Polygon, Plane)>,
    /// Footprint area, m².
    pub area: f64,
    /// Highest roof point above the ground, metres.
    pub height: f64,
    /// RMS of the vertical distances between the roof and the sampled surface, without the strip along the outline, metres.
    pub rmse: f64,
}

/// Models one building in LOD0, LOD1 and LOD2.
///
/// # Errors
/// A reason, for a user to read, if there is nothing to model: no pixel, or no roof above the ground.
pub fn model(input: &BuildingInput, params: &Params) -> Result<BuildingModel, String> {
    let base = ground_height(input).ok_or("the building has no pixel with a height")?;
    let completed = if params.method == Method::Gable { gable::completed(input) } else { None };
    let input = completed.as_ref().unwrap_or(input);
    let found = match params.method {
        Method::Gable => gable::reconstruct(input, base, params)?,
        Method::Zhu2018 => zhu2018::reconstruct(input, base, params)?,
    };
    let levels = lods::build(&found.partition, &found.planes, base, &params.tolerances);
    let roofs: Vec<(Polygon, Plane)> = found
        .partition
        .polygons()
        .into_iter()
        .zip(&found.planes)
        .flat_map(|(polygons, &plane)| polygons.into_iter().map(move |p| (p, plane)))
        .collect();
    let fit = Fit::of(input, &roofs);
    let ridge = ridge_height(&found.partition, &found.planes);
    let area: f64 = roofs.iter().map(|r| r.0.area()).sum();
    let mut model = BuildingModel {
        lods: levels.lods,
        attributes: Attributes::new(),
        reason: levels.reason,
        area,
        height: ridge - base,
        rmse: fit.rmse,
        roofs,
    };
    model.attributes = attributes(&model, &found.partition, &found.planes, base, &fit, params);
    Ok(model)
}

/// Height of the ground at the building: the lowest terrain along and inside the mask, without the lowest 2 %.
fn ground_height(input: &BuildingInput) -> Option<f64> {
    let inside = input.terrain.values().iter().zip(input.mask.values()).filter(|&(z, &m)| m && z.is_finite());
    let mut heights: Vec<f32> = inside.map(|(&z, _)| z).collect();
    heights.sort_by(f32::total_cmp);
    heights.get(heights.len() / 50).map(|&z| f64::from(z))
}

fn ridge_height(partition: &Partition, planes: &[Plane]) -> f64 {
    let height = |e: &crate::partition::Edge| planes[e.region].height(partition.vertices[e.from as usize]);
    partition.edges.iter().map(height).fold(f64::NEG_INFINITY, f64::max)
}

/// How the roof fits the sampled surface.
struct Fit {
    rmse: f64,
    /// Share of the footprint with a sampled surface.
    seen: f64,
}

/// Width of the strip along the outline that does not count for the fit, metres: there the sampled surface leans from the
/// roof to the ground, whatever the model.
const EDGE: f64 = 0.6;

impl Fit {
    fn of(input: &BuildingInput, roofs: &[(Polygon, Plane)]) -> Self {
        let window = input.window();
        let mut roof = Raster::filled(window, f64::NAN);
        for (polygon, plane) in roofs {
            let area = GridWindow::covering(polygon.bounds(), window.step).intersection(&window);
            for y in 0..area.height {
                for x in 0..area.width {
                    let at = area.centre(x, y);
                    if let Some(pixel) = window.pixel(at).filter(|_| polygon.contains(at)) {
                        roof[pixel] = plane.height(at);
                    }
                }
            }
        }
        let reach = (EDGE / window.step).ceil() as i64;
        let covered = |x: i64, y: i64| {
            let inside = x >= 0 && y >= 0 && x < window.width as i64 && y < window.height as i64;
            inside && roof[(x as usize, y as usize)].is_finite()
        };
        let (mut squares, mut inner, mut seen, mut count) = (0.0, 0usize, 0usize, 0usize);
        for (p, top) in roof.values().iter().enumerate().filter(|(_, top)| top.is_finite()) {
            let (x, y) = ((p % window.width) as i64, (p / window.width) as i64);
            let z = f64::from(input.height.values()[p]);
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
        Self { rmse: (squares / inner.max(1) as f64).sqrt(), seen: seen as f64 / count.max(1) as f64 }
    }
}

fn attributes(
    model: &BuildingModel,
    partition: &Partition,
    planes: &[Plane],
    base: f64,
    fit: &Fit,
    params: &Params,
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
    put("measured_height_m", number(model.height, 2));
    put("footprint_area_m2", number(model.area, 2));
    put("volume_m3", number(volume, 2));
    put("roof_type", Value::Text(RoofType::of(&weighted).name().to_owned()));
    put("rmse_m", number(fit.rmse, 3));
    put("completeness", number(fit.seen, 3));
    put("method", Value::Text(params.method.name().to_owned()));
    out
}
