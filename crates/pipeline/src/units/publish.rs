//! The end of a job: the index, the file of the whole city, the report, and the list of buildings.

use super::names::{
    BUILDINGS, LabelFile, SAMPLED, SPLIT, STITCHED, Sampled, Stitched, TEXTURES, lines_file, written_file,
};
use super::write::WrittenTile;
use super::{RESULT, Unit, UnitCity, UnitResult, block, stitch, terrain_file};
use crate::mosaic::{Mosaic, MosaicTile};
use crate::params::Format;
use crate::run::{self, Source};
use crate::stages::holes::Hole;
use crate::stages::model::{self, Tile};
use crate::stages::sample::{self, Seen};
use crate::stages::segment::{self, Labelled};
use crate::stages::split::Blocks;
use crate::stages::{labels, rasters, vectors, write as stage};
use crate::summary::peak_memory_bytes;
use crate::warnings::{self, InputWarning};
use crate::{PipelineError, Stage, artefact, report};
use gable_geometry::DVec2;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::PathBuf;

/// Reads: what is known city-wide, `written/`, `lines/`; for the report also `ortho/`, `labels/`, `terrain/`, `models/`. Makes:
/// `result/`, `buildings.jsonl`.
pub(super) fn publish(unit: &Unit<'_>) -> Result<UnitResult, PipelineError> {
    let (context, folder, params) = (unit.context, unit.folder, unit.context.params);
    let out = folder.join(RESULT);
    artefact::create_dir(&out)?;
    let blocks = Blocks { report: unit.read(SPLIT)?, folder: folder.join("blocks") };
    let sampled: Sampled = unit.read(SAMPLED)?;
    let stitched: Stitched = unit.read(STITCHED)?;
    let ortho = sample::mosaic(context, sampled.pieces());
    let mut failures = stitch::failures(unit, &blocks, &segment::patches(&ortho, params.segmentation.patch));
    for failed in unit.history.failed.iter().filter(|f| matches!(f.stage, Stage::Model | Stage::Write)) {
        if let Some(block) = block(&failed.unit) {
            failures.add(block, failed.reason.clone());
        }
    }

    let (mut entries, mut buildings, mut layers) = (Vec::new(), Vec::new(), Vec::new());
    let mut lines: [Vec<PathBuf>; 2] = Default::default();
    for (ix, iy) in blocks.with_data() {
        let name = format!("{ix}_{iy}");
        match artefact::read_json::<WrittenTile>(&folder.join(written_file(&name)))? {
            Some(written) => {
                let entry = stage::IndexEntry { failed: failures.reason([ix, iy]).map(str::to_owned), ..written.entry };
                if params.output.terrain || entry.is_listed() {
                    entries.push(entry);
                }
                buildings.extend(written.buildings);
                layers.push(written.layers);
                for (list, part) in lines.iter_mut().zip(["buildings", "terrain"]) {
                    list.push(folder.join(lines_file(&name, part)));
                }
            }
            None => {
                let entry = stage::entry(&blocks, [ix, iy], &stage::Written::default(), &failures);
                entries.extend(Some(entry).filter(stage::IndexEntry::is_listed));
            }
        }
    }
    if params.output.formats.contains(&Format::CityJsonSeq) {
        let header = stage::header(params, &blocks, &unit.title());
        stage::join(context, &header, &lines.concat(), &out.join(stage::CITY))?;
    }
    let tiles: BTreeSet<String> = entries.iter().flat_map(|e| e.files.iter().cloned()).collect();
    let mut files = stage::index(context, &blocks, entries, &layers, &unit.title(), &out)?;
    let labels_of = |files: &[LabelFile]| {
        let tile = |l: &LabelFile| MosaicTile { window: l.window, path: folder.join(&l.file) };
        Mosaic::new(files.iter().map(tile).collect(), params.sampling.step, context.cache_bytes() / 8)
    };
    let labelled = Labelled { labels: labels_of(&stitched.labels), ..segment::gather(context, Vec::new()) };
    let tiles_of_models: Vec<Tile> = (blocks.with_data().into_iter())
        .map(|(ix, iy)| Tile { ix, iy, path: folder.join(model::model_file(ix, iy)) })
        .filter(|tile| tile.path.is_file())
        .collect();
    let written = |tile: &&Tile| folder.join(written_file(&format!("{}_{}", tile.ix, tile.iy))).is_file();
    let tiles_that_are_written: Vec<&Tile> = tiles_of_models.iter().filter(written).collect();
    files.extend(vectors::write(context, &blocks, &tiles_that_are_written, &out)?);
    if rasters::are_wanted(params) {
        let terrain = terrain_file::read(folder)?;
        files.extend(rasters::write(context, &blocks, &ortho, &labelled, &terrain, &out)?);
    }
    if params.output.labels {
        files.extend(labels::write(context, &blocks, &labelled, &out)?);
    }
    if params.output.report {
        context.observer.stage(Stage::Report, 1);
        let tiles = &tiles_of_models;
        let seen = seen(unit, &blocks, &sampled);
        let mut summary = run::summarise(unit.job.source, unit.job.params, &blocks, &seen, &failures, tiles)?;
        summary.warnings = warnings_of(unit, &blocks, &sampled, &stitched)?;
        summary.stages.clone_from(&unit.history.stages);
        summary.seconds = summary.stages.iter().map(|s| s.wall).sum();
        summary.peak_memory_bytes = peak_memory_bytes();
        summary.threads = 1;
        summary.files.clone_from(&files);
        let terrain = terrain_file::read(folder)?;
        let source = Source { blocks: &blocks, ortho: &ortho, labels: &labelled.labels, terrain: &terrain, tiles };
        files.extend(report::write(&out, &unit.title(), &summary, &source)?);
        context.observer.done(Stage::Report, "city");
    }

    artefact::write_with(&folder.join(BUILDINGS), |file| {
        buildings.iter().try_for_each(|building| {
            serde_json::to_writer(&mut *file, building)?;
            file.write_all(b"\n")
        })
    })?;
    let mut made: Vec<String> =
        files.iter().filter(|file| !tiles.contains(*file)).map(|file| format!("{RESULT}{file}")).collect();
    made.push(BUILDINGS.to_owned());
    let city = UnitCity { crs: blocks.frame().crs.to_string(), buildings: BUILDINGS.to_owned() };
    Ok(UnitResult { made, city: Some(city), ..UnitResult::default() })
}

/// What was seen in each block, also in those that failed.
fn seen(unit: &Unit<'_>, blocks: &Blocks, sampled: &Sampled) -> Vec<Seen> {
    let known: BTreeMap<[u32; 2], &Seen> = sampled.blocks.iter().map(|b| (b.seen.block, &b.seen)).collect();
    let of = |(ix, iy): (u32, u32)| match known.get(&[ix, iy]) {
        Some(seen) => Seen { reused: unit.history.reused.contains(&format!("{ix}_{iy}")), ..(*seen).clone() },
        None => Seen {
            block: [ix, iy],
            failed: unit.failure(Stage::Sample, &format!("{ix}_{iy}")).map(str::to_owned),
            ..Seen::default()
        },
    };
    blocks.with_data().into_iter().map(of).collect()
}

/// What was put up with in the input, in the order in which a run tells it.
fn warnings_of(
    unit: &Unit<'_>,
    blocks: &Blocks,
    sampled: &Sampled,
    stitched: &Stitched,
) -> Result<Vec<InputWarning>, PipelineError> {
    let origins: BTreeMap<String, BTreeSet<String>> = unit.read(TEXTURES)?;
    let mut failed: BTreeMap<PathBuf, String> = BTreeMap::new();
    for (texture, reason) in sampled.blocks.iter().flat_map(|b| &b.textures) {
        for origin in origins.get(texture).into_iter().flatten() {
            failed.insert(PathBuf::from(origin), reason.replace(texture.as_str(), origin));
        }
    }
    let failed: Vec<(PathBuf, String)> = failed.into_iter().collect();
    let holes: Vec<Hole> =
        stitched.holes.iter().map(|&(area, centre)| Hole { area, centre: DVec2::from_array(centre) }).collect();
    let mut found = warnings::of_split(&blocks.report);
    found.extend(warnings::of_textures(&failed));
    found.extend(warnings::of_scene(&blocks.frame().crs, sampled.coloured));
    found.extend(warnings::of_place(blocks, unit.job.params));
    found.extend(warnings::of_holes(&holes, blocks.frame().origin));
    Ok(found)
}
