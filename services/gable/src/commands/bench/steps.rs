//! The steps of the benchmark: each is a child process of this program.

use super::record::{self, Cost, Grids, Record, Sensing};
use super::{Row, Scene, TUNING, number};
use crate::cli::BenchArgs;
use crate::terminal;
use anyhow::{Context as _, bail};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Blocks have the size of those of the city of 12.2 km² in 16 × 16.
const BLOCK: &str = "218";

/// What every step needs.
pub(super) struct Bench<'a> {
    pub(super) args: &'a BenchArgs,
    pub(super) quiet: bool,
    pub(super) program: std::path::PathBuf,
}

/// A scene that has been made.
pub(super) struct Made {
    sensing: Sensing,
    seed: u64,
    faces: u64,
    area_km2: f64,
    cost: Cost,
}

impl Bench<'_> {
    pub(super) fn tell(&self, text: &str) {
        if !self.quiet {
            terminal::stderr_line(text);
        }
    }

    /// As asked for at the command line.
    pub(super) fn sensing(&self) -> Sensing {
        Sensing { density: self.args.density, slope: self.args.slope, texture: true, noise: 1.0 }
    }

    /// Makes the scene in `folder/city`, unless it stands there from a run with `--keep`: the same arguments give the
    /// same bytes, and what making it cost is kept beside it.
    pub(super) fn synth(&self, scene: &Scene, sensing: Sensing, folder: &Path) -> anyhow::Result<Made> {
        let seed = scene.seed + if self.args.tuning { TUNING } else { 0 };
        let seed_text = seed.to_string();
        let mut arguments = vec!["synth", "--json", "--seed", &seed_text];
        let (area, repeat) = (scene.area.to_string(), scene.repeat.to_string());
        // A house and a block are cut from no file: they stay procedural.
        let truth = self.args.truth.as_ref().filter(|_| scene.area > 1.0).map(|t| t.display().to_string());
        match &truth {
            Some(file) => arguments.extend(["--truth", file, "--repeat", &repeat]),
            None => arguments.extend(["--procedural", "--area", &area]),
        }
        let [density, slope, noise] = [sensing.density, sensing.slope, sensing.noise].map(|v| v.to_string());
        arguments.extend(["--density", &density, "--slope", &slope, "--noise", &noise]);
        if !sensing.texture {
            arguments.push("--no-texture");
        }
        let note = folder.join("made.json");
        let report = match kept(&note, &arguments)? {
            Some(report) => {
                self.tell(&format!("{}: the scene of seed {seed} is there", scene.name));
                report
            }
            None => {
                self.tell(&format!("{}: making the scene, seed {seed}", scene.name));
                self.remove(folder)?;
                let out = folder.join("city").display().to_string();
                let report = self.child(scene.name, &[&arguments[..], &["--out", &out]].concat())?;
                let text = serde_json::json!({ "arguments": arguments, "report": report }).to_string();
                std::fs::write(&note, text).with_context(|| note.display().to_string())?;
                report
            }
        };
        Ok(Made {
            sensing,
            seed,
            faces: report["faces"].as_u64().unwrap_or(0),
            area_km2: number(&report, &["area_m2"])? / 1e6,
            cost: synth_cost(&report)?,
        })
    }

    pub(super) fn row(&self, scene: &Scene, row: &Row, folder: &Path, made: &Made) -> anyhow::Result<Record> {
        self.tell(&format!("{}: {}", scene.name, row.what));
        let result = folder.join(row.name);
        let truth = folder.join("city").join("truth").display().to_string();
        let model = Path::new(&truth).join("truth.city.jsonl").display().to_string();
        let mut more = vec!["--block-size".to_owned(), BLOCK.to_owned()];
        let mut set = |what: &str| more.extend(["--set".to_owned(), what.to_owned()]);
        set("output.labels=true");
        match row.name {
            "labels" => set(&format!("segmentation.labels={truth}")),
            "footprints" => set(&format!("segmentation.footprints={model}")),
            "planes" => {
                set(&format!("segmentation.footprints={model}"));
                set(&format!("modeling.roofs={model}"));
            }
            "zhu2018" => more.extend(["--preset", "zhu2018"].map(str::to_owned)),
            _ => {}
        }
        let summary = self.model(scene, folder, &result, &more)?;
        let begin = Instant::now();
        let result = result.display().to_string();
        let figures = self.child(scene.name, &["eval", "--truth", &truth, "--result", &result, "--json"])?;
        let eval_seconds = begin.elapsed().as_secs_f64();
        Ok(Record {
            scene: scene.name.to_owned(),
            row: row.what.to_owned(),
            variant: None,
            order: [0; 3],
            source: self.args.truth.as_ref().filter(|_| scene.area > 1.0).map_or_else(
                || "procedural".to_owned(),
                |t| t.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            ),
            seed: made.seed,
            sensing: made.sensing,
            mesh_faces: made.faces,
            area_km2: made.area_km2,
            date: today(),
            cores: cores(),
            build: BUILD.to_owned(),
            synth: made.cost,
            eval_seconds,
            figures: record::figures(&figures)?,
            run: record::timing(&summary)?,
            one_thread: None,
            grids: None,
        })
    }

    /// The default row once more, on one thread.
    pub(super) fn on_one_thread(&self, scene: &Scene, folder: &Path) -> anyhow::Result<Cost> {
        self.tell(&format!("{}: default, one thread", scene.name));
        let result = folder.join("one-thread");
        let more = ["--threads", "1", "--block-size", BLOCK, "--set", "output.labels=true"].map(str::to_owned);
        let summary = self.model(scene, folder, &result, &more)?;
        self.remove(&result)?;
        Ok(record::timing(&summary)?.whole)
    }

    /// The default row in 1×1 and in 16×16 blocks, compared building by building.
    pub(super) fn grids(&self, scene: &Scene, folder: &Path) -> anyhow::Result<Grids> {
        let [one, other] = ["1x1", "16x16"].map(|grid| (folder.join(grid), grid));
        for (result, grid) in [&one, &other] {
            self.tell(&format!("{}: default, {grid} blocks", scene.name));
            let more = ["--grid", grid, "--set", "output.report=false"].map(str::to_owned);
            self.model(scene, folder, result, &more)?;
        }
        let [truth, one, other] = [folder.join("city").join("truth"), one.0, other.0];
        let [t, a, b] = [&truth, &one, &other].map(|p| p.display().to_string());
        let figures = self.child(scene.name, &["eval", "--truth", &t, "--result", &a, "--again", &b, "--json"])?;
        self.remove(&one)?;
        self.remove(&other)?;
        Ok(Grids {
            buildings: number(&figures, &["agreement", "buildings"])? as u64,
            same: number(&figures, &["agreement", "share"])?,
        })
    }

    /// `gable run` on the scene in a folder; returns its summary.
    fn model(&self, scene: &Scene, folder: &Path, result: &Path, more: &[String]) -> anyhow::Result<Value> {
        self.remove(result)?;
        let (city, out) = (folder.join("city").display().to_string(), result.display().to_string());
        let mut arguments = vec!["run", &city, "--out", &out, "--json"];
        arguments.extend(more.iter().map(String::as_str));
        for setting in &self.args.settings {
            arguments.extend(["--set", setting]);
        }
        self.child(scene.name, &arguments)
    }

    pub(super) fn remove(&self, folder: &Path) -> anyhow::Result<()> {
        if folder.exists() {
            std::fs::remove_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
        Ok(())
    }

    /// Runs this program with other arguments; its progress goes where ours goes.
    pub(super) fn child(&self, scene: &str, arguments: &[&str]) -> anyhow::Result<Value> {
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

/// What `gable synth` needed, from its JSON.
pub(super) fn synth_cost(report: &Value) -> anyhow::Result<Cost> {
    Ok(Cost {
        wall: number(report, &["seconds"])?,
        core: number(report, &["core_seconds"])?,
        peak_memory_bytes: report["peak_memory_bytes"].as_u64().unwrap_or(0),
    })
}

/// What `gable synth` said when it made the scene that stands here, if it was asked with these arguments.
fn kept(note: &Path, arguments: &[&str]) -> anyhow::Result<Option<Value>> {
    if !note.exists() {
        return Ok(None);
    }
    let text = std::fs::read(note).with_context(|| note.display().to_string())?;
    let mut made: Value = serde_json::from_slice(&text).with_context(|| note.display().to_string())?;
    Ok((made["arguments"] == serde_json::json!(arguments)).then(|| made["report"].take()))
}

/// Profile of this program.
pub(super) const BUILD: &str = if cfg!(debug_assertions) { "debug" } else { "release" };

/// Cores that this program may use.
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The day of today (UTC), as year-month-day.
pub(super) fn today() -> String {
    date(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()))
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
    fn a_kept_scene_is_used_for_the_same_arguments_only() {
        let folder = tempfile::tempdir().unwrap();
        let note = folder.path().join("made.json");
        assert_eq!(kept(&note, &["synth", "--seed", "1"]).unwrap(), None);
        let made = serde_json::json!({ "arguments": ["synth", "--seed", "1"], "report": { "faces": 7 } });
        std::fs::write(&note, made.to_string()).unwrap();
        assert_eq!(kept(&note, &["synth", "--seed", "1"]).unwrap().unwrap()["faces"], 7);
        assert_eq!(kept(&note, &["synth", "--seed", "2"]).unwrap(), None);
        std::fs::write(&note, "{").unwrap();
        assert!(kept(&note, &["synth", "--seed", "1"]).unwrap_err().to_string().contains("made.json"));
    }

    #[test]
    fn dates() {
        assert_eq!(date(0), "1970-01-01");
        assert_eq!(date(951_782_399), "2000-02-28");
        assert_eq!(date(951_782_400), "2000-02-29");
        assert_eq!(date(1_798_761_599), "2026-12-31");
    }
}
