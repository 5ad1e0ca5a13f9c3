//! Models every building, whole, from the mosaic; artefacts by the tile that owns it.

use super::stitch::Task;
use super::{Context, prepare};
use crate::artefact;
use crate::failure::{Failures, guarded, is_local};
use crate::known::Known;
use crate::mosaic::Mosaic;
use crate::params::Method;
use crate::stages::segment::Labelled;
use crate::stages::split::Blocks;
use crate::summary::{BuildingRecord, Lod};
use crate::{PipelineError, Stage};
use gable_city_model::{Building, Tolerances, Value};
use gable_geometry::{Box2, DVec3, Frame};
use gable_modeling::{BuildingInput, BuildingModel};
use gable_ortho::{GridWindow, Orthograph, Raster, steep_facets};
use gable_segmentation::{Label, Terrain};
use gable_stitching::TileComponents;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A building of a tile, written or not, with its record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Modelled {
    pub(crate) building: Building,
    pub(crate) record: BuildingRecord,
    /// Roof surfaces for the pictures: outer rings in local metres, with the number of the plane.
    pub(crate) roofs: Vec<Vec<[f64; 2]>>,
}

/// Where what was modelled lies.
pub(crate) struct Tile {
    pub(crate) ix: u32,
    pub(crate) iy: u32,
    pub(crate) path: std::path::PathBuf,
}

/// Models all buildings. Each belongs to the tile that holds its centroid.
pub(crate) fn model(
    context: &Context<'_>,
    blocks: &Blocks,
    ortho: &Mosaic<Orthograph>,
    labelled: &Labelled,
    terrain: &Terrain,
    tasks: &[Task],
    failures: &Failures,
    photographed: bool,
) -> Result<Vec<Tile>, PipelineError> {
    let mut owned: BTreeMap<(u32, u32), Vec<&Task>> = BTreeMap::new();
    for task in tasks {
        owned.entry(blocks.owner(task.centroid)).or_default().push(task);
    }
    context.observer.stage(Stage::Model, tasks.len());
    let roofs = context.params.modeling.roofs.as_deref();
    let roofs = roofs.map(|path| Known::read(path, blocks.frame())).transpose()?;
    owned
        .into_par_iter()
        .map(|((iy, ix), tasks)| {
            let path = context.workspace.path(&format!("models/{ix}_{iy}.json"));
            if artefact::whole_json::<Vec<Modelled>>(&path)?.is_some_and(|made| made.len() == tasks.len()) {
                tasks.iter().for_each(|t| context.observer.done(Stage::Model, &t.id));
                return Ok(Tile { ix, iy, path });
            }
            let modelled: Vec<Modelled> = tasks
                .par_iter()
                .map(|task| {
                    context.check_cancelled()?;
                    // A fault in one building must not cost the city: it becomes that building's reason.
                    let made = guarded(Stage::Model, &task.id, || {
                        one(context, blocks, ortho, labelled, terrain, roofs.as_ref(), task, photographed)
                    });
                    let made = match made {
                        Err(error) if is_local(&error) => Err(error.to_string()),
                        other => other?,
                    };
                    context.observer.done(Stage::Model, &task.id);
                    let step = context.params.sampling.step;
                    let note = failures.note(blocks, task.whole.window(step));
                    Ok(record(task, made, [ix, iy], blocks.frame(), step, note))
                })
                .collect::<Result<_, PipelineError>>()?;
            artefact::write_json(&path, &modelled)?;
            Ok(Tile { ix, iy, path })
        })
        .collect()
}

/// Reads what was modelled for a tile.
pub(crate) fn read(tile: &Tile) -> Result<Vec<Modelled>, PipelineError> {
    let gone = || PipelineError::Artefact { path: tile.path.clone(), reason: "the file is gone".to_owned() };
    artefact::read_json(&tile.path)?.ok_or_else(gone)
}

/// One building: a model, or the reason why there is none.
fn one(
    context: &Context<'_>,
    blocks: &Blocks,
    ortho: &Mosaic<Orthograph>,
    labelled: &Labelled,
    terrain: &Terrain,
    roofs: Option<&Known>,
    task: &Task,
    photographed: bool,
) -> Result<Result<BuildingModel, String>, PipelineError> {
    let step = context.params.sampling.step;
    let inner = task.whole.window(step);
    let window = inner.grown((gable_modeling::MARGIN / step).ceil() as usize);
    let maps = prepare::read(ortho, window)?;
    let labels = labelled.read(inner)?;
    let mask = if let Some(footprint) = &task.footprint {
        let mut inside = Raster::filled(inner, false);
        footprint.draw(&mut inside);
        for (inside, &label) in inside.values_mut().iter_mut().zip(labels.values()) {
            *inside &= label == Label::Building as u8;
        }
        if !inside.values().contains(&true) {
            return Ok(Err("nothing of the mesh lies in its footprint".to_owned()));
        }
        inside
    } else if let Some(mask) = mask(&labels, task) {
        mask
    } else {
        return Ok(Err("its pixels are not where they were when it was found".to_owned()));
    };
    let mask = mask.crop(window, false);
    let input = BuildingInput {
        roof: roofs.and_then(|known| known.roof(&mask)),
        mask,
        terrain: terrain.raster(window),
        normal: maps.normal,
        colour: photographed.then_some(maps.colour),
        walls: maps.walls,
        height: maps.height,
        facets: if context.params.modeling.method == Method::Zhu2018 { facets(blocks, window)? } else { Vec::new() },
    };
    Ok(gable_modeling::model(&input, &params(context)))
}

/// The steep facets of all blocks on a window. Block files are read again for each building, which only the published
/// method pays for.
fn facets(blocks: &Blocks, window: GridWindow) -> Result<Vec<[DVec3; 3]>, PipelineError> {
    let bounds = window.bounds();
    let mut out = Vec::new();
    for (ix, iy) in blocks.with_data() {
        let Some(core) = blocks.core(ix, iy).map(|w| w.bounds()).filter(|b| b.intersects(&bounds)) else { continue };
        let unit = format!("{ix}_{iy}");
        let mesh = blocks.read(ix, iy).map_err(|e| PipelineError::Stage {
            stage: Stage::Model,
            unit,
            reason: e.to_string(),
        })?;
        let area = Box2 { min: core.min.max(bounds.min), max: core.max.min(bounds.max) };
        out.extend(steep_facets(&mesh, area, WALL_ANGLE).into_iter().map(|f| f.corners));
    }
    Ok(out)
}

/// Facets within this angle of the vertical are handed to the published method, radians (25°).
const WALL_ANGLE: f64 = 0.436;

/// The pixels of a building: the component of the labels inside its window that has its moments.
fn mask(labels: &Raster<u8>, task: &Task) -> Option<Raster<bool>> {
    let (components, marks) = TileComponents::of(labels, |&l| l == Label::Building as u8);
    let number = components.components.iter().position(|c| *c == task.whole.extent)? as u32 + 1;
    Some(marks.map(|&m| m == number))
}

fn params(context: &Context<'_>) -> gable_modeling::Params {
    let given = &context.params.modeling;
    let valid = &context.params.validation;
    gable_modeling::Params {
        method: match given.method {
            Method::Gable => gable_modeling::Method::Gable,
            Method::Zhu2018 => gable_modeling::Method::Zhu2018,
        },
        facade_angle: given.facade_angle,
        plane_distance: given.plane_distance,
        plane_angle: given.plane_angle,
        plane_area: given.plane_area,
        max_planes: given.max_planes,
        line_length: given.line_length,
        collinear: given.collinear,
        extension: given.extension,
        min_cell_area: given.min_cell_area,
        superstructure_area: given.superstructure_area,
        beta: given.beta,
        beta_pixel: given.beta_pixel,
        min_height: context.params.segmentation.min_height,
        tolerances: Tolerances { snap: valid.snap, planarity: valid.planarity, normals_deg: valid.normals },
    }
}

fn record(
    task: &Task,
    made: Result<BuildingModel, String>,
    tile: [u32; 2],
    frame: &Frame,
    step: f64,
    note: Option<String>,
) -> Modelled {
    let bounds = task.whole.window(step).bounds();
    let [ox, oy, _] = frame.origin;
    let bbox = [bounds.min.x + ox, bounds.min.y + oy, bounds.max.x + ox, bounds.max.y + oy];
    let mut building = Building { id: task.id.clone(), attributes: BTreeMap::new(), lods: Default::default() };
    let mut record = BuildingRecord {
        id: task.id.clone(),
        tile,
        bbox,
        lod: Lod::None,
        reason: None,
        note,
        roof_type: None,
        area_m2: task.whole.area(step),
        height_m: 0.0,
        rmse_m: None,
        faces: 0,
    };
    let mut roofs = Vec::new();
    match made {
        Err(reason) => record.reason = Some(reason),
        Ok(model) => {
            let lods = model.lods;
            let faces = |shells: &[gable_city_model::Shell]| shells.iter().map(|s| s.faces.len() as u32).sum();
            (record.lod, record.faces) = if !lods.lod2.is_empty() {
                (Lod::Lod2, faces(&lods.lod2))
            } else if !lods.lod1.is_empty() {
                (Lod::Lod1, faces(&lods.lod1))
            } else if let Some(footprint) = &lods.footprint {
                (Lod::Lod0, footprint.faces.len() as u32)
            } else {
                (Lod::None, 0)
            };
            record.reason = model.reason;
            record.area_m2 = model.area;
            record.height_m = model.height;
            record.rmse_m = Some(model.rmse);
            building.attributes = model.attributes;
            record.roof_type = match building.attributes.get("roof_type") {
                Some(Value::Text(name)) => Some(name.clone()),
                _ => None,
            };
            if let Some(note) = &record.note {
                building.attributes.insert("note".to_owned(), Value::Text(note.clone()));
            }
            building.attributes.insert("block".to_owned(), Value::Text(format!("{}_{}", tile[0], tile[1])));
            building.lods = lods;
            roofs = model.roofs.iter().map(|(p, _)| p.outer.iter().map(|v| v.to_array()).collect()).collect();
        }
    }
    Modelled { building, record, roofs }
}
