//! `gable synth`: a city mesh with known truth.

use crate::cli::SynthArgs;
use crate::exit::{Outcome, UsageError};
use crate::progress::Progress;
use crate::{table, terminal};
use gable_synthetic_city::{
    Feature, Look, Place, Quarter, RoofCase, Season, Source, SynthParams, SynthReport, synthesise,
};
use serde_json::json;
use std::path::Path;

/// Makes a city.
pub(crate) fn run(args: &SynthArgs, quiet: bool) -> anyhow::Result<Outcome> {
    let mut params = SynthParams {
        seed: args.seed,
        source: source(args)?,
        density: args.density,
        slope: args.slope,
        texture: !args.no_texture,
        noise: args.noise,
        look: look(args)?,
        tile_size: args.tile_size,
        ..SynthParams::default()
    };
    if let Source::Truth { model, .. } = &params.source {
        (params.origin, params.crs) = (model.origin, model.crs.clone());
    }
    if args.place.as_deref() == Some(ANY) {
        params.look = Look::drawn(args.seed);
    }
    let begin = std::time::Instant::now();
    let report = observed(&params, &args.out, quiet)?;
    if args.json {
        let mut told = as_json(&report);
        told["seconds"] = json!(begin.elapsed().as_secs_f64());
        told["core_seconds"] = json!(gable_pipeline::core_seconds());
        told["peak_memory_bytes"] = json!(gable_pipeline::peak_memory_bytes());
        terminal::json(&told);
    } else if !quiet {
        terminal::stdout(&text(&report, &args.out));
    }
    Ok(Outcome::Success)
}

/// Makes a city with progress at the terminal.
pub(crate) fn observed(params: &SynthParams, out: &Path, quiet: bool) -> anyhow::Result<SynthReport> {
    let progress = Progress::new(quiet);
    let begun = std::sync::Once::new();
    let result = synthesise(params, out, &|tile| {
        begun.call_once(|| progress.begin("synth", tile.total));
        progress.step("synth", "");
    });
    progress.finish();
    Ok(result?)
}

/// What the city is made from.
fn source(args: &SynthArgs) -> anyhow::Result<Source> {
    if let Some(path) = &args.truth {
        let reading = gable_city_model::read_cityjson(path, &gable_city_model::ReadOptions::default())?;
        for note in &reading.notes {
            tracing::info!("{}: {note}", path.display());
        }
        return Ok(Source::Truth { model: Box::new(reading.model), repeat: args.repeat });
    }
    if let Some(name) = &args.place {
        return Ok(Source::Place(place(args, name)?));
    }
    if let Some(name) = &args.case {
        let Some(case) = RoofCase::ALL.into_iter().find(|case| case_name(*case) == *name) else {
            let names: Vec<_> = RoofCase::ALL.into_iter().map(case_name).collect();
            return Err(UsageError(format!("there is no case {name:?}: the cases are {}", names.join(", "))).into());
        };
        return Ok(Source::Case(case));
    }
    Ok(Source::Procedural { area_km2: args.area })
}

/// The place that stands for one of which everything is drawn.
const ANY: &str = "any";

/// The place that is asked for.
fn place(args: &SynthArgs, name: &str) -> Result<Place, UsageError> {
    if name == ANY {
        if !args.with.is_empty() {
            return Err(UsageError("of the place any everything is drawn: leave out --with".to_owned()));
        }
        return Ok(Place::drawn(args.seed));
    }
    let Some(quarter) = Quarter::ALL.into_iter().find(|quarter| quarter.name() == name) else {
        let names: Vec<_> = Quarter::ALL.iter().map(|q| q.name()).collect();
        return Err(UsageError(format!("there is no place {name:?}: give {ANY} or one of {}", names.join(", "))));
    };
    let features = args.with.iter().map(|name| {
        Feature::ALL.iter().copied().find(|f| f.name() == name).ok_or_else(|| {
            let names: Vec<_> = Feature::ALL.iter().map(|f| f.name()).collect();
            UsageError(format!("a place cannot be had with {name:?}: give some of {}", names.join(", ")))
        })
    });
    let mut features = features.collect::<Result<Vec<_>, _>>()?;
    features.sort_unstable();
    features.dedup();
    Ok(Place { quarter, features, side: args.side })
}

/// How the pictures shall look.
fn look(args: &SynthArgs) -> Result<Look, UsageError> {
    let Some(season) = Season::ALL.into_iter().find(|season| season.name() == args.season) else {
        let names: Vec<_> = Season::ALL.iter().map(|s| s.name()).collect();
        return Err(UsageError(format!("there is no season {:?}: give one of {}", args.season, names.join(", "))));
    };
    let cast = args.cast.as_slice().try_into().map_err(|_| UsageError("--cast: give three gains".to_owned()))?;
    Ok(Look { texel: args.texel, cast, season })
}

/// The name of a case at the command line: its words in lower case, joined by hyphens.
fn case_name(case: RoofCase) -> String {
    let mut name = String::new();
    for letter in format!("{case:?}").chars() {
        if letter.is_ascii_uppercase() && !name.is_empty() {
            name.push('-');
        }
        name.push(letter.to_ascii_lowercase());
    }
    name
}

/// What was made, as JSON.
fn as_json(report: &SynthReport) -> serde_json::Value {
    json!({
        "tiles": report.tiles,
        "faces": report.faces,
        "vertices": report.vertices,
        "buildings": report.buildings,
        "roof_faces": report.roof_faces,
        "trees": report.trees,
        "area_m2": report.area,
        "bytes": report.bytes,
    })
}

fn text(report: &SynthReport, out: &Path) -> String {
    let rows = [
        ("city", String::new()),
        ("tiles", report.tiles.to_string()),
        ("faces", report.faces.to_string()),
        ("buildings", report.buildings.to_string()),
        ("roof faces", report.roof_faces.to_string()),
        ("trees", report.trees.to_string()),
        ("area", format!("{:.4} km²", report.area / 1e6)),
        ("size", format!("{:.1} MB", report.bytes as f64 / 1e6)),
    ];
    let rows: Vec<_> = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    table::render(&rows) + &format!("mesh:  {}\ntruth: {}\n", out.join("mesh").display(), out.join("truth").display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_have_plain_names() {
        assert_eq!(case_name(RoofCase::Gable), "gable");
        assert_eq!(case_name(RoofCase::FlatParapet), "flat-parapet");
    }
}
