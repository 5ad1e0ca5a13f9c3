//! `gable demo`: a small city made, modelled and measured.

use crate::cli::DemoArgs;
use crate::exit::Outcome;
use crate::{table, terminal};
use gable_evaluation::Evaluation;
use gable_files::Reach;
use gable_pipeline::{Lod, RunSummary};
use gable_synthetic_city::{Source, SynthParams};
use serde_json::json;

/// Makes, models and measures a city.
pub(crate) fn run(args: &DemoArgs, quiet: bool) -> anyhow::Result<Outcome> {
    let mut params = super::assemble(&args.params)?;
    // The demo shows how good the labels are, too.
    params.output.labels = true;
    let (city, result) = (args.out.join("city"), args.out.join("result"));
    let synth =
        SynthParams { seed: args.seed, source: Source::Procedural { area_km2: args.area }, ..SynthParams::default() };
    super::synth::observed(&synth, &city, quiet)?;
    let summary = super::run::observed(&city.join("mesh"), &result, &params, &Reach::everything(), quiet)?;
    let (evaluation, _) = super::eval::measure(&city.join("truth"), &result, None, None, None)?;
    if args.json {
        terminal::json(&json!({ "run": summary, "evaluation": evaluation }));
    } else {
        terminal::stdout(&text(&summary, &evaluation));
        terminal::stdout(&format!("report:     {}", result.join("report.html").display()));
        terminal::stdout(&format!("evaluation: {}", result.join("evaluation.html").display()));
    }
    Ok(super::run::outcome(&summary))
}

/// The figures that a person asks for first.
fn text(summary: &RunSummary, evaluation: &Evaluation) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut rows = vec![["", "result", "truth"].map(str::to_owned).to_vec()];
    let mut row = |name: &str, result: String, truth: String| rows.push(vec![name.to_owned(), result, truth]);
    for d in &evaluation.objects {
        let name = if d.from_m2 > 0.0 {
            format!("buildings found, from {} m²", d.from_m2)
        } else {
            "buildings found".to_owned()
        };
        row(&name, d.found.to_string(), d.truth.to_string());
    }
    row("buildings invented", evaluation.invented.len().to_string(), String::new());
    row("buildings at LOD2", summary.at_lod(Lod::Lod2).to_string(), String::new());
    for class in evaluation.labels.iter().flat_map(|l| &l.all.classes) {
        if let (true, Some(iou)) = (["building", "tree"].contains(&class.name.as_str()), class.iou) {
            row(&format!("labels, IoU of {}", class.name), percent(iou), String::new());
        }
    }
    row("footprint IoU, mean", percent(evaluation.footprints.blocks_from_50.mean_iou), String::new());
    row("roof RMSE, median", format!("{:.2} m", evaluation.roofs.height_rmse_median_from_50), String::new());
    let (ours, theirs) = (evaluation.complexity.result, evaluation.complexity.truth);
    row("faces", ours.polygons.to_string(), theirs.polygons.to_string());
    row("triangles", ours.triangles.to_string(), theirs.triangles.to_string());
    row("valid solids at LOD2", percent(evaluation.validity.lod2), String::new());
    row("seconds", format!("{:.1}", summary.seconds), String::new());
    row("core time per pixel", format!("{:.2} µs", summary.core_micros_per_pixel()), String::new());
    table::render(&rows)
}
