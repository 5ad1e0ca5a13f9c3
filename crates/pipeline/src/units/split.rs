//! The split: from the source to blocks that stand by themselves.

use super::names::{GRID, SPLIT, TEXTURES, basis, block_file, materials_file};
use super::textures::Packed;
use super::{Unit, UnitInput, UnitResult, UnitTask, given, map};
use crate::known::Known;
use crate::stages::segment::Labelling;
use crate::stages::terrain::Survey;
use crate::stages::{model, rasters, split as stage, vectors};
use crate::{PipelineError, Stage, artefact, run};
use gable_blocks::{BlocksError, Defects, Outliers, SplitReport, write_block};
use gable_city_model::Header;
use gable_scene::Counts;

/// Reads: nothing but the source. Makes: `grid.json`, `split.json`, `textures.json`, `map/blocks.json`, `blocks/`, `textures/`,
/// `given/`. Adds: one sampling for each block with data, and what comes once for the city.
pub(super) fn split(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, folder) = (unit.context, unit.folder);
    let scene = run::open(unit.job.source, context.params, unit.job.reach)?;
    let blocks = stage::run(context, &scene)?;
    // What a later unit would find wrong in files that parameters name is told now.
    let params = unit.job.params;
    let known = context.params.segmentation.footprints.as_deref();
    known.map(|path| Known::read(path, blocks.frame(), context)).transpose()?;
    model::known_roofs(context, blocks.frame())?;
    Labelling::new(context, blocks.frame(), None, &Survey { saturation: Some(1.0), noise: 1.0 })?;

    let mut result = UnitResult { made: given::take(params, folder, context.reach)?, ..UnitResult::default() };
    artefact::create_dir(&folder.join("textures"))?;
    let mut packed = Packed::default();
    for (ix, iy) in blocks.with_data() {
        context.check_cancelled()?;
        let name = format!("{ix}_{iy}");
        let mut mesh = blocks.read(ix, iy).map_err(|e| unit.failed(e))?;
        let materials = packed.block(&mut mesh, &blocks.report.materials, unit.job.reach, folder)?;
        write_block(&folder.join(block_file(&name)), &mesh).map_err(|e| match e {
            BlocksError::Write { path, source } => PipelineError::Io { path, source },
            other => unit.failed(other),
        })?;
        unit.write(&materials_file(&name), &materials)?;
        let mut reads = vec![GRID.to_owned(), block_file(&name), materials_file(&name)];
        reads.extend(materials.iter().filter_map(|m| m.file()).map(str::to_owned));
        reads.dedup();
        result.made.extend([block_file(&name), materials_file(&name)]);
        let input = UnitInput {
            reads,
            reuse: true,
            basis: basis(params, &["sampling", "segmentation"]),
            // Of what is written, only this concerns a block.
            detail: serde_json::json!({ "shows_mesh": params.shows_mesh() }),
            ..UnitInput::default()
        };
        result.tasks.push(UnitTask { stage: Stage::Sample, unit: name, input, required: false });
    }
    unit.write(TEXTURES, packed.sources())?;
    let report = SplitReport { materials: Vec::new(), ..blocks.report.clone() };
    unit.write(SPLIT, &report)?;
    unit.write(GRID, &grid_of(report))?;
    result.made.extend([GRID, SPLIT, TEXTURES].map(str::to_owned));
    result.made.push(map::write_blocks(unit, &blocks)?);
    result.made.extend(packed.sources().keys().filter(|name| folder.join(name).is_file()).cloned());
    result.tasks.extend(city_wide(unit));
    Ok(result)
}

/// What does not change if a block does.
fn grid_of(report: SplitReport) -> SplitReport {
    let corner = Header {
        title: String::new(),
        metadata: Default::default(),
        origin: report.grid.frame.origin,
        crs: report.grid.frame.crs.clone(),
        extent: Some((report.min.into(), report.max.into())),
    }
    .base();
    SplitReport {
        blocks: Vec::new(),
        materials: Vec::new(),
        counts: Counts::default(),
        min: corner.to_array(),
        max: corner.to_array(),
        outliers: Outliers::default(),
        defects: Defects::default(),
        spilled: 0,
        ..report
    }
}

/// The units that come once.
fn city_wide(unit: &Unit<'_>) -> Vec<UnitTask> {
    let params = unit.job.params;
    let names = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    let task = |stage, reads, reuse, groups: &[&str]| {
        let input = UnitInput { reads, history: true, reuse, basis: basis(params, groups), ..UnitInput::default() };
        UnitTask { stage, unit: "city".to_owned(), input, required: true }
    };
    let mut stitch = names(&[GRID, SPLIT, super::names::SAMPLED, "labels/"]);
    stitch.extend(given::reads(params, &["footprints"]));
    let mut report =
        names(&[GRID, SPLIT, TEXTURES, super::names::SAMPLED, super::names::STITCHED, "written/", "lines/"]);
    if params.drapes_ground() {
        report.extend(names(&["overview/"]));
    }
    let (whole, rasters) = (params.output.report, rasters::are_wanted(params));
    let wanted = [
        ("ortho/", whole || rasters),
        ("labels/", whole || rasters || params.output.labels),
        ("terrain/", whole || rasters),
        ("models/", whole || vectors::are_wanted(params)),
    ];
    report.extend(wanted.into_iter().filter(|(_, wanted)| *wanted).map(|(name, _)| name.to_owned()));
    vec![
        // Whether files of labels and weights are given changes what is asked of the patches.
        task(
            Stage::Terrain,
            names(&[GRID, SPLIT, "seen/", "coarse/", map::PARTS]),
            true,
            &["sampling", "segmentation"],
        ),
        task(Stage::Stitch, stitch, true, &["sampling", "segmentation", "modeling", "validation", "output"]),
        task(Stage::Report, report, false, &[]),
    ]
}
