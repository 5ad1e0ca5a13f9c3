//! `gable run`: a city mesh in, a city model out.

use crate::cli::RunArgs;
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::{interrupt, table, terminal};
use gable_files::Reach;
use gable_pipeline::{BlockState, Lod, RunStatus, RunSummary};
use std::path::Path;

/// Models a city.
pub(crate) fn run(args: &RunArgs, quiet: bool) -> anyhow::Result<Outcome> {
    let params = super::assemble(&args.params)?;
    let reach = super::reach(&args.source_roots)?;
    let summary = observed(&super::mesh_folder(&args.input), &args.out, &params, &reach, quiet)?;
    if args.json {
        terminal::json(&summary);
    } else if !quiet {
        terminal::stdout(&text(&summary, &args.out));
    }
    Ok(outcome(&summary))
}

/// A run with progress at the terminal and Ctrl-C handled.
pub(crate) fn observed(
    input: &Path,
    out: &Path,
    params: &gable_pipeline::Params,
    reach: &Reach,
    quiet: bool,
) -> anyhow::Result<RunSummary> {
    interrupt::listen();
    let progress = Progress::new(quiet);
    let result = gable_pipeline::run(input, out, params, reach, &progress);
    progress.finish();
    Ok(result?)
}

/// What the status means for the exit code.
pub(crate) fn outcome(summary: &RunSummary) -> Outcome {
    match summary.status {
        RunStatus::Successful => Outcome::Success,
        RunStatus::Partial => Outcome::Partial,
    }
}

/// The summary as a person wants it.
fn text(summary: &RunSummary, out: &Path) -> String {
    let count = |lod| summary.at_lod(lod).to_string();
    let mut rows = vec![
        vec!["result".to_owned(), String::new()],
        vec!["buildings".to_owned(), summary.buildings.to_string()],
        vec!["  at LOD2".to_owned(), count(Lod::Lod2)],
        vec!["  at LOD1 only".to_owned(), count(Lod::Lod1)],
        vec!["  at LOD0 only".to_owned(), count(Lod::Lod0)],
        vec!["  not written".to_owned(), count(Lod::None)],
        vec!["faces".to_owned(), summary.faces.to_string()],
        vec!["input triangles".to_owned(), summary.triangles.to_string()],
        vec!["area".to_owned(), format!("{:.3} km²", summary.area_m2 / 1e6)],
        vec!["time".to_owned(), format!("{:.1} s", summary.seconds)],
        vec!["core time per pixel".to_owned(), format!("{:.2} µs", summary.core_micros_per_pixel())],
        vec!["peak memory".to_owned(), format!("{:.0} MB", summary.peak_memory_bytes as f64 / 1e6)],
    ];
    rows.push(vec!["kinds of warnings".to_owned(), summary.warnings.len().to_string()]);
    let mut text = table::render(&rows);
    for block in summary.failed_blocks() {
        if let BlockState::Failed(reason) = &block.status {
            text += &format!("block {}_{} failed: {reason}\n", block.ix, block.iy);
        }
    }
    if summary.failed_blocks().next().is_some() {
        text += "the rest of the city is there; the same command tries failed blocks again\n";
    }
    text += &format!("result: {}\n", out.display());
    let report = out.join("report.html");
    if report.is_file() {
        text += &format!("report: {}\n", report.display());
    }
    text
}
