//! Models every building, whole, from the mosaic; artefacts by the tile that owns it.

use super::stitch::Task;
use super::{Context, prepare};
use crate::artefact::{self, LabelTile};
use crate::budget::BUILDING_PIXELS;
use crate::failure::{Failures, guarded, is_local};
use crate::known::Known;
use crate::mosaic::Mosaic;
use crate::params::Params;
use crate::stages::split::Blocks;
use crate::summary::{BuildingRecord, Lod};
use crate::{PipelineError, Stage};
use gable_city_model::{Building, Tolerances, Value};
use gable_geometry::{Box2, DVec3, Frame};
use gable_modeling::{BuildingInput, BuildingModel, MARGIN, ModelParams, Reason};
use gable_ortho::{Orthograph, steep_facets};
use gable_raster::{GridWindow, Raster};
use gable_segmentation::{Evidence, Label, Terrain};
use gable_stitching::{TileComponents, part_id};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// A building of a tile, written or not, with its record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Modelled {
    /// The task that it came from: what hangs together.
    pub(crate) task: String,
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

/// What the buildings of a city are modelled from.
pub(crate) struct Modeller<'a> {
    pub(crate) blocks: &'a Blocks,
    pub(crate) ortho: &'a Mosaic<Orthograph>,
    pub(crate) labels: &'a Mosaic<LabelTile>,
    pub(crate) terrain: &'a Terrain,
    /// Footprints, where they were given.
    pub(crate) footprints: Option<&'a Known>,
    /// Roof planes, where they were given.
    pub(crate) roofs: Option<&'a Known>,
    /// Whether the mesh has photographs.
    pub(crate) photographed: bool,
}

/// The buildings by the row and column of the tile that owns each: the one that holds its centroid.
pub(crate) fn owned<'a>(blocks: &Blocks, tasks: &'a [Task], step: f64) -> BTreeMap<(u32, u32), Vec<&'a Task>> {
    let mut owned: BTreeMap<(u32, u32), Vec<&Task>> = BTreeMap::new();
    for task in tasks {
        owned.entry(blocks.owner(task.centroid(step))).or_default().push(task);
    }
    owned
}

/// Where the models of a tile lie.
pub(crate) fn model_file(ix: u32, iy: u32) -> String {
    format!("models/{ix}_{iy}.json")
}

/// The roof planes that are given for an experiment.
pub(crate) fn known_roofs(context: &Context<'_>, frame: &Frame) -> Result<Option<Known>, PipelineError> {
    context.params.modeling.roofs.as_deref().map(|path| Known::read(path, frame, context)).transpose()
}

/// A building with more than one part in this of all pixels is large.
const LARGE: usize = 100;

/// Models all buildings, tile after tile, so that neighbours find in memory what they read. Tiles with a building that is a large
/// share of all come first: no thread is left with it at the end.
pub(crate) fn model(
    context: &Context<'_>,
    modeller: &Modeller<'_>,
    tasks: &[Task],
    failures: &Failures,
) -> Result<Vec<Tile>, PipelineError> {
    let step = context.params.sampling.step;
    context.observer.stage(Stage::Model, tasks.len());
    let mut owned: Vec<_> = owned(modeller.blocks, tasks, step).into_iter().collect();
    let size = |task: &Task| task.window(step).len();
    let all: usize = tasks.iter().map(size).sum();
    let large = |tasks: &[&Task]| tasks.iter().map(|task| size(task)).filter(|size| size * LARGE > all).max();
    owned.sort_by_key(|(_, tasks)| Reverse(large(tasks)));
    let tiles: Result<Vec<Tile>, PipelineError> = owned
        .into_iter()
        .par_bridge()
        .map(|((iy, ix), tasks)| {
            let path = context.workspace.path(&model_file(ix, iy));
            if artefact::whole_json::<Vec<Modelled>>(&path)?.is_some_and(|made| is_of(&made, &tasks)) {
                tasks.iter().for_each(|t| context.observer.done(Stage::Model, &t.id));
                return Ok(Tile { ix, iy, path });
            }
            let noted: Vec<_> =
                tasks.iter().map(|task| (*task, failures.note(modeller.blocks, task.window(step)))).collect();
            artefact::write_json(&path, &modeller.tile(context, [ix, iy], &noted)?)?;
            Ok(Tile { ix, iy, path })
        })
        .collect();
    let mut tiles = tiles?;
    tiles.sort_by_key(|tile| (tile.iy, tile.ix));
    Ok(tiles)
}

/// Whether what was modelled is that of these tasks.
fn is_of(made: &[Modelled], tasks: &[&Task]) -> bool {
    let made: BTreeSet<&str> = made.iter().map(|m| m.task.as_str()).collect();
    made == tasks.iter().map(|t| t.id.as_str()).collect()
}

impl Modeller<'_> {
    /// The models of the buildings that a tile owns, each with what else has to be known of it.
    pub(crate) fn tile(
        &self,
        context: &Context<'_>,
        tile: [u32; 2],
        tasks: &[(&Task, Option<String>)],
    ) -> Result<Vec<Modelled>, PipelineError> {
        let step = context.params.sampling.step;
        let made: Vec<Vec<Modelled>> = tasks
            .par_iter()
            .map(|(task, note)| {
                context.check_cancelled()?;
                // A fault in one building must not cost the city: it becomes that building's reason.
                let made = guarded(Stage::Model, &task.id, || self.reconstructed(context, task));
                let made = match made {
                    Err(error) if is_local(&error) => Err(Reason::Fault(error.to_string())),
                    other => other?,
                };
                context.observer.done(Stage::Model, &task.id);
                let record = |id, made| {
                    let mut modelled = record(task, id, made, tile, self.blocks.frame(), step, note.clone());
                    // What is measured holds against what is told.
                    for (name, value) in self.told(task) {
                        modelled.building.attributes.entry(name.clone()).or_insert_with(|| value.clone());
                    }
                    modelled
                };
                Ok(match made {
                    Err(reason) => vec![record(task.id.clone(), Err(reason))],
                    Ok(models) => {
                        let ids = self.ids(task, &models);
                        models.into_iter().zip(ids).map(|(model, id)| record(id, Ok(model))).collect()
                    }
                })
            })
            .collect::<Result<_, PipelineError>>()?;
        Ok(made.into_iter().flatten().collect())
    }

    /// What its footprint tells of a building.
    fn told(&self, task: &Task) -> impl Iterator<Item = (&String, &Value)> {
        let footprint = task.footprint.and_then(|number| self.footprints?.footprints.get(number));
        footprint.into_iter().flat_map(|footprint| &footprint.attributes)
    }

    /// Identifiers of the buildings of a task: after a square metre that each fills. Those that are too narrow for that, and
    /// those whose footprint was given, are named after the task.
    fn ids(&self, task: &Task, models: &[BuildingModel]) -> Vec<String> {
        let id = |(n, model): (usize, &BuildingModel)| match part_id(&model.pixels, self.blocks.frame()) {
            Some(id) if task.footprint.is_none() => id,
            _ if models.len() == 1 => task.id.clone(),
            _ => format!("{}-{}", task.id, n + 1),
        };
        models.iter().enumerate().map(id).collect()
    }

    /// The buildings of one task, or the reason why there is none.
    fn reconstructed(
        &self,
        context: &Context<'_>,
        task: &Task,
    ) -> Result<Result<Vec<BuildingModel>, Reason>, PipelineError> {
        let (method, settings) = context.params.reconstruction()?;
        let inner = task.window(context.params.sampling.step);
        let whole = seen_by(context.params, inner)?;
        if whole.width.saturating_mul(whole.height) > BUILDING_PIXELS {
            let (width, height) = (inner.width as f64 * inner.step, inner.height as f64 * inner.step);
            return Ok(Err(Reason::TooLarge { width, height }));
        }
        let all_around = self.labels.read(whole)?.0;
        let labels = all_around.crop(inner, Label::Ground as u8);
        let known = |number: usize| self.footprints.and_then(|known| known.footprints.get(number));
        let mask = if let Some(number) = task.footprint {
            let Some(footprint) = known(number) else {
                return Ok(Err(Reason::Moved("its footprint")));
            };
            let mut inside = Raster::filled(inner, false);
            footprint.draw(&mut inside);
            for (inside, &label) in inside.values_mut().iter_mut().zip(labels.values()) {
                *inside &= label == Label::Building as u8;
            }
            if !inside.values().contains(&true) {
                return Ok(Err(Reason::EmptyFootprint));
            }
            inside
        } else if let Some(mask) = mask(&labels, task) {
            mask
        } else {
            return Ok(Err(Reason::Moved("one of its pixels")));
        };
        // A known footprint ends where it ends, whatever hangs over it.
        let may_be_hidden = task.footprint.is_none() && is_beside_crown(&mask, &all_around);
        // What no crown hides needs its nearest surroundings only.
        let window = if may_be_hidden { whole } else { grown(inner, method.reach()) };
        let mask = mask.crop(window, false);
        let around = all_around.crop(window, Label::Ground as u8);
        let crowns = around.map(|&label| task.footprint.is_none() && label == Label::Tree as u8);
        let maps = prepare::read(self.ortho, window)?;
        let input = BuildingInput {
            roof: self.roofs.and_then(|known| known.roof(&mask)),
            mask,
            crowns,
            terrain: self.terrain.raster(window),
            normal: maps.normal,
            colour: self.photographed.then_some(maps.colour),
            walls: maps.walls,
            height: maps.height,
            facets: if method.needs().facets { facets(self.blocks, window)? } else { Vec::new() },
        };
        let mut params = model_params(context.params);
        if task.footprint.is_some() {
            // A known footprint is one building.
            params.party_wall_step = 0.0;
        }
        Ok(gable_modeling::model(&input, method, &settings, &params))
    }
}

/// What the modelling of a building may see of the cleaned rasters; `inner` is the window of its pixels.
pub(crate) fn seen_by(params: &Params, inner: GridWindow) -> Result<GridWindow, PipelineError> {
    let (method, _) = params.reconstruction()?;
    Ok(grown(inner, method.reach().max(method.reach_under_crowns())))
}

/// A window with so many metres around it, and those that modelling needs in any case.
fn grown(window: GridWindow, reach: f64) -> GridWindow {
    window.grown((reach.max(MARGIN) / window.step).ceil() as usize)
}

/// Reads what was modelled for a tile.
pub(crate) fn read(tile: &Tile) -> Result<Vec<Modelled>, PipelineError> {
    let gone = || PipelineError::Artefact { path: tile.path.clone(), reason: "the file is gone".to_owned() };
    artefact::read_json(&tile.path)?.ok_or_else(gone)
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
    let number = components.components.iter().position(|c| *c == task.extent)? as u32 + 1;
    Some(marks.map(|&m| m == number))
}

/// How near a crown has to be to hide a part of a building, metres.
const BESIDE: f64 = 1.0;

/// Whether a crown stands beside a building.
fn is_beside_crown(mask: &Raster<bool>, labels: &Raster<u8>) -> bool {
    let window = mask.window();
    let reach = (BESIDE / window.step).ceil() as usize;
    let (offset_x, offset_y) = ((window.x0 - labels.window().x0) as usize, (window.y0 - labels.window().y0) as usize);
    for y in 0..window.height {
        for x in (0..window.width).filter(|&x| mask[(x, y)] && is_at_border(mask, x, y)) {
            let (column, row) = (x + offset_x, y + offset_y);
            for beside in row.saturating_sub(reach)..=(row + reach).min(labels.height() - 1) {
                let columns = column.saturating_sub(reach)..=(column + reach).min(labels.width() - 1);
                if labels.row(beside)[columns].contains(&(Label::Tree as u8)) {
                    return true;
                }
            }
        }
    }
    false
}

/// Whether a pixel of a mask has a neighbour that is none, or none at all on one side.
fn is_at_border(mask: &Raster<bool>, x: usize, y: usize) -> bool {
    let inside = x > 0 && y > 0 && x + 1 < mask.width() && y + 1 < mask.height();
    !(inside && mask[(x - 1, y)] && mask[(x + 1, y)] && mask[(x, y - 1)] && mask[(x, y + 1)])
}

fn model_params(params: &Params) -> ModelParams {
    let valid = &params.validation;
    ModelParams {
        party_wall_step: params.modeling.party_wall_step,
        work: params.modeling.work,
        tolerances: Tolerances { snap: valid.snap, planarity: valid.planarity, normals_deg: valid.normals },
    }
}

/// Why a building was taken for one, so that a user can leave out what is doubtful: its probability of being no crown, the height of
/// the walls at its open border as a share of its own height, and the share of its border where the mesh ends.
fn evidence_attributes(evidence: &Evidence) -> Vec<(String, Value)> {
    let share = |value: f64| Value::Number((value * 100.0).round() / 100.0);
    let mut out = vec![
        ("building_probability".to_owned(), share(evidence.probability())),
        ("cut_share".to_owned(), share(evidence.cut())),
    ];
    out.extend(evidence.walls().map(|walls| ("wall_share".to_owned(), share(walls))));
    out
}

/// A building as it is written and as it is reported.
fn record(
    task: &Task,
    id: String,
    made: Result<BuildingModel, Reason>,
    tile: [u32; 2],
    frame: &Frame,
    step: f64,
    note: Option<String>,
) -> Modelled {
    let window = made.as_ref().map_or_else(|_| task.window(step), |model| model.pixels.window());
    let bounds = window.bounds();
    let [ox, oy, _] = frame.origin;
    let mut building = Building { id: id.clone(), attributes: BTreeMap::new(), lods: Default::default() };
    let mut record = BuildingRecord {
        id,
        tile,
        bbox: [bounds.min.x + ox, bounds.min.y + oy, bounds.max.x + ox, bounds.max.y + oy],
        lod: Lod::None,
        reason: None,
        reason_code: None,
        note,
        roof_type: None,
        area_m2: task.area(step),
        height_m: 0.0,
        rmse_m: None,
        faces: 0,
    };
    let mut roofs = Vec::new();
    match made {
        Err(reason) => record.tell(&reason),
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
            if let Some(reason) = &model.reason {
                record.tell(reason);
            }
            record.note = match (record.note, model.note) {
                (Some(own), Some(more)) => Some(format!("{own}; {more}")),
                (own, more) => own.or(more),
            };
            record.area_m2 = model.area;
            record.height_m = model.height;
            record.rmse_m = Some(model.rmse);
            building.attributes = model.attributes;
            if let Some(evidence) = &task.evidence {
                building.attributes.extend(evidence_attributes(evidence));
            }
            record.roof_type = match building.attributes.get("roofType") {
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
    Modelled { task: task.id.clone(), building, record, roofs }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crown_counts_that_stands_at_the_wall() {
        let window = GridWindow { step: 0.2, x0: 3, y0: -8, width: 30, height: 30 };
        let mask = Raster::filled(GridWindow { x0: 11, y0: 0, width: 10, height: 10, ..window }, true);
        let with_tree = |column: usize, row: usize| {
            let mut labels = Raster::filled(window, Label::Ground as u8);
            labels[(column, row)] = Label::Tree as u8;
            is_beside_crown(&mask, &labels)
        };
        // The mask lies on columns and rows 8 to 17 of the window.
        assert!(with_tree(8 + 9 + 5, 12) && with_tree(3, 3), "a metre from the wall, and from a corner");
        assert!(!with_tree(8 + 9 + 6, 12) && !with_tree(2, 12), "farther off");
        let whole = grown(mask.window(), 15.0);
        assert_eq!(seen_by(&Params::default(), mask.window()).unwrap(), whole, "what hidden parts may take");
    }
}
