//! `gable bench`: named scenes through synth, run and eval, and one table of what came out.
//!
//! Each step is a child process of this program, so that times and peak memory are its own.

mod page;
mod places;
mod real;
pub(super) use real::LABELS;
mod record;
mod steps;
mod table;

use crate::cli::BenchArgs;
use crate::exit::{Outcome, UsageError};
use crate::terminal;
use anyhow::Context as _;
use record::{Entry, LeftOut, Sensing};
use serde_json::Value;
use steps::Bench;

/// A named scene.
struct Scene {
    name: &'static str,
    /// Area of the procedural town, km².
    area: f64,
    /// Copies in each direction, where the buildings come from a file.
    repeat: u32,
    /// Seed of the final tests.
    seed: u64,
}

const SCENES: [Scene; 4] = [
    Scene { name: "house", area: 0.01, repeat: 1, seed: 11 },
    Scene { name: "block", area: 0.048, repeat: 1, seed: 12 },
    Scene { name: "district", area: 1.38, repeat: 1, seed: 13 },
    Scene { name: "city", area: 12.2, repeat: 3, seed: 14 },
];

/// Tuning happens on scenes of other seeds.
const TUNING: u64 = 100;

/// A way to run a scene; the oracles are fed with truth, so that the table shows which stage loses what.
struct Row {
    name: &'static str,
    what: &'static str,
}

const ROWS: [Row; 5] = [
    Row { name: "default", what: "default" },
    Row { name: "zhu2018", what: "published (zhu2018)" },
    Row { name: "labels", what: "oracle: labels" },
    Row { name: "footprints", what: "oracle: footprints" },
    Row { name: "planes", what: "oracle: footprints, planes" },
];

/// A scene that is harder than the table's in one way.
struct Variant {
    name: &'static str,
    change: fn(&mut Sensing),
}

const VARIANTS: [Variant; 5] = [
    Variant { name: "slope 15 %", change: |s| s.slope = 0.15 },
    Variant { name: "3 faces per m²", change: |s| s.density = 3.0 },
    Variant { name: "15 faces per m²", change: |s| s.density = 15.0 },
    Variant { name: "no texture", change: |s| s.texture = false },
    Variant { name: "noise × 2", change: |s| s.noise = 2.0 },
];

/// Runs the scenes.
pub(crate) fn run(args: &BenchArgs, quiet: bool) -> anyhow::Result<Outcome> {
    if args.scenes.iter().any(|s| s == real::NAME) {
        return real::run(args, quiet);
    }
    if args.scenes.iter().any(|s| s == places::NAME) {
        return places::run(args, quiet);
    }
    let scenes = chosen(&args.scenes, &SCENES.map(|s| s.name), "scene")?;
    let rows = chosen(&args.rows, &ROWS.map(|r| r.name), "row")?;
    let left_out = args.leave_out.iter().map(|text| left_out(text)).collect::<Result<Vec<_>, _>>()?;
    let bench = Bench { args, quiet, program: std::env::current_exe().context("the path of this program")? };
    let mut entries = Vec::new();
    let mut keep = |entry: Entry| -> anyhow::Result<()> {
        if let Some(folder) = &args.write {
            table::write(folder, &entry)?;
        }
        entries.push(entry);
        Ok(())
    };
    let remove = |folder: &std::path::Path| {
        let gone = if args.keep { Ok(()) } else { std::fs::remove_dir_all(folder) };
        gone.with_context(|| folder.display().to_string())
    };
    for place in scenes {
        let (scene, sensing) = (&SCENES[place], bench.sensing());
        let folder = args.out.join(scene.name);
        let mut made = None;
        for &i in &rows {
            let row = &ROWS[i];
            if let Some(known) = left_out.iter().find(|l| l.order[..2] == [place, i]) {
                keep(Entry::LeftOut(known.clone()))?;
                continue;
            }
            let city = match &mut made {
                Some(city) => city,
                none => none.insert(bench.synth(scene, sensing, &folder)?),
            };
            let mut record = bench.row(scene, row, &folder, city)?;
            record.order = [place, i, 0];
            if row.name == "default" && args.one_thread {
                record.one_thread = Some(bench.on_one_thread(scene, &folder)?);
            }
            if row.name == "default" && args.grids {
                record.grids = Some(bench.grids(scene, &folder)?);
            }
            keep(Entry::Measured(Box::new(record)))?;
            remove(&folder.join(row.name))?;
        }
        for (i, variant) in VARIANTS.iter().enumerate().filter(|_| args.variants) {
            let mut other = sensing;
            (variant.change)(&mut other);
            let folder = folder.join(format!("variant{i}"));
            let city = bench.synth(scene, other, &folder)?;
            let mut record = bench.row(scene, &ROWS[0], &folder, &city)?;
            (record.order, record.variant) = ([place, 0, i + 1], Some(variant.name.to_owned()));
            keep(Entry::Measured(Box::new(record)))?;
            remove(&folder)?;
        }
        if folder.exists() {
            remove(&folder)?;
        }
    }
    if args.json {
        terminal::json(&entries);
    } else {
        terminal::stdout(&table::text(&entries));
    }
    Ok(Outcome::Success)
}

/// Reads `SCENE:ROW=REASON`.
fn left_out(text: &str) -> Result<LeftOut, UsageError> {
    let form = || UsageError(format!("--leave-out {text:?}: give it as SCENE:ROW=REASON"));
    let (place, reason) = text.split_once('=').ok_or_else(form)?;
    let (scene, row) = place.split_once(':').ok_or_else(form)?;
    let one = |name: &str, known: &[&str], what| {
        let found = chosen(&[name.to_owned()], known, what)?;
        found.first().copied().ok_or_else(form)
    };
    let (s, r) = (one(scene, &SCENES.map(|s| s.name), "scene")?, one(row, &ROWS.map(|r| r.name), "row")?);
    if reason.trim().is_empty() {
        return Err(form());
    }
    let (scene, row) = (SCENES[s].name.to_owned(), ROWS[r].what.to_owned());
    Ok(LeftOut { scene, row, order: [s, r, 0], reason: reason.trim().to_owned() })
}

/// The numbers of the names asked for, in the order of `known`; all if none is.
fn chosen(asked: &[String], known: &[&str], what: &str) -> Result<Vec<usize>, UsageError> {
    if let Some(other) = asked.iter().find(|a| !known.contains(&a.as_str())) {
        return Err(UsageError(format!("there is no {what} {other:?}: give some of {}", known.join(", "))));
    }
    Ok((0..known.len()).filter(|&i| asked.is_empty() || asked.iter().any(|a| a == known[i])).collect())
}

/// A number inside a JSON value.
fn number(value: &Value, path: &[&str]) -> anyhow::Result<f64> {
    let found = path.iter().fold(value, |v, key| &v[*key]);
    found.as_f64().with_context(|| format!("the figure {} is missing", path.join(".")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_and_rows_are_chosen_by_name() {
        let known = ["house", "block", "city"];
        assert_eq!(chosen(&[], &known, "scene").unwrap(), [0, 1, 2]);
        assert_eq!(chosen(&["city".to_owned(), "house".to_owned()], &known, "scene").unwrap(), [0, 2]);
        let message = chosen(&["town".to_owned()], &known, "scene").unwrap_err().to_string();
        assert!(message.contains("town") && message.contains("house, block, city"), "{message}");
    }

    #[test]
    fn rows_are_left_out_for_a_reason() {
        let left = left_out("district:zhu2018=takes hours = too long").unwrap();
        assert_eq!((left.scene.as_str(), left.row.as_str()), ("district", "published (zhu2018)"));
        assert_eq!((left.order, left.reason.as_str()), ([2, 1, 0], "takes hours = too long"));
        for wrong in ["district:zhu2018", "district:zhu2018= ", "district=slow", "town:zhu2018=slow", "house:fast=x"] {
            assert!(left_out(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn test_seeds_and_tuning_seeds_are_apart() {
        for scene in &SCENES {
            assert!((1..100).contains(&scene.seed) && (101..200).contains(&(scene.seed + TUNING)));
        }
    }
}
