//! The run: all stages, one after the other, in one process.

use crate::clock::Clock;
use crate::failure::Failures;
use crate::known::Known;
use crate::mosaic::Mosaic;
use crate::observer::{Observer, Stage};
use crate::params::{Params, Up, parameters};
use crate::report::{self, Overview, OverviewBuilder, Pixel, ReportSource};
use crate::stages::model::{self, Modeller, Tile};
use crate::stages::sample::Seen;
use crate::stages::split::Blocks;
use crate::stages::{Context, holes, labels, rasters, sample, segment, split, stitch, terrain, write};
use crate::summary::{BlockRecord, BlockState, Lod, RunStatus, RunSummary, peak_memory_bytes};
use crate::workspace::Workspace;
use crate::{PipelineError, artefact, failure, warnings};
use artefact::LabelTile;
use gable_city_model::Building;
use gable_files::Reach;
use gable_geometry::{Box2, DVec3};
use gable_ortho::{DecodedImage, Orthograph, TextureCache};
use gable_raster::GridWindow;
use gable_scene::{Material, OpenOptions, Scene, load_texture};
use gable_segmentation::{Label, Terrain};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Models a city: reads the mesh at `input` and writes the result into the folder `out`. Of the files that the mesh names, those
/// within `reach` are read; files that parameters name are the caller's own.
///
/// What a stage has finished is kept in `out/.work` until the end, so that the same call goes on where an earlier
/// one stopped. The result does not depend on the number of threads, and no building on the grid.
///
/// # Errors
/// If the input is bad, a file cannot be written, or the observer cancels; see [`PipelineError::kind`].
pub fn run(
    input: &Path,
    out: &Path,
    params: &Params,
    reach: &Reach,
    observer: &dyn Observer,
) -> Result<RunSummary, PipelineError> {
    params.check()?;
    let threads = match params.resources.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| PipelineError::Input(format!("resources.threads = {threads}: {e}")))?;
    pool.install(|| run_here(input, out, params, reach, observer, threads))
}

fn run_here(
    input: &Path,
    out: &Path,
    params: &Params,
    reach: &Reach,
    observer: &dyn Observer,
    threads: usize,
) -> Result<RunSummary, PipelineError> {
    let begin = Instant::now();
    let scene = open(input, params, reach)?;
    artefact::create_dir(out)?;
    let workspace = Workspace::open(out, &scene, params)?;
    let context = Context { params, observer, workspace: &workspace, reach: &Reach::everything() };
    let title = title(input, params);
    let mut clock = Clock::default();

    let blocks = clock.time(Stage::Split, || split::run(&context, &scene))?;
    let mut warnings = Vec::new();
    warnings::tell(observer, warnings::of_split(&blocks.report), &mut warnings);
    let textures = textures(blocks.report.materials.clone(), params, reach, BTreeMap::new());
    let (seen, mut ortho) = clock.time(Stage::Sample, || sample::run(&context, &blocks, &textures))?;
    warnings::tell(observer, warnings::of_textures(&textures.failures()), &mut warnings);
    let mut failures = Failures::default();
    for (block, reason) in seen.iter().filter_map(|s| Some((s.block, s.failed.clone()?))) {
        failures.add(block, reason);
    }
    let covered: u64 = seen.iter().map(|s| s.covered).sum();
    if covered == 0
        && let Some(reason) = failures.first()
    {
        return Err(context.failed(Stage::Sample, "every block", reason));
    }
    if covered == 0 {
        return Err(unseen(input));
    }
    let coloured = is_coloured(&seen);
    warnings::tell(observer, warnings::of_scene(&blocks.frame().crs, coloured), &mut warnings);
    warnings::tell(observer, warnings::of_place(&blocks, params), &mut warnings);
    let (ground, survey) =
        clock.time(Stage::Terrain, || terrain::terrain(&context, &blocks, &mut ortho, coloured, &mut failures))?;
    let known = params.segmentation.footprints.as_deref();
    let known = known.map(|path| Known::read(path, blocks.frame(), &context)).transpose()?;
    let known = known.as_ref();
    workspace.rest_on(&["labels", "models"], &format!("{:?}", failures.blocks()))?;
    let (labelled, holes) = clock.time(Stage::Segment, || {
        let labelled = segment::segment(&context, &ortho, &ground, blocks.frame(), known, &survey)?;
        labelled.failed.iter().for_each(|(window, reason)| failures.add_window(&blocks, *window, reason));
        let holes = holes::holes(&context, &blocks, &labelled, &failures.blocks())?;
        Ok((labelled, holes))
    })?;
    workspace.rest_on(&["models"], &format!("{:?}", failures.blocks()))?;
    warnings::tell(observer, warnings::of_holes(&holes, blocks.frame().origin), &mut warnings);
    let (tasks, labelled) = clock.time(Stage::Stitch, || stitch::stitch(&context, labelled, blocks.frame(), known))?;
    let mut tiles = clock.time(Stage::Model, || {
        let roofs = model::known_roofs(&context, blocks.frame())?;
        let modeller = Modeller {
            blocks: &blocks,
            ortho: &ortho,
            labels: &labelled.labels,
            terrain: &ground,
            footprints: known,
            roofs: roofs.as_ref(),
            photographed: coloured,
        };
        model::model(&context, &modeller, &tasks, &failures)
    })?;
    let mut files = clock.time(Stage::Write, || {
        let mut files = write::write(&context, &blocks, &seen, &tiles, &ground, &ortho, &mut failures, &title, out)?;
        files.extend(rasters::write(&context, &blocks, &ortho, &labelled, &ground, out)?);
        if params.output.labels {
            files.extend(labels::write(&context, &blocks, &labelled, out)?);
        }
        Ok(files)
    })?;

    // What could not be read when it was written cannot be read for the report either.
    tiles.retain(|tile| failures.reason([tile.ix, tile.iy]).is_none() || model::read(tile).is_ok());

    let mut summary = summarise(input, params, &blocks, &seen, &failures, &tiles)?;
    summary.threads = threads;
    summary.warnings = warnings;
    if params.output.report {
        observer.stage(Stage::Report, 1);
        summary.stages.clone_from(&clock.stages);
        summary.files.clone_from(&files);
        summary.seconds = begin.elapsed().as_secs_f64();
        summary.peak_memory_bytes = peak_memory_bytes();
        let source =
            Source { blocks: &blocks, ortho: &ortho, labels: &labelled.labels, terrain: &ground, tiles: &tiles };
        let made = clock.time(Stage::Report, || report::write(out, &title, &summary, &source))?;
        files.extend(made);
        observer.done(Stage::Report, "city");
    }
    summary.stages = clock.stages;
    summary.seconds = begin.elapsed().as_secs_f64();
    summary.peak_memory_bytes = peak_memory_bytes();
    summary.files = files;
    if failures.is_empty() {
        workspace.remove()?
    } else {
        workspace.keep_for_another_try()?
    }
    Ok(summary)
}

/// The error of an input of which nothing can be seen.
pub(crate) fn unseen(input: &Path) -> PipelineError {
    PipelineError::Input(format!("{}: nothing of the mesh can be seen from above", input.display()))
}

/// The title of the result of an input.
pub(crate) fn title(input: &Path, params: &Params) -> String {
    if !params.output.title.is_empty() {
        return params.output.title.clone();
    }
    input.file_stem().map_or_else(|| "city".to_owned(), |n| n.to_string_lossy().into_owned())
}

pub(crate) fn open(input: &Path, params: &Params, reach: &Reach) -> Result<Scene, PipelineError> {
    let up = match params.input.up {
        Up::Auto => gable_scene::Up::Auto,
        Up::Y => gable_scene::Up::Y,
        Up::Z => gable_scene::Up::Z,
        Up::MinusZ => gable_scene::Up::MinusZ,
        Up::MinusY => gable_scene::Up::MinusY,
    };
    let origin = params.origin()?.map(DVec3::from_array);
    let options = OpenOptions {
        up,
        crs: params.crs()?,
        origin,
        error: params.input.error,
        strict: params.input.strict,
        reach: reach.clone(),
    };
    Scene::open(input, &options).map_err(|e| PipelineError::Input(e.to_string()))
}

/// The textures of materials, of which those within `reach` are read. Files that are known to be unreadable are given with the reason.
pub(crate) fn textures(
    materials: Vec<Material>,
    params: &Params,
    reach: &Reach,
    unreadable: BTreeMap<PathBuf, String>,
) -> TextureCache {
    let reach = reach.clone();
    let capacity = params.resources.texture_cache << 20;
    TextureCache::new(materials, capacity, move |material: &Material| {
        let known = material.texture.as_ref().and_then(|source| unreadable.get(source.file()));
        if let Some(reason) = known {
            return Err(reason.clone().into());
        }
        // A decoder that stumbles over a damaged image costs that image only.
        let load = std::panic::catch_unwind(|| load_texture(material, &reach));
        let image = load.map_err(|cause| format!("the decoder failed: {}", failure::said(&*cause)))??;
        let image = image.ok_or("the material has no image")?;
        let (width, height) = (image.width() as usize, image.height() as usize);
        let texels = image.pixels().map(|p| p.0).collect();
        Ok(DecodedImage { width, height, texels })
    })
}

/// The result in figures, but for times, memory, warnings and files.
pub(crate) fn summarise(
    input: &Path,
    params: &Params,
    blocks: &Blocks,
    seen: &[Seen],
    failures: &Failures,
    tiles: &[Tile],
) -> Result<RunSummary, PipelineError> {
    let covered: u64 = seen.iter().map(|s| s.covered).sum();
    let mut summary = RunSummary {
        status: if failures.is_empty() { RunStatus::Successful } else { RunStatus::Partial },
        version: env!("CARGO_PKG_VERSION").to_owned(),
        input: input.display().to_string(),
        crs: blocks.frame().crs.to_string(),
        triangles: blocks.report.counts.triangles,
        area_m2: covered as f64 * params.sampling.step.powi(2),
        pixels: covered,
        step_m: params.sampling.step,
        grid: blocks.grid(),
        parameters: changed(params),
        ..RunSummary::default()
    };
    for tile in tiles {
        summary.building_records.extend(model::read(tile)?.into_iter().map(|m| m.record));
    }
    summary.building_records.sort_by(|a, b| a.id.cmp(&b.id));
    let written = || summary.building_records.iter().filter(|b| b.lod != Lod::None);
    summary.buildings = written().count();
    summary.faces = written().map(|b| u64::from(b.faces)).sum();
    summary.blocks = block_records(blocks, seen, failures, &summary);
    Ok(summary)
}

/// Whether a city counts as photographed: more than half of what is seen has a texture. Where a photographed city has none it is
/// grey.
pub(crate) fn is_coloured(seen: &[Seen]) -> bool {
    2 * seen.iter().map(|s| s.photographed).sum::<u64>() > seen.iter().map(|s| s.covered).sum()
}

/// The parameters that differ from the defaults.
fn changed(params: &Params) -> BTreeMap<String, String> {
    let defaults = Params::default();
    let differs = parameters().iter().filter(|p| p.applies(params) && p.value(params) != p.value(&defaults));
    differs.map(|p| (p.name.clone(), p.value(params))).collect()
}

fn block_records(blocks: &Blocks, seen: &[Seen], failures: &Failures, summary: &RunSummary) -> Vec<BlockRecord> {
    let mut buildings: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for record in summary.building_records.iter().filter(|b| b.lod != Lod::None) {
        *buildings.entry(record.tile).or_insert(0) += 1;
    }
    let triangles: BTreeMap<[u32; 2], u64> =
        blocks.report.blocks.iter().map(|b| ([b.core.column, b.core.row], b.triangles)).collect();
    seen.iter()
        .map(|s| BlockRecord {
            ix: s.block[0],
            iy: s.block[1],
            status: match (failures.reason(s.block), s.covered, s.reused) {
                (Some(reason), ..) => BlockState::Failed(reason.to_owned()),
                (None, 0, _) => BlockState::Empty,
                (None, _, true) => BlockState::Reused,
                (None, _, false) => BlockState::Done,
            },
            triangles: triangles.get(&s.block).copied().unwrap_or(0),
            buildings: buildings.get(&s.block).copied().unwrap_or(0),
            seconds: s.seconds,
        })
        .collect()
}

/// Where the report takes its pictures from.
pub(crate) struct Source<'a> {
    pub(crate) blocks: &'a Blocks,
    pub(crate) ortho: &'a Mosaic<Orthograph>,
    pub(crate) labels: &'a Mosaic<LabelTile>,
    pub(crate) terrain: &'a Terrain,
    pub(crate) tiles: &'a [Tile],
}

impl ReportSource for Source<'_> {
    fn bounds(&self) -> Box2 {
        let windows = self.ortho.tiles().iter().map(|t| t.window.bounds());
        Box2::of(windows.flat_map(|b| [b.min, b.max]))
    }

    fn step(&self) -> f64 {
        self.ortho.step()
    }

    fn overview(&self, window: GridWindow) -> Result<Overview, PipelineError> {
        let mut builder = OverviewBuilder::new(window);
        let bounds = window.bounds();
        let tiles = self.ortho.tiles();
        let seen = |&i: &usize| !self.ortho.is_lost(i) && tiles[i].window.bounds().intersects(&bounds);
        let seen: Vec<usize> = (0..tiles.len()).filter(seen).collect();
        // Decoded on all threads, added in order.
        for some in seen.chunks(2 * rayon::current_num_threads()) {
            let read = |&i: &usize| {
                let window = tiles[i].window;
                Ok((window, self.ortho.tile(i)?, self.labels.read(window)?.0, self.terrain.raster(window)))
            };
            let read: Vec<_> = some.par_iter().map(read).collect::<Result<_, PipelineError>>()?;
            for (window, maps, labels, ground) in read {
                builder.add(window, |x, y| {
                    let height = maps.height[(x, y)];
                    let label = Label::ALL.into_iter().find(|&l| l as u8 == labels[(x, y)]);
                    (!height.is_nan()).then(|| Pixel {
                        colour: maps.colour[(x, y)],
                        height,
                        ground: ground[(x, y)],
                        label: label.unwrap_or(Label::Ground),
                    })
                });
            }
        }
        Ok(builder.finish())
    }

    fn buildings(&self, within: Box2, visit: &mut dyn FnMut(&Building)) -> Result<(), PipelineError> {
        let [ox, oy, _] = self.blocks.frame().origin;
        for tile in self.tiles {
            for modelled in model::read(tile)? {
                let [west, south, east, north] = modelled.record.bbox;
                let bounds = Box2::of([
                    gable_geometry::dvec2(west - ox, south - oy),
                    gable_geometry::dvec2(east - ox, north - oy),
                ]);
                if bounds.intersects(&within) {
                    visit(&modelled.building);
                }
            }
        }
        Ok(())
    }
}
