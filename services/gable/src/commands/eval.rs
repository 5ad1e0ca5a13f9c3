//! `gable eval`: how good a result is.

use crate::cli::EvalArgs;
use crate::exit::{Outcome, UsageError};
use crate::terminal;
use anyhow::Context as _;
use gable_city_model::{CityModel, ReadOptions, read_cityjson};
use gable_evaluation::{Evaluation, Inputs, LabelRasters, Options, evaluate, html_report, inspect};
use gable_files::Reach;
use gable_geometry::DVec3;
use gable_pipeline::label_map::{self, CLASSES};
use gable_scene::{OpenOptions, Scene, SceneError, Triangle};
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;

/// Measures a result.
pub(crate) fn run(args: &EvalArgs) -> anyhow::Result<Outcome> {
    let Some(truth) = &args.truth else { return alone(args) };
    let (evaluation, report) =
        measure(truth, &args.result, args.mesh.as_deref(), args.again.as_deref(), args.report.as_deref())?;
    if args.json {
        terminal::json(&evaluation);
    } else {
        terminal::stdout(&evaluation.table());
        if let Some(report) = report {
            terminal::stdout(&format!("report: {}", report.display()));
        }
    }
    Ok(Outcome::Success)
}

/// Measures a result for which there is no truth.
fn alone(args: &EvalArgs) -> anyhow::Result<Outcome> {
    let (result, options) = (read(&args.result)?, Options::default());
    let inspection = match &args.mesh {
        Some(mesh) => {
            let origin = DVec3::from_array(result.origin);
            with_triangles(mesh, origin, |triangles| inspect(&result, Some(triangles), &options))??
        }
        None => inspect(&result, None, &options)?,
    };
    if args.json {
        terminal::json(&inspection);
    } else {
        terminal::stdout(&inspection.table());
    }
    Ok(Outcome::Success)
}

/// Measures a result and writes the report, whose path is returned if there is one.
pub(crate) fn measure(
    truth: &Path,
    result: &Path,
    mesh: Option<&Path>,
    again: Option<&Path>,
    report: Option<&Path>,
) -> anyhow::Result<(Evaluation, Option<PathBuf>)> {
    let labels = labels(truth, result)?;
    let rasters = labels.as_ref().map(|(width, height, step, [truth, result])| LabelRasters {
        width: *width,
        height: *height,
        step: *step,
        classes: &CLASSES,
        truth,
        result,
    });
    let truth = read(truth)?;
    let report = report.map(Path::to_owned).or_else(|| result.is_dir().then(|| result.join("evaluation.html")));
    let result = read(result)?;
    let again = again.map(read).transpose()?;
    let options = Options::default();
    let inputs = Inputs { again: again.as_ref(), labels: rasters, ..Inputs::new(&truth, &result) };
    let evaluation = match mesh {
        Some(mesh) => {
            let origin = DVec3::from_array(truth.origin);
            with_triangles(mesh, origin, |triangles| evaluate(Inputs { mesh: Some(triangles), ..inputs }, &options))??
        }
        None => evaluate(inputs, &options)?,
    };
    if let Some(path) = &report {
        let page = html_report(&truth, &result, &evaluation, &options)?;
        std::fs::write(path, page).with_context(|| path.display().to_string())?;
    }
    Ok((evaluation, report))
}

/// What `measure` makes of the triangles of a mesh, relative to an origin. The mesh is read on another thread meanwhile, a piece at
/// a time.
fn with_triangles<T>(
    mesh: &Path,
    origin: DVec3,
    measure: impl FnOnce(Box<dyn Iterator<Item = [DVec3; 3]>>) -> T,
) -> anyhow::Result<T> {
    let scene = Scene::open(super::mesh_folder(mesh), &OpenOptions::default())?;
    let (sender, receiver) = sync_channel::<Vec<[DVec3; 3]>>(4);
    std::thread::scope(|scope| {
        let reader = scope.spawn(move || {
            scene.for_each_chunk::<SceneError>(|chunk: &[Triangle]| {
                // The other side ends early only if it fails, and then says why.
                sender.send(chunk.iter().map(|t| t.corners.map(|c| c - origin)).collect()).ok();
                Ok(())
            })
        });
        let measured = measure(Box::new(receiver.into_iter().flatten()));
        reader.join().map_err(|_| anyhow::anyhow!("{}: reading the mesh failed", mesh.display()))??;
        Ok(measured)
    })
}

/// The labels of both, where both are folders that have them.
fn labels(truth: &Path, result: &Path) -> anyhow::Result<Option<(usize, usize, f64, [Vec<u8>; 2])>> {
    let inner = truth.join("truth");
    let truth = if inner.join("labels").is_dir() { &inner } else { truth };
    if !truth.join("labels").is_dir() || !result.join("labels").is_dir() {
        return Ok(None);
    }
    let reach = Reach::everything();
    Ok(label_map::together(&label_map::read(truth, &reach)?, &label_map::read(result, &reach)?)?)
}

/// The city model in a file, or in a folder of a truth or a result.
pub(super) fn read(path: &Path) -> anyhow::Result<CityModel> {
    let reading = read_cityjson(&model_file(path)?, &ReadOptions::default())?;
    for note in &reading.notes {
        tracing::info!("{}: {note}", path.display());
    }
    Ok(reading.model)
}

/// The file of a model that may be named by its folder.
fn model_file(path: &Path) -> Result<PathBuf, UsageError> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let names = ["truth.city.jsonl", "city.city.jsonl", "truth/truth.city.jsonl"];
    names.iter().map(|name| path.join(name)).find(|file| file.is_file()).ok_or_else(|| {
        UsageError(format!("{}: none of {} is in this folder: name the file", path.display(), names.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_stand_for_their_model() {
        let folder = tempfile::tempdir().unwrap();
        let message = model_file(folder.path()).unwrap_err().to_string();
        assert!(message.contains("city.city.jsonl"), "{message}");
        let file = folder.path().join("city.city.jsonl");
        std::fs::write(&file, "").unwrap();
        assert_eq!(model_file(folder.path()).unwrap(), file);
        assert_eq!(model_file(&file).unwrap(), file);
    }
}
