//! `gable bench real`: real meshes through run, against outlines drawn by hand, and one table of what came out.

pub(super) mod orthophoto;
mod record;
mod scenes;
mod table;

use super::steps::{self, Bench};
use super::{chosen, number};
use crate::cli::BenchArgs;
use crate::commands::{eval, thinned};
use crate::exit::{Outcome, UsageError};
use crate::terminal;
use anyhow::Context as _;
use gable_evaluation::real::{Label, Outlines, RealScene, judge, overlay_jpeg};
use gable_files::Reach;
use gable_geometry::{DVec2, DVec3};
use gable_pipeline::PipelineError;
use gable_pipeline::label_map::{self, CLASSES, LabelMap};
use record::RealRecord;
use scenes::{Half, RealPlace};
use std::path::Path;

/// Name among the scenes.
pub(super) const NAME: &str = "real";

/// Labels in the order of [`CLASSES`].
pub(crate) const LABELS: [Label; CLASSES.len()] = [Label::Ground, Label::Grass, Label::Tree, Label::Building];

/// Measures all real meshes that are asked for and at hand.
pub(super) fn run(args: &BenchArgs, quiet: bool) -> anyhow::Result<Outcome> {
    refuse_others(args)?;
    let places = scenes::read(&args.outlines)?;
    let names: Vec<&str> = places.iter().map(|p| p.name.as_str()).collect();
    let bench = Bench { args, quiet, program: std::env::current_exe().context("the path of this program")? };
    let mut records = Vec::new();
    let mut skipped = Vec::new();
    for number in chosen(&args.only, &names, "real mesh")? {
        let place = &places[number];
        if args.tuning && place.half != Half::Tuning {
            continue;
        }
        let mesh = args.data.join(&place.mesh);
        if !mesh.exists() {
            let reason = format!("skipped {}: {} is not there", place.name, mesh.display());
            bench.tell(&reason);
            skipped.push(reason);
            continue;
        }
        let record = match args.thin {
            None => measure(&bench, place, number, &mesh)?,
            Some(density) => {
                let folder = args.out.join("thinned").join(&place.name);
                let record = measure(&bench, place, number, &thinned::write(&mesh, density, &folder)?)?;
                bench.remove(&folder)?;
                record
            }
        };
        if let Some(folder) = &args.write {
            table::write(folder, &record)?;
        }
        records.push(record);
    }
    if records.is_empty() {
        let where_from = "give the folder of the meshes by --data or GABLE_TEST_DATA";
        return Err(UsageError(format!("nothing was measured; {where_from}\n{}", skipped.join("\n"))).into());
    }
    if args.json {
        terminal::json(&records);
    } else {
        terminal::stdout(&(table::text(&records) + &skipped.join("\n")));
    }
    Ok(Outcome::Success)
}

/// What belongs to other scenes has no meaning here and with places, and is not passed over in silence.
pub(super) fn refuse_others(args: &BenchArgs) -> Result<(), UsageError> {
    let others = [
        ("other scenes", args.scenes.len() > 1),
        ("--rows", !args.rows.is_empty()),
        ("--truth", args.truth.is_some()),
        ("--leave-out", !args.leave_out.is_empty()),
        ("--variants", args.variants),
        ("--grids", args.grids),
        ("--one-thread", args.one_thread),
    ];
    match others.iter().find(|o| o.1) {
        Some((what, _)) => Err(UsageError(format!("the scenes real and places stand by themselves: leave out {what}"))),
        None => Ok(()),
    }
}

/// Runs and judges one mesh.
fn measure(bench: &Bench<'_>, place: &RealPlace, number_of_place: usize, mesh: &Path) -> anyhow::Result<RealRecord> {
    let args = bench.args;
    bench.tell(&format!("{}: {}", place.name, mesh.display()));
    let file = args.outlines.join(format!("{}.geojson", place.name));
    let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    let outlines = Outlines::parse(&text, &file.display().to_string())?;

    let folder = args.out.join(NAME).join(&place.name);
    bench.remove(&folder)?;
    let (input, out) = (mesh.display().to_string(), folder.display().to_string());
    let mut arguments = vec!["run", &input, "--out", &out, "--json", "--set", "output.labels=true"];
    for setting in &args.settings {
        arguments.extend(["--set", setting]);
    }
    let summary = bench.child(&place.name, &arguments)?;

    let (triangles, content) = thinned::triangles(mesh)?;
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.corners).collect();
    let scene = RealScene::new(outlines, &corners).with_context(|| file.display().to_string())?;
    let model = eval::read(&folder)?;
    let labels = mosaic(&label_map::read(&folder, &Reach::everything())?)?;
    let label = |p: DVec2| labels.as_ref().and_then(|map| LABELS.get(usize::from(map.at(p.x, p.y))).copied());
    let figures = judge(&scene, &model, &label);

    let colours = orthophoto::colours(&scene, &triangles, &content.materials);
    let picture = overlay_jpeg(&scene, &model, colours.as_deref())?;
    let pictures = args.write.as_ref().unwrap_or(&args.out).join("pictures");
    std::fs::create_dir_all(&pictures).with_context(|| pictures.display().to_string())?;
    let picture_file = pictures.join(format!("{NAME}-{}.jpg", place.name));
    std::fs::write(&picture_file, picture).with_context(|| picture_file.display().to_string())?;
    bench.tell(&format!("{}: picture {}", place.name, picture_file.display()));
    if !args.keep {
        bench.remove(&folder)?;
    }
    Ok(RealRecord {
        scene: place.name.clone(),
        half: place.half,
        row: args.thin.map_or_else(|| args.row.clone(), |density| format!("{density} faces per m², no texture")),
        order: number_of_place,
        mesh_faces: content.counts.triangles,
        area_km2: number(&summary, &["area_m2"])? / 1e6,
        date: steps::today(),
        cores: steps::cores(),
        build: steps::BUILD.to_owned(),
        run: super::record::timing(&summary)?,
        figures,
    })
}

/// The maps of all blocks as one; `None` if there is none.
pub(super) fn mosaic(maps: &[LabelMap]) -> Result<Option<LabelMap>, PipelineError> {
    let Some((width, height, step, [labels, _])) = label_map::together(maps, maps)? else { return Ok(None) };
    let lowest = |axis: usize| maps.iter().map(|m| m.corner[axis]).reduce(f64::min);
    let corner = lowest(0).zip(lowest(1));
    Ok(corner.map(|(west, south)| LabelMap { name: String::new(), corner: [west, south], step, width, height, labels }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_pipeline::label_map::NONE;

    #[test]
    fn blocks_are_put_together() {
        let map = |corner: [f64; 2], label: u8| {
            let labels = vec![label; 4];
            LabelMap { name: String::new(), corner, step: 0.5, width: 2, height: 2, labels }
        };
        assert_eq!(mosaic(&[]).unwrap(), None);
        let all = mosaic(&[map([11.0, 20.0], 3), map([10.0, 21.0], 1)]).unwrap().unwrap();
        let at = |x: f64, y: f64| LABELS.get(usize::from(all.at(x, y))).copied();
        assert_eq!((at(11.2, 20.9), at(10.9, 21.1)), (Some(Label::Building), Some(Label::Grass)));
        assert_eq!((at(10.2, 20.2), at(9.0, 20.2)), (None, None));
        assert_eq!(all.at(10.2, 20.2), NONE);
    }

    #[test]
    fn labels_have_the_numbers_of_their_names() {
        let names = ["Ground", "Grass", "Tree", "Building"];
        assert_eq!(LABELS.map(|l| format!("{l:?}")), names);
        assert_eq!(CLASSES, names.map(str::to_lowercase).each_ref().map(String::as_str));
    }
}
