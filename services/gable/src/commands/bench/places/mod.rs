//! `gable bench places`: small places with what real ones have and the town has not, through synth, run and eval.

mod record;
mod rows;
mod table;
mod truth;

use super::real::{self, LABELS, mosaic, orthophoto};
use super::steps::{self, Bench};
use super::{TUNING, chosen, number};
use crate::cli::BenchArgs;
use crate::commands::eval;
use crate::commands::thinned::triangles;
use crate::exit::Outcome;
use crate::terminal;
use anyhow::Context as _;
use gable_evaluation::Evaluation;
use gable_evaluation::real::{RealScene, judge, overlay_jpeg};
use gable_files::Reach;
use gable_geometry::{DVec2, DVec3};
use gable_pipeline::label_map;
use record::PlaceRecord;
use rows::{ROWS, Row};
use serde_json::Value;
use truth::Truth;

/// Name among the scenes.
pub(super) const NAME: &str = "places";

/// Makes and measures all places that are asked for.
pub(super) fn run(args: &BenchArgs, quiet: bool) -> anyhow::Result<Outcome> {
    real::refuse_others(args)?;
    let names: Vec<&str> = ROWS.iter().map(|r| r.name).collect();
    let bench = Bench { args, quiet, program: std::env::current_exe().context("the path of this program")? };
    let mut records = Vec::new();
    for order in chosen(&args.only, &names, "place")? {
        let record = measure(&bench, &ROWS[order], order)?;
        if let Some(folder) = &args.write {
            table::write(folder, &record)?;
        }
        records.push(record);
    }
    if args.json {
        terminal::json(&records);
    } else {
        terminal::stdout(&table::text(&records));
    }
    Ok(Outcome::Success)
}

/// What `gable synth` is asked for.
fn synth_arguments(row: &Row, tuning: bool) -> Vec<String> {
    let seed = row.seed + if tuning { TUNING } else { 0 };
    let mut arguments = vec!["--place".to_owned(), row.quarter.to_owned(), "--seed".to_owned(), seed.to_string()];
    let mut give = |name: &str, value: String| arguments.extend([name.to_owned(), value]);
    give("--slope", row.slope.to_string());
    give("--density", row.density.to_string());
    give("--tile-size", row.tile.to_string());
    if !row.with.is_empty() {
        give("--with", row.with.to_owned());
    }
    // Of a place of which everything is drawn, its size and look are too.
    if row.quarter != "any" {
        give("--side", row.side.to_string());
        give("--texel", row.texel.to_string());
        give("--cast", row.cast.to_owned());
        give("--season", row.season.to_owned());
    }
    arguments
}

/// Makes, runs and judges one place.
fn measure(bench: &Bench<'_>, row: &Row, order: usize) -> anyhow::Result<PlaceRecord> {
    let args = bench.args;
    let synth_arguments = synth_arguments(row, args.tuning);
    bench.tell(&format!("{}: {}", row.name, synth_arguments.join(" ")));
    let folder = args.out.join(NAME).join(file_name(row.name));
    bench.remove(&folder)?;
    let [city, result] = ["city", "result"].map(|name| folder.join(name));
    let [city_text, result_text] = [&city, &result].map(|path| path.display().to_string());
    let mut arguments = vec!["synth", "--json", "--out", &city_text];
    arguments.extend(synth_arguments.iter().map(String::as_str));
    let made = bench.child(row.name, &arguments)?;
    let mut arguments = vec!["run", &city_text, "--out", &result_text, "--json", "--set", "output.labels=true"];
    for setting in &args.settings {
        arguments.extend(["--set", setting]);
    }
    let summary = bench.child(row.name, &arguments)?;
    let truth = city.join("truth");
    let truth_text = truth.display().to_string();
    let figures = bench.child(row.name, &["eval", "--truth", &truth_text, "--result", &result_text, "--json"])?;

    let model = eval::read(&result)?;
    let known = Truth::read(&truth)?;
    let (triangles, content) = triangles(&city)?;
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.corners).collect();
    let scene = RealScene::made(&eval::read(&truth)?, &|p| known.class(p), &corners)?;
    let labels = mosaic(&label_map::read(&result, &Reach::everything())?)?;
    let label = |p: DVec2| labels.as_ref().and_then(|map| LABELS.get(usize::from(map.at(p.x, p.y))).copied());
    let judged = judge(&scene, &model, &label);

    let colours = orthophoto::colours(&scene, &triangles, &content.materials);
    let picture = overlay_jpeg(&scene, &model, colours.as_deref())?;
    let pictures = args.write.as_ref().unwrap_or(&args.out).join("pictures");
    std::fs::create_dir_all(&pictures).with_context(|| pictures.display().to_string())?;
    let picture_file = pictures.join(format!("{NAME}-{}.jpg", file_name(row.name)));
    std::fs::write(&picture_file, picture).with_context(|| picture_file.display().to_string())?;
    bench.tell(&format!("{}: picture {}", row.name, picture_file.display()));
    if !args.keep {
        bench.remove(&folder)?;
    }
    record(row, order, synth_arguments, &made, &summary, &figures, judged)
}

fn record(
    row: &Row,
    order: usize,
    synth_arguments: Vec<String>,
    made: &Value,
    summary: &Value,
    figures: &Value,
    judged: gable_evaluation::real::RealFigures,
) -> anyhow::Result<PlaceRecord> {
    let evaluation: Evaluation = serde_json::from_value(figures.clone())?;
    Ok(PlaceRecord {
        row: row.name.to_owned(),
        order,
        synth_arguments,
        mesh_faces: made["faces"].as_u64().unwrap_or(0),
        area_km2: number(made, &["area_m2"])? / 1e6,
        buildings: made["buildings"].as_u64().unwrap_or(0),
        date: steps::today(),
        cores: steps::cores(),
        build: steps::BUILD.to_owned(),
        synth: steps::synth_cost(made)?,
        run: super::record::timing(summary)?,
        figures: super::record::figures(figures)?,
        judged,
        terrain: evaluation.terrain.map(|t| [t.open.rms, t.open_bias]),
    })
}

/// The name of a row as that of a file.
fn file_name(name: &str) -> String {
    let plain = |letter: char| if letter.is_ascii_alphanumeric() || letter == '.' { letter } else { '-' };
    name.chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn rows_have_names_files_and_seeds_of_their_own() {
        let names: BTreeSet<String> = ROWS.iter().map(|r| file_name(r.name)).collect();
        let seeds: BTreeSet<u64> = ROWS.iter().map(|r| r.seed).collect();
        assert_eq!((names.len(), seeds.len()), (ROWS.len(), ROWS.len()));
        assert!(seeds.iter().all(|seed| (1..100).contains(seed)), "those of tuning are above");
        assert!(ROWS.iter().all(|r| !r.name.contains(',')), "commas part the names of --only");
    }

    #[test]
    fn every_kind_of_quarter_and_feature_has_a_row() {
        use gable_synthetic_city::{Feature, Quarter};
        for quarter in Quarter::ALL {
            assert!(ROWS.iter().any(|r| r.quarter == quarter.name()), "{quarter:?}");
        }
        for feature in Feature::ALL {
            assert!(ROWS.iter().any(|r| r.with.split(',').any(|w| w == feature.name())), "{feature:?}");
        }
    }
}
