//! `gable train`: weights of the tree classifier from labelled rasters.

use super::bench::LABELS;
use super::thinned;
use crate::cli::TrainArgs;
use crate::exit::{Outcome, UsageError};
use crate::progress::Progress;
use crate::{interrupt, table, terminal};
use anyhow::Context as _;
use gable_evaluation::real::{Label, Outlines, RealScene};
use gable_files::Reach;
use gable_geometry::DVec3;
use gable_pipeline::label_map::{self, LabelMap};
use gable_pipeline::{Params, SampledMesh, sample_mesh};
use gable_raster::{GridWindow, Raster};
use gable_segmentation::{
    FeatureSet, LabelledRaster, Model, PlantScores, Score, TrainOptions, TrainReport, UNKNOWN, read_labelled_images,
    saturated, train,
};
use serde_json::json;
use std::path::Path;

/// Trains a classifier.
pub(crate) fn run(args: &TrainArgs, quiet: bool) -> anyhow::Result<Outcome> {
    let features = [FeatureSet::Zhu27, FeatureSet::Full, FeatureSet::Geometric];
    let Some(features) = features.into_iter().find(|f| f.name() == args.features) else {
        return Err(UsageError(format!("--features {:?}: give zhu27, full or geometric", args.features)).into());
    };
    let mut rasters = Vec::new();
    if let (Some(images), Some(masks)) = (&args.images, &args.masks) {
        rasters.extend(read_labelled_images(images, masks, args.step)?);
    }
    interrupt::listen();
    let progress = Progress::new(quiet);
    for city in &args.cities {
        let source = city.file_name().map_or_else(|| city.display().to_string(), |n| n.to_string_lossy().into_owned());
        let maps = read_maps(&city.join("truth"))?;
        rasters.extend(rasters_of(&super::mesh_folder(city), &maps, &source, features, args.step, &progress)?);
    }
    if args.meshes.len() != args.labels.len() {
        return Err(UsageError("give --labels once for each --mesh".to_owned()).into());
    }
    if !args.thin.is_empty() && features != FeatureSet::Geometric {
        return Err(UsageError("--thin leaves no texture: give --features geometric".to_owned()).into());
    }
    for (mesh, labels) in args.meshes.iter().zip(&args.labels) {
        rasters.extend(mesh_rasters(mesh, labels, args, features, &progress)?);
    }
    progress.begin("train", 1);
    let defaults = TrainOptions::default();
    let options = TrainOptions {
        features,
        rounds: args.rounds.unwrap_or(defaults.rounds),
        seed: args.seed.unwrap_or(defaults.seed),
        ..defaults
    };
    let (model, report) = train(&rasters, &options)?;
    progress.step("train", "");
    progress.finish();
    std::fs::write(&args.out, model.to_json()).with_context(|| args.out.display().to_string())?;
    if args.json {
        terminal::json(&as_json(&model, &report, rasters.len()));
    } else {
        terminal::stdout(&text(&report));
        terminal::stdout(&format!(
            "weights: {0}\nuse them by --set segmentation.weights={0} --set segmentation.features={1}",
            args.out.display(),
            features.name()
        ));
    }
    Ok(Outcome::Success)
}

/// The rasters of a labelled mesh as it is, and thinned as often as asked.
fn mesh_rasters(
    mesh: &Path,
    labels: &Path,
    args: &TrainArgs,
    features: FeatureSet,
    progress: &Progress,
) -> anyhow::Result<Vec<LabelledRaster>> {
    let is_outlines = labels.extension().is_some_and(|e| e.eq_ignore_ascii_case("geojson"));
    let (maps, name) = if is_outlines {
        (vec![outlined(mesh, labels)?], labels.file_stem())
    } else {
        (read_maps(labels)?, mesh.file_name())
    };
    let source = name.map_or_else(|| mesh.display().to_string(), |n| n.to_string_lossy().into_owned());
    let mut rasters = rasters_of(mesh, &maps, &source, features, args.step, progress)?;
    for density in &args.thin {
        let folder = tempfile::tempdir().context("a folder for a thinned mesh")?;
        let thinned = thinned::write(mesh, *density, folder.path())?;
        rasters.extend(rasters_of(&thinned, &maps, &source, features, args.step, progress)?);
    }
    Ok(rasters)
}

/// The labels that outlines give the pixels of a mesh.
fn outlined(mesh: &Path, file: &Path) -> anyhow::Result<LabelMap> {
    let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let outlines = Outlines::parse(&text, &file.display().to_string())?;
    let (triangles, _) = thinned::triangles(mesh)?;
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.corners).collect();
    let scene = RealScene::new(outlines, &corners).with_context(|| file.display().to_string())?;
    let number = |label: Label| LABELS.iter().position(|l| *l == label).map_or(label_map::NONE, |n| n as u8);
    let labels = scene.labels().map(|label| label.map_or(label_map::NONE, number)).collect();
    let [width, height] = scene.size();
    Ok(LabelMap {
        name: "outlines".to_owned(),
        corner: scene.corner().to_array(),
        step: scene.step(),
        width,
        height,
        labels,
    })
}

fn read_maps(folder: &Path) -> anyhow::Result<Vec<LabelMap>> {
    label_map::read(folder, &Reach::everything()).map_err(|e| {
        UsageError(format!("{} has no labels of gable synth or gable run that can be used: {e:#}", folder.display()))
            .into()
    })
}

/// The rasters of a mesh, one for each label picture. Clutter is not looked at.
fn rasters_of(
    mesh: &Path,
    maps: &[LabelMap],
    source: &str,
    features: FeatureSet,
    step: f64,
    progress: &Progress,
) -> anyhow::Result<Vec<LabelledRaster>> {
    let work = tempfile::tempdir().context("a folder for rasters")?;
    let mut params = Params::default();
    params.set("sampling.step", &step.to_string())?;
    let mesh = sample_mesh(mesh, work.path(), &params, progress)?;
    // The published features see what the camera saw, as in a run.
    let saturation = if features == FeatureSet::Full { mesh.saturation() } else { 1.0 };
    maps.iter().map(|map| raster(map, &mesh, saturation, step, source)).collect()
}

/// One label picture with the rasters of the mesh below it.
fn raster(
    map: &LabelMap,
    mesh: &SampledMesh,
    saturation: f32,
    step: f64,
    source: &str,
) -> anyhow::Result<LabelledRaster> {
    let [x, y, _] = mesh.frame().origin;
    let cell = |world: f64, origin: f64| ((world - origin) / step).round() as i64;
    let extent = |pixels: usize| ((pixels as f64 * map.step) / step).floor() as usize;
    let (x0, y0) = (cell(map.corner[0], x), cell(map.corner[1], y));
    let window = GridWindow { step, x0, y0, width: extent(map.width), height: extent(map.height) };
    let maps = mesh.read(window)?;
    let mut labels = Vec::with_capacity(window.len());
    for row in 0..window.height {
        for column in 0..window.width {
            let p = window.centre(column, row);
            let label = map.at(p.x + x, p.y + y);
            labels.push(match label {
                label_map::NONE => UNKNOWN,
                _ if maps.height[(column, row)].is_nan() => UNKNOWN,
                label => label,
            });
        }
    }
    let (_, photographed) = maps.coverage();
    Ok(LabelledRaster {
        name: format!("{source}/{}", map.name),
        source: source.to_owned(),
        colour: (photographed > 0).then(|| saturated(&maps.colour, saturation)),
        geometry: Some((maps.height, maps.normal)),
        labels: Raster::new(window, labels),
    })
}

fn score_json(scores: &PlantScores) -> serde_json::Value {
    let one = |s: &Score| (s.pixels() > 0).then(|| json!({ "iou": s.iou(), "accuracy": s.accuracy() }));
    json!({ "tree": one(&scores.tree), "grass": one(&scores.grass) })
}

fn as_json(model: &Model, report: &TrainReport, rasters: usize) -> serde_json::Value {
    let held_out: Vec<_> =
        report.held_out.iter().map(|(name, score)| json!({ "source": name, "score": score_json(score) })).collect();
    json!({
        "rasters": rasters,
        "samples": report.samples,
        "features": model.features.name(),
        "stumps": model.tree.stumps.len(),
        "fit": score_json(&report.fit),
        "held_out": held_out,
    })
}

/// IoU and accuracy of both classifiers, of the model itself and of models that did not see a source.
fn text(report: &TrainReport) -> String {
    let figures = |s: &Score| match s.pixels() {
        0 => ["-".to_owned(), "-".to_owned()],
        _ => [format!("{:.3}", s.iou()), format!("{:.3}", s.accuracy())],
    };
    let row = |name: String, scores: &PlantScores| {
        [vec![name], figures(&scores.tree).to_vec(), figures(&scores.grass).to_vec()].concat()
    };
    let mut rows = vec![["", "tree IoU", "accuracy", "grass IoU", "accuracy"].map(str::to_owned).to_vec()];
    rows.push(row("on what it learnt from".to_owned(), &report.fit));
    rows.extend(report.held_out.iter().map(|(name, score)| row(format!("on {name}, learnt without it"), score)));
    table::render(&rows) + &format!("{} samples\n", report.samples)
}
