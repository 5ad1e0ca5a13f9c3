//! `gable bench`: named scenes through synth, run and eval, and one table of what came out.
//!
//! Each step is a child process of this program, so that times and peak memory are its own.

mod record;
mod table;

use crate::cli::BenchArgs;
use crate::exit::{Outcome, UsageError};
use crate::terminal;
use anyhow::{Context as _, bail};
use record::{Cost, Record};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

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

/// Blocks have the size of those of the city of 12.2 km² in 16 × 16.
const BLOCK: &str = "218";

/// Runs the scenes.
pub(crate) fn run(args: &BenchArgs, quiet: bool) -> anyhow::Result<Outcome> {
    let scenes = chosen(&args.scenes, &SCENES.map(|s| s.name), "scene")?;
    let rows = chosen(&args.rows, &ROWS.map(|r| r.name), "row")?;
    let bench = Bench { args, quiet, program: std::env::current_exe().context("the path of this program")? };
    let mut records = Vec::new();
    for scene in scenes.into_iter().map(|i| &SCENES[i]) {
        let folder = args.out.join(scene.name);
        let made = bench.synth(scene, &folder.join("city"))?;
        for row in rows.iter().map(|&i| &ROWS[i]) {
            let record = bench.row(scene, row, &folder, &made)?;
            if let Some(kept) = &args.write {
                table::write(kept, &record)?;
            }
            records.push(record);
            if !args.keep {
                std::fs::remove_dir_all(folder.join(row.name)).with_context(|| folder.display().to_string())?;
            }
        }
        if !args.keep {
            std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
        }
    }
    if args.json {
        terminal::json(&records);
    } else {
        terminal::stdout(&table::text(&records));
    }
    Ok(Outcome::Success)
}

/// The numbers of the names asked for, in the order of `known`; all if none is.
fn chosen(asked: &[String], known: &[&str], what: &str) -> Result<Vec<usize>, UsageError> {
    if let Some(other) = asked.iter().find(|a| !known.contains(&a.as_str())) {
        return Err(UsageError(format!("there is no {what} {other:?}: give some of {}", known.join(", "))));
    }
    Ok((0..known.len()).filter(|&i| asked.is_empty() || asked.iter().any(|a| a == known[i])).collect())
}

struct Bench<'a> {
    args: &'a BenchArgs,
    quiet: bool,
    program: std::path::PathBuf,
}

/// A scene that has been made.
struct Made {
    seed: u64,
    faces: u64,
    area_km2: f64,
    cost: Cost,
}

impl Bench<'_> {
    fn tell(&self, text: &str) {
        if !self.quiet {
            terminal::stderr_line(text);
        }
    }

    fn synth(&self, scene: &Scene, out: &Path) -> anyhow::Result<Made> {
        let seed = scene.seed + if self.args.tuning { TUNING } else { 0 };
        self.tell(&format!("{}: making the scene, seed {seed}", scene.name));
        let (out, seed_text) = (out.display().to_string(), seed.to_string());
        let mut arguments = vec!["synth", "--out", &out, "--seed", &seed_text, "--json"];
        let (area, repeat) = (scene.area.to_string(), scene.repeat.to_string());
        // A house and a block are cut from no file: they stay procedural.
        let truth = self.args.truth.as_ref().filter(|_| scene.area > 1.0).map(|t| t.display().to_string());
        match &truth {
            Some(file) => arguments.extend(["--truth", file, "--repeat", &repeat]),
            None => arguments.extend(["--procedural", "--area", &area]),
        }
        let (density, slope) = (self.args.density.to_string(), self.args.slope.to_string());
        arguments.extend(["--density", &density, "--slope", &slope]);
        let report = self.child(scene.name, &arguments)?;
        Ok(Made {
            seed,
            faces: report["faces"].as_u64().unwrap_or(0),
            area_km2: number(&report, &["area_m2"])? / 1e6,
            cost: Cost {
                wall: number(&report, &["seconds"])?,
                core: number(&report, &["core_seconds"])?,
                peak_memory_bytes: report["peak_memory_bytes"].as_u64().unwrap_or(0),
            },
        })
    }

    fn row(&self, scene: &Scene, row: &Row, folder: &Path, made: &Made) -> anyhow::Result<Record> {
        self.tell(&format!("{}: {}", scene.name, row.what));
        let (city, result) = (folder.join("city"), folder.join(row.name));
        if result.exists() {
            std::fs::remove_dir_all(&result).with_context(|| result.display().to_string())?;
        }
        let (city, truth, result) =
            (city.display().to_string(), city.join("truth").display().to_string(), result.display().to_string());
        let model = Path::new(&truth).join("truth.city.jsonl").display().to_string();
        let mut arguments: Vec<String> =
            ["run", &city, "--out", &result, "--block-size", BLOCK, "--set", "output.labels=true", "--json"]
                .map(str::to_owned)
                .to_vec();
        let mut set = |what: &str| arguments.extend(["--set".to_owned(), what.to_owned()]);
        match row.name {
            "labels" => set(&format!("segmentation.labels={truth}")),
            "footprints" => set(&format!("segmentation.footprints={model}")),
            "planes" => {
                set(&format!("segmentation.footprints={model}"));
                set(&format!("modeling.roofs={model}"));
            }
            "zhu2018" => arguments.extend(["--preset", "zhu2018"].map(str::to_owned)),
            _ => {}
        }
        for setting in &self.args.settings {
            arguments.extend(["--set".to_owned(), setting.clone()]);
        }
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let summary = self.child(scene.name, &arguments)?;
        let begin = Instant::now();
        let figures = self.child(scene.name, &["eval", "--truth", &truth, "--result", &result, "--json"])?;
        let eval_seconds = begin.elapsed().as_secs_f64();
        Ok(Record {
            scene: scene.name.to_owned(),
            row: row.what.to_owned(),
            order: [
                SCENES.iter().position(|s| s.name == scene.name).unwrap_or(0),
                ROWS.iter().position(|r| r.name == row.name).unwrap_or(0),
            ],
            source: self.args.truth.as_ref().filter(|_| scene.area > 1.0).map_or_else(
                || "procedural".to_owned(),
                |t| t.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            ),
            seed: made.seed,
            density: self.args.density,
            slope: self.args.slope,
            mesh_faces: made.faces,
            area_km2: made.area_km2,
            date: date(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs())),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            build: if cfg!(debug_assertions) { "debug" } else { "release" }.to_owned(),
            synth: made.cost,
            eval_seconds,
            figures: record::figures(&figures)?,
            run: record::timing(&summary)?,
        })
    }

    /// Runs this program with other arguments; its progress goes where ours goes.
    fn child(&self, scene: &str, arguments: &[&str]) -> anyhow::Result<Value> {
        let mut command = Command::new(&self.program);
        command.args(arguments).stdin(Stdio::null()).stderr(Stdio::inherit());
        if self.quiet {
            command.arg("--quiet");
        }
        let output = command.output().with_context(|| self.program.display().to_string())?;
        if !output.status.success() {
            bail!("scene {scene}: gable {} ended with {}", arguments.join(" "), output.status);
        }
        serde_json::from_slice(&output.stdout).with_context(|| format!("the JSON of gable {}", arguments.join(" ")))
    }
}

/// A number inside a JSON value.
fn number(value: &Value, path: &[&str]) -> anyhow::Result<f64> {
    let found = path.iter().fold(value, |v, key| &v[*key]);
    found.as_f64().with_context(|| format!("the figure {} is missing", path.join(".")))
}

/// The day of a time in seconds since 1970 (UTC), as year-month-day.
fn date(seconds: u64) -> String {
    let leap = |y: u64| (y.is_multiple_of(4) && !y.is_multiple_of(100)) || y.is_multiple_of(400);
    let (mut days, mut year) = (seconds / 86_400, 1970);
    while days >= 365 + u64::from(leap(year)) {
        days -= 365 + u64::from(leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= lengths[month] {
        days -= lengths[month];
        month += 1;
    }
    format!("{year}-{:02}-{:02}", month + 1, days + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates() {
        assert_eq!(date(0), "1970-01-01");
        assert_eq!(date(951_782_399), "2000-02-28");
        assert_eq!(date(951_782_400), "2000-02-29");
        assert_eq!(date(1_798_761_599), "2026-12-31");
    }

    #[test]
    fn scenes_and_rows_are_chosen_by_name() {
        let known = ["house", "block", "city"];
        assert_eq!(chosen(&[], &known, "scene").unwrap(), [0, 1, 2]);
        assert_eq!(chosen(&["city".to_owned(), "house".to_owned()], &known, "scene").unwrap(), [0, 2]);
        let message = chosen(&["town".to_owned()], &known, "scene").unwrap_err().to_string();
        assert!(message.contains("town") && message.contains("house, block, city"), "{message}");
    }

    #[test]
    fn test_seeds_and_tuning_seeds_are_apart() {
        for scene in &SCENES {
            assert!((1..100).contains(&scene.seed) && (101..200).contains(&(scene.seed + TUNING)));
        }
    }
}
