//! From the labels of all patches to whole buildings, each given to the tile that owns it.

use super::names::{GRID, LabelFile, SAMPLED, SEAMS, SPLIT, STITCHED, Sampled, Seam, Stitched, basis, tasks_file};
use super::{Unit, UnitInput, UnitResult, UnitTask, given, terrain_file};
use crate::failure::Failures;
use crate::known::Known;
use crate::params::Params;
use crate::stages::sample::Piece;
use crate::stages::split::Blocks;
use crate::stages::{holes, mesh_tiles, model, prepare, sample, segment, stitch as stage, write};
use crate::{PipelineError, Stage, artefact};
use gable_city_model::tiles3d::Layer;
use gable_raster::GridWindow;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// What the modelling of a tile has to be told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ModelDetail {
    /// The pieces of the mosaic that its buildings see.
    pub(super) pieces: Vec<Piece>,
    /// The labels under its buildings.
    pub(super) labels: Vec<LabelFile>,
    /// The blocks whose meshes its buildings see, where the method looks at them.
    pub(super) blocks: Vec<[u32; 2]>,
    /// Whether the mesh has photographs.
    pub(super) photographed: bool,
}

/// What the writing of a tile has to be told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct WriteDetail {
    /// The title of the city.
    pub(super) title: String,
    /// The rasters of the tile, where its ground is to be seen.
    #[serde(default)]
    pub(super) pieces: Vec<Piece>,
    /// The mesh for viewers, where it is wanted.
    #[serde(default)]
    pub(super) mesh: Option<Layer>,
}

/// The blocks that failed up to the labelling, with their reasons.
pub(super) fn failures(unit: &Unit<'_>, blocks: &Blocks, patches: &[GridWindow]) -> Failures {
    let mut failures = Failures::default();
    for (ix, iy) in blocks.with_data() {
        if let Some(reason) = unit.failure(Stage::Sample, &format!("{ix}_{iy}")) {
            failures.add([ix, iy], reason.to_owned());
        }
    }
    for &patch in patches {
        if let Some(reason) = unit.failure(Stage::Segment, &segment::unit_name(patch)) {
            failures.add_window(blocks, patch, reason);
        }
    }
    failures
}

/// Reads: `split.json`, `sampled.json`, `labels/`. Makes: `labels/*.final.lab`, `buildings/`, `stitched.json`, `seams.json`. Adds: the modelling
/// of each tile that owns buildings, and the writing of each tile that may hold something.
pub(super) fn stitch(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, folder, params) = (unit.context, unit.folder, unit.context.params);
    let step = params.sampling.step;
    let blocks = Blocks { report: unit.read(SPLIT)?, folder: folder.join("blocks") };
    let sampled: Sampled = unit.read(SAMPLED)?;
    let patches = segment::patches(&sample::mosaic(context, sampled.pieces()), params.segmentation.patch);
    let failures = failures(unit, &blocks, &patches);
    let mut found = Vec::new();
    for patch in patches {
        let failed = unit.failure(Stage::Segment, &segment::unit_name(patch));
        found.push((
            patch,
            match failed {
                Some(reason) => Err(reason.to_owned()),
                None => Ok(segment::read_patch(context, patch)?.ok_or_else(|| {
                    unit.failed(format!("the labels of {} are not whole", segment::unit_name(patch)))
                })?),
            },
        ));
    }
    let labelled = segment::gather(context, found);
    let holes = holes::holes(context, &blocks, &labelled, &failures.blocks())?;
    let known = params.segmentation.footprints.as_deref();
    let known = known.map(|path| Known::read(path, blocks.frame(), context)).transpose()?;
    let (tasks, labelled) = stage::stitch(context, labelled, blocks.frame(), known.as_ref())?;

    let mut result = UnitResult::default();
    let mut labels = Vec::new();
    for tile in labelled.labels.tiles() {
        let name = tile.path.strip_prefix(folder).unwrap_or(&tile.path).to_string_lossy().into_owned();
        if name.ends_with(".final.lab") {
            result.made.push(name.clone());
        }
        labels.push(LabelFile { file: name, window: tile.window });
    }
    artefact::create_dir(&folder.join("buildings"))?;
    let owned = model::owned(&blocks, &tasks, step);
    let city = City { unit, blocks: &blocks, sampled: &sampled, labels: &labels };
    for (&(iy, ix), tasks) in &owned {
        let name = format!("{ix}_{iy}");
        let noted: Vec<_> = tasks.iter().map(|task| (*task, failures.note(&blocks, task.window(step)))).collect();
        unit.write(&tasks_file(&name), &noted)?;
        result.made.push(tasks_file(&name));
        result.tasks.push(city.modelling(&name, tasks)?);
    }
    for (ix, iy) in blocks.with_data() {
        let owns = owned.contains_key(&(iy, ix));
        let seen = sampled.blocks.iter().find(|b| b.seen.block == [ix, iy]).map(|b| &b.seen);
        if write::may_hold(params, seen, owns) {
            result.tasks.push(city.writing(ix, iy, owns)?);
        }
    }
    let holes = holes.iter().map(|h| (h.area, h.centre.to_array())).collect();
    unit.write(STITCHED, &Stitched { holes, labels })?;
    unit.write(SEAMS, &seams(&blocks, &owned, step))?;
    result.made.extend([STITCHED, SEAMS].map(str::to_owned));
    Ok(result)
}

/// Where buildings reach into more than one block, by their extents.
fn seams(blocks: &Blocks, owned: &BTreeMap<(u32, u32), Vec<&stage::Task>>, step: f64) -> Vec<Seam> {
    let mut found: BTreeMap<(BTreeSet<(u32, u32)>, (u32, u32)), usize> = BTreeMap::new();
    for (&owner, tasks) in owned {
        for task in tasks {
            let window = task.window(step);
            let (x1, y1) = (window.x0 + window.width as i64 - 1, window.y0 + window.height as i64 - 1);
            let core = |x, y| blocks.report.grid.core_of_pixel(x, y).map(|c| (c.row, c.column));
            let (Some(low), Some(high)) = (core(window.x0, window.y0), core(x1, y1)) else { continue };
            if low != high {
                let reach = (low.0..=high.0).flat_map(|row| (low.1..=high.1).map(move |column| (row, column)));
                *found.entry((reach.collect(), owner)).or_default() += 1;
            }
        }
    }
    let name = |&(iy, ix): &(u32, u32)| format!("{ix}_{iy}");
    let seam = |((reach, owner), buildings): ((BTreeSet<_>, _), usize)| Seam {
        blocks: reach.iter().map(name).collect(),
        owner: name(&owner),
        buildings,
    };
    found.into_iter().map(seam).collect()
}

/// What later units are cut from.
struct City<'a> {
    unit: &'a Unit<'a>,
    blocks: &'a Blocks,
    sampled: &'a Sampled,
    labels: &'a [LabelFile],
}

impl City<'_> {
    fn params(&self) -> &Params {
        self.unit.job.params
    }

    fn modelling(&self, name: &str, tasks: &[&stage::Task]) -> Result<UnitTask, PipelineError> {
        let step = self.params().sampling.step;
        let (method, _) = self.params().reconstruction()?;
        let mut pieces: BTreeMap<&str, &Piece> = BTreeMap::new();
        let mut labels: BTreeMap<&str, &LabelFile> = BTreeMap::new();
        // By row, then column: the order in which a run reads them.
        let mut meshes: BTreeSet<(u32, u32)> = BTreeSet::new();
        let mut terrain: BTreeSet<String> = BTreeSet::new();
        for task in tasks {
            let window = model::seen_by(self.params(), task.window(step))?;
            let raw = prepare::seen_by(window);
            let sees = |p: &&Piece| !p.window(step).intersection(&raw).is_empty();
            pieces.extend(self.sampled.pieces().filter(sees).map(|p| (p.file.as_str(), p)));
            let under = |l: &&LabelFile| !l.window.intersection(&window).is_empty();
            labels.extend(self.labels.iter().filter(under).map(|l| (l.file.as_str(), l)));
            terrain.extend(terrain_file::tiles(self.sampled.terrain, window));
            if method.needs().facets {
                let near = |&(ix, iy): &(u32, u32)| {
                    self.blocks.core(ix, iy).is_some_and(|c| c.bounds().intersects(&window.bounds()))
                };
                meshes.extend(self.blocks.with_data().into_iter().filter(near).map(|(ix, iy)| (iy, ix)));
            }
        }
        let mut reads = vec![GRID.to_owned(), tasks_file(name)];
        reads.extend(pieces.keys().map(|f| (*f).to_owned()));
        reads.extend(labels.keys().map(|f| (*f).to_owned()));
        reads.extend(meshes.iter().map(|(iy, ix)| super::names::block_file(&format!("{ix}_{iy}"))));
        reads.extend(terrain);
        reads.extend(given::reads(self.params(), &["footprints", "roofs"]));
        let detail = ModelDetail {
            pieces: pieces.into_values().cloned().collect(),
            labels: labels.into_values().cloned().collect(),
            blocks: meshes.into_iter().map(|(iy, ix)| [ix, iy]).collect(),
            photographed: self.sampled.coloured,
        };
        self.task(Stage::Model, name, reads, &["sampling", "segmentation", "modeling", "validation"], &detail)
    }

    fn writing(&self, ix: u32, iy: u32, owns: bool) -> Result<UnitTask, PipelineError> {
        let name = format!("{ix}_{iy}");
        let mut reads = vec![GRID.to_owned()];
        if owns {
            reads.push(model::model_file(ix, iy));
        }
        if let Some(window) = self.blocks.core(ix, iy).filter(|_| self.params().output.terrain) {
            reads.extend(terrain_file::tiles(self.sampled.terrain, write::terrain_window(self.params(), window)));
        }
        let mut pieces = Vec::new();
        if let Some(window) = self.blocks.core(ix, iy).filter(|_| self.params().drapes_ground()) {
            let step = self.params().sampling.step;
            pieces.extend(self.sampled.pieces().filter(|p| !p.window(step).intersection(&window).is_empty()).cloned());
            reads.extend(pieces.iter().map(|p| p.file.clone()));
        }
        let seen = self.sampled.blocks.iter().find(|b| b.seen.block == [ix, iy]);
        let mesh = seen.and_then(|b| b.seen.mesh.clone()).filter(|_| self.params().shows_mesh());
        reads.extend(mesh.iter().flat_map(|layer| &layer.levels).map(mesh_tiles::file));
        let groups = ["sampling", "segmentation", "output", "validation"];
        self.task(Stage::Write, &name, reads, &groups, &WriteDetail { title: self.unit.title(), pieces, mesh })
    }

    fn task(
        &self,
        stage: Stage,
        name: &str,
        reads: Vec<String>,
        groups: &[&str],
        detail: &impl Serialize,
    ) -> Result<UnitTask, PipelineError> {
        let input = UnitInput {
            reads,
            reuse: true,
            basis: basis(self.params(), groups),
            detail: serde_json::to_value(detail).map_err(|e| self.unit.failed(e))?,
            ..UnitInput::default()
        };
        Ok(UnitTask { stage, unit: name.to_owned(), input, required: false })
    }
}
