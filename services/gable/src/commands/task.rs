//! `gable task`: the child process that does one task for a worker, as `services/worker` has the protocol.

use crate::cli::TaskArgs;
use crate::exit::{Outcome, UsageError};
use crate::sandbox;
use anyhow::Context as _;
use gable_coordinator::FOR_THE_VIEWER;
use gable_files::{Reach, Source, SourceRoots};
use gable_pipeline::params::parameters;
use gable_pipeline::{
    FailedUnit, Observer, Params, Stage, StageSeconds, UnitHistory, UnitInput, UnitJob, UnitResult, UnitTask,
    carry_out, first_unit,
};
use gable_worker::{Addition, CityReport, History, OBJECTS, Order, PHASE, Report, UPLOAD};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::{BufRead as _, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Does the task that standard input names, in the current folder.
pub(crate) fn run(args: &TaskArgs) -> anyhow::Result<Outcome> {
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line).context("reading the order")?;
    let order: Order = serde_json::from_str(&line).context("the order")?;
    let request: Request =
        serde_json::from_value(order.request.clone()).map_err(|e| UsageError(format!("the request: {e}")))?;
    let stage = stage(order.stage)?;
    let roots = roots(args, stage)?;
    let params = request.params(&roots, args.memory)?;
    let (source, reach) = source(&request, stage, &roots)?;
    // From here on it looks at what others have made. Threads that are begun later are restricted, too.
    sandbox::enter(Path::new("."), &read_by(&reach, &params))?;
    end_with_the_worker();
    let task = unit(stage, &order)?;
    let history = order.history.as_ref().map_or_else(|| Ok(UnitHistory::default()), history)?;
    // What is alone in its stage has the machine for itself.
    let alone = matches!(stage, Stage::Split | Stage::Terrain | Stage::Stitch | Stage::Report);
    let threads = if alone { args.threads } else { 1 };
    let job = UnitJob { source: &source, reach: &reach, params: &params };
    let made = carry_out(&job, &task, &history, Path::new("."), threads, &Teller::default())?;
    let text = serde_json::to_string(&report(made)?).context("the report")?;
    writeln!(std::io::stdout(), "{text}").context("handing in the report")?;
    Ok(Outcome::Success)
}

/// Where sources and the files of parameters may lie. Only the split needs the folders to be there: other stages may run on machines
/// that do not see them.
fn roots(args: &TaskArgs, stage: Stage) -> anyhow::Result<SourceRoots> {
    let there = args.source_roots.iter().filter(|root| stage == Stage::Split || root.exists()).cloned();
    let objects = args.source_roots.iter().filter(|root| stage != Stage::Split && root.starts_with("s3:")).cloned();
    let roots = SourceRoots::new(there.chain(objects), args.own.clone());
    Ok(roots.map_err(|e| UsageError(format!("--source-root {e}")))?)
}

/// The mesh, and what it may name: what lies in its own source root, or was sent with it. Only the split reads it, so for other
/// stages it is no more than a name; an upload has none, and is named after the city.
fn source(request: &Request, stage: Stage, roots: &SourceRoots) -> anyhow::Result<(PathBuf, Reach)> {
    let located = roots.locate(&request.source);
    if stage != Stage::Split {
        let name = match located {
            Ok(Source::Upload(_)) => PathBuf::from(&request.city),
            _ => super::mesh_folder(Path::new(&request.source)),
        };
        return Ok((name, Reach::within(["."])?));
    }
    match located.map_err(|e| UsageError(e.to_string()))? {
        Source::File(path) => {
            let reach = roots.reach_of(&path).map_err(|e| UsageError(e.to_string()))?;
            Ok((super::mesh_folder(&path), reach))
        }
        Source::Upload(_) => sent(UPLOAD),
        Source::Objects(_) => sent(OBJECTS),
    }
}

/// The mesh in a folder that the worker has filled, and names nothing outside of it.
fn sent(folder: &str) -> anyhow::Result<(PathBuf, Reach)> {
    let folder = Path::new(folder);
    if !folder.is_dir() {
        return Err(UsageError("the worker did not fetch the mesh: submit the job again".to_owned()).into());
    }
    Ok((inner(folder)?, Reach::within([folder])?))
}

/// What the task reads besides its own folder: where the mesh may lie, and files that parameters name.
fn read_by(reach: &Reach, params: &Params) -> Vec<PathBuf> {
    let named = [
        &params.segmentation.weights,
        &params.segmentation.labels,
        &params.segmentation.footprints,
        &params.modeling.roofs,
    ];
    let named = named.into_iter().flatten().cloned();
    reach.roots().unwrap_or_default().iter().cloned().chain(named).collect()
}

/// The folder in which more than one folder lies: archives are often made with a folder around everything.
fn inner(folder: &Path) -> anyhow::Result<PathBuf> {
    let mut folder = folder.to_owned();
    loop {
        let entries: Vec<_> = std::fs::read_dir(&folder)
            .and_then(Iterator::collect)
            .with_context(|| format!("folder {}", folder.display()))?;
        match &entries[..] {
            [only] if only.path().is_dir() => folder = only.path(),
            [only] => return Ok(only.path()),
            _ => return Ok(folder),
        }
    }
}

/// Ends the process when its standard input is closed: then the worker is gone.
fn end_with_the_worker() {
    std::thread::spawn(|| {
        let mut rest = [0; 64];
        while !matches!(std::io::stdin().lock().read(&mut rest), Ok(0) | Err(_)) {}
        std::process::exit(1);
    });
}

/// What of a request says what to do.
#[derive(Debug, Deserialize)]
struct Request {
    source: String,
    city: String,
    #[serde(default)]
    preset: Option<String>,
    #[serde(default)]
    parameters: BTreeMap<String, serde_json::Value>,
}

impl Request {
    /// The parameters, with the files that they name found in the roots, and what the viewer shows among the formats.
    fn params(&self, roots: &SourceRoots, memory: u64) -> anyhow::Result<Params> {
        let text = |value: &serde_json::Value| match value {
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let settings: Vec<_> = self.parameters.iter().map(|(name, value)| (name.clone(), text(value))).collect();
        let mut params = Params::assemble(self.preset.as_deref(), None, &settings)?;
        let defaults = Params::default();
        let files = parameters().iter().filter(|p| p.kind == "file" && p.value(&params) != p.value(&defaults));
        for (name, given) in files.map(|p| (p.name.as_str(), p.value(&params))).collect::<Vec<_>>() {
            let found = roots.resolve(&given).map_err(|e| UsageError(format!("{name}: {e}")))?;
            params.set(name, &found.to_string_lossy())?;
        }
        if !params.output.formats.contains(&FOR_THE_VIEWER) {
            params.output.formats.push(FOR_THE_VIEWER);
            params.output.formats.sort_unstable();
        }
        // Rasters that are kept in memory are half of this; the rest is for the work itself.
        params.resources.memory = usize::try_from(memory / 2)?.clamp(256, defaults.resources.memory);
        Ok(params)
    }
}

/// The stage of a number.
fn stage(number: i64) -> anyhow::Result<Stage> {
    let found = usize::try_from(number).ok().and_then(|n| Stage::ALL.get(n).copied());
    found.with_context(|| format!("there is no stage {number}: worker and coordinator are of different versions"))
}

fn number(stage: Stage) -> i64 {
    Stage::ALL.iter().position(|s| *s == stage).map_or(-1, |n| n as i64)
}

fn unit(stage: Stage, order: &Order) -> anyhow::Result<UnitTask> {
    if stage == Stage::Split {
        return Ok(first_unit());
    }
    let input: UnitInput = serde_json::from_value(order.input.clone()).context("the task's input")?;
    Ok(UnitTask { stage, unit: order.unit.clone(), input, required: false })
}

fn history(told: &History) -> anyhow::Result<UnitHistory> {
    let failed = told
        .failed
        .iter()
        .map(|f| Ok(FailedUnit { stage: stage(f.stage)?, unit: f.unit.clone(), reason: f.reason.clone() }));
    let sample = number(Stage::Sample);
    let stages = told.stages.iter().map(|t| Ok(StageSeconds { stage: stage(t.stage)?, wall: t.wall, core: t.sum }));
    Ok(UnitHistory {
        failed: failed.collect::<anyhow::Result<_>>()?,
        reused: told.reused.iter().filter(|r| r.stage == sample).map(|r| r.unit.clone()).collect(),
        stages: stages.collect::<anyhow::Result<_>>()?,
    })
}

fn report(made: UnitResult) -> anyhow::Result<Report> {
    let addition = |task: UnitTask| {
        Ok(Addition {
            stage: number(task.stage),
            unit: task.unit,
            input: serde_json::to_value(task.input)?,
            required: task.required,
        })
    };
    let tasks = made.tasks.into_iter().map(addition).collect::<anyhow::Result<_>>()?;
    let city = made.city.map(|city| CityReport { crs: city.crs, buildings: city.buildings });
    Ok(Report { made: made.made, tasks, city })
}

/// Tells the worker how far the task is.
#[derive(Debug, Default)]
struct Teller {
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Observer for Teller {
    fn stage(&self, _: Stage, total: usize) {
        self.total.store(total, Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
    }

    fn done(&self, _: Stage, unit: &str) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let total = self.total.load(Ordering::Relaxed).max(done);
        // A worker that is gone is seen by the closed standard input.
        let _ = writeln!(std::io::stderr(), "{PHASE}{unit}, {done} of {total}");
    }

    fn warning(&self, text: &str) {
        tracing::warn!("{text}");
    }

    fn cancelled(&self) -> bool {
        false
    }
}
