//! `gable task`: the child process that does one task for a worker, as `services/worker` has the protocol.

use crate::cli::TaskArgs;
use crate::exit::{Outcome, UsageError};
use anyhow::Context as _;
use gable_coordinator::{FOR_THE_VIEWER, Source};
use gable_job_store::{FetchLimits, JobStoreError, fetch_objects};
use gable_pipeline::params::PARAMETERS;
use gable_pipeline::{
    FailedUnit, Observer, Params, Stage, StageSeconds, UnitHistory, UnitInput, UnitJob, UnitResult, UnitTask,
    carry_out, first_unit,
};
use gable_worker::{Addition, CityReport, History, Order, PHASE, Report, UPLOAD};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::{BufRead as _, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Does the task that standard input names, in the current folder.
pub(crate) fn run(args: &TaskArgs) -> anyhow::Result<Outcome> {
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line).context("reading the order")?;
    end_with_the_worker();
    let order: Order = serde_json::from_str(&line).context("the order")?;
    let request: Request =
        serde_json::from_value(order.request.clone()).map_err(|e| UsageError(format!("the request: {e}")))?;
    let params = request.params(&args.source_roots, args.memory)?;
    let stage = stage(order.stage)?;
    let task = unit(stage, &order)?;
    let history = order.history.as_ref().map_or_else(|| Ok(UnitHistory::default()), history)?;
    // What is alone in its stage has the machine for itself.
    let alone = matches!(stage, Stage::Split | Stage::Terrain | Stage::Stitch | Stage::Report);
    let threads = if alone { args.threads } else { 1 };
    let source = source(&request, stage, &args.source_roots)?;
    let job = UnitJob { source: &source, params: &params };
    let made = carry_out(&job, &task, &history, Path::new("."), threads, &Teller::default())?;
    let text = serde_json::to_string(&report(made)?).context("the report")?;
    writeln!(std::io::stdout(), "{text}").context("handing in the report")?;
    Ok(Outcome::Success)
}

/// Folder, within that of the task, of objects that are the source.
const OBJECTS: &str = "objects";

/// What a source may have: what one machine can split.
const FETCH: FetchLimits = FetchLimits { bytes: 1 << 40, objects: 1_000_000 };

/// The mesh, fetched if it is in an object store. Only the split reads it, so for other stages, which may run on machines that cannot
/// see it, it is no more than a name; an upload has none, and is named after the city.
fn source(request: &Request, stage: Stage, roots: &[PathBuf]) -> anyhow::Result<PathBuf> {
    let located = gable_coordinator::locate(&request.source, roots);
    if stage != Stage::Split {
        return Ok(match located {
            Ok(Source::Upload(_)) => PathBuf::from(&request.city),
            _ => super::mesh_folder(Path::new(&request.source)),
        });
    }
    match located.map_err(|e| UsageError(e.to_string()))? {
        Source::File(path) => Ok(super::mesh_folder(&path)),
        Source::Upload(_) => inner(Path::new(UPLOAD)),
        Source::Objects(place) => {
            let folder = Path::new(OBJECTS);
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
            let fetched = runtime.block_on(fetch_objects(&place, std::env::vars(), folder, FETCH));
            match fetched {
                Err(e @ JobStoreError::Fetch { .. }) => Err(UsageError(e.to_string()).into()),
                Err(e) => Err(anyhow::Error::new(e).context(format!("fetching {place}"))),
                Ok(_) => inner(folder),
            }
        }
    }
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
    fn params(&self, roots: &[PathBuf], memory: u64) -> anyhow::Result<Params> {
        let text = |value: &serde_json::Value| match value {
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let settings: Vec<_> = self.parameters.iter().map(|(name, value)| (name.clone(), text(value))).collect();
        let mut params = Params::assemble(self.preset.as_deref(), None, &settings)?;
        let defaults = Params::default();
        let files = PARAMETERS.iter().filter(|p| p.kind == "file" && p.value(&params) != p.value(&defaults));
        for (name, given) in files.map(|p| (p.name, p.value(&params))).collect::<Vec<_>>() {
            let found = gable_coordinator::resolve(&given, roots).map_err(|e| UsageError(format!("{name}: {e}")))?;
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
