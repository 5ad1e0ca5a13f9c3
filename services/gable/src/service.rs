//! What the commands of the service share: its database, its store, its workers, and how they stop.

use crate::cli::{DatabaseArgs, KeepArgs, SlotArgs};
use crate::exit::UsageError;
use crate::sandbox;
use anyhow::Context as _;
use gable_files::SourceRoots;
use gable_job_store::{Blobs, Retention, Store};
use gable_pipeline::Stage;
use gable_worker::{Health, Limits, REST, Settings, Worker};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tokio::task::JoinSet;

/// How long a service that is started before its database waits for it.
const PATIENCE: Duration = Duration::from_secs(60);

/// How often an idle worker looks for a task.
const PACE: Duration = Duration::from_millis(250);

/// Where jobs and artefacts are.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    pub(crate) store: Store,
    pub(crate) blobs: Blobs,
    /// What may be sources of jobs of anyone.
    pub(crate) roots: SourceRoots,
    /// What may be sources of jobs of everybody.
    pub(crate) shared_roots: SourceRoots,
    /// What may be sources of jobs of the members of groups, by their names.
    pub(crate) group_roots: BTreeMap<String, SourceRoots>,
}

/// Opens database and store; none if the service is told to stop before they are there.
pub(crate) async fn open_unless_stopped(
    keep: &KeepArgs,
    stop: &mut watch::Receiver<bool>,
) -> anyhow::Result<Option<Parts>> {
    tokio::select! {
        parts = open(keep) => parts.map(Some),
        () = async { let _ = stop.wait_for(|&s| s).await; } => {
            tracing::info!("stopped before the service was there");
            Ok(None)
        }
    }
}

/// Carries a service out until it has ended; once it is told to stop, it has this time for it.
pub(crate) async fn within(
    service: impl Future<Output = anyhow::Result<()>>,
    mut stop: watch::Receiver<bool>,
    most: Duration,
) -> anyhow::Result<()> {
    tokio::select! {
        ended = service => ended,
        () = async {
            let _ = stop.wait_for(|&s| s).await;
            tokio::time::sleep(most).await;
        } => {
            tracing::warn!("stopped with something under way: what it held is taken up by others when its lease runs out");
            Ok(())
        }
    }
}

/// How long a service may take that was told to stop: tasks have their time, and what is left is handed back or its lease runs out.
pub(crate) fn time_to_stop(slots: &SlotArgs) -> anyhow::Result<Duration> {
    Ok(seconds("grace", slots.grace.max(0.001))? + seconds("lease", slots.lease)? + Duration::from_secs(10))
}

/// Opens database and store.
async fn open(keep: &KeepArgs) -> anyhow::Result<Parts> {
    let store = open_database(&keep.at).await?;
    let blobs = match &keep.store {
        Some(place) => open_blobs(place).await?,
        None => Blobs::in_folder(&folder(&keep.at.data)?.join("store"))?,
    };
    let own = own_places(keep)?;
    let given = roots_by_group(&keep.source_roots);
    let roots_at = |places: Vec<PathBuf>| {
        SourceRoots::new(places, own.clone()).map_err(|e| UsageError(format!("--source-root {e}")))
    };
    let roots = roots_at(given.values().flatten().cloned().collect())?;
    let (mut shared_roots, mut group_roots) = (roots_at(Vec::new())?, BTreeMap::new());
    for (group, places) in given {
        match group {
            None => shared_roots = roots_at(places)?,
            Some(group) => {
                group_roots.insert(group, roots_at(places)?);
            }
        }
    }
    Ok(Parts { store, blobs, roots, shared_roots, group_roots })
}

/// Source roots as they were given: by the group that is named before `=`, and under none those for everybody.
fn roots_by_group(given: &[String]) -> BTreeMap<Option<String>, Vec<PathBuf>> {
    let plain = |group: &str| !group.is_empty() && group.chars().all(|c| c.is_alphanumeric() || "._-".contains(c));
    let mut roots: BTreeMap<Option<String>, Vec<PathBuf>> = BTreeMap::new();
    for root in given {
        let (group, place) = match root.split_once('=') {
            Some((group, place)) if plain(group) => (Some(group.to_owned()), place),
            _ => (None, root.as_str()),
        };
        roots.entry(group).or_default().push(PathBuf::from(place));
    }
    if given.is_empty() {
        roots.insert(None, vec![PathBuf::from(".")]);
    }
    roots
}

/// What the service keeps for itself: neither a job's source nor what a mesh names, also where it lies in a source root, as the
/// default folder of data does in the current one.
fn own_places(keep: &KeepArgs) -> anyhow::Result<Vec<PathBuf>> {
    let mut own = vec![folder(&keep.at.data)?];
    if let Some(store) = keep.store.as_deref().filter(|place| !place.contains("://")) {
        own.push(folder(Path::new(store))?);
    }
    if let Some(file) = keep.at.database.as_deref().and_then(|address| address.strip_prefix("sqlite:")) {
        let file = file.trim_start_matches("//").split('?').next().unwrap_or_default();
        // SQLite keeps what is not in the file yet beside it.
        own.extend(
            ["", "-wal", "-shm", "-journal"]
                .map(|ending| std::path::absolute(format!("{file}{ending}")))
                .into_iter()
                .flatten(),
        );
    }
    Ok(own)
}

/// Opens the database.
pub(crate) async fn open_database(at: &DatabaseArgs) -> anyhow::Result<Store> {
    let database = match &at.database {
        Some(address) => address.clone(),
        None => format!("sqlite:{}", folder(&at.data)?.join("jobs.db").display()),
    };
    connect(&database).await
}

/// A folder, made if it is not there; absolute, without links.
fn folder(path: &Path) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(path).with_context(|| format!("folder {}", path.display()))?;
    path.canonicalize().with_context(|| format!("folder {}", path.display()))
}

/// The store of artefacts at a place that a user named; one that does not answer yet is waited for.
async fn open_blobs(place: &str) -> anyhow::Result<Blobs> {
    let blobs = Blobs::open(place, std::env::vars()).map_err(|e| UsageError(format!("--store: {e}")))?;
    let begin = tokio::time::Instant::now();
    loop {
        match blobs.ping().await {
            Err(e) if e.is_refused() => {
                let advice = "it refuses the keys of this service: look at AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION \
                              and AWS_ENDPOINT_URL, and at what the keys may do";
                return Err(e).context(format!("the store of artefacts at {place}: {advice}"));
            }
            Err(e) if e.is_transient() && begin.elapsed() < PATIENCE => {
                tracing::warn!("waiting for the store of artefacts at {place}: {e}");
                tokio::time::sleep(Duration::from_secs(1)).await;
            }
            result => {
                result.with_context(|| format!("the store of artefacts at {place}"))?;
                return Ok(blobs);
            }
        }
    }
}

/// A database that does not answer yet is waited for.
async fn connect(address: &str) -> anyhow::Result<Store> {
    let begin = tokio::time::Instant::now();
    loop {
        match Store::connect(address).await {
            Err(e) if e.is_transient() && begin.elapsed() < PATIENCE => {
                tracing::warn!("waiting for the database: {e}");
                tokio::time::sleep(Duration::from_secs(1)).await;
            }
            // The address may hold a password, so it is not told.
            result => return result.context("the database cannot be opened"),
        }
    }
}

/// The workers of this process.
pub(crate) fn workers(parts: &Parts, keep: &KeepArgs, slots: &SlotArgs) -> anyhow::Result<Vec<Worker>> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let count =
        if slots.slots == 0 { fitting_slots(cores, slots.task_memory << 20, machine_memory()) } else { slots.slots };
    if slots.slots == 0 && count < cores {
        tracing::info!(
            slots = count,
            cores,
            "fewer tasks at a time than cores: each may use --task-memory {} MB",
            slots.task_memory
        );
    }
    let (lease, grace) = (seconds("lease", slots.lease)?, seconds("grace", slots.grace)?);
    let limits = Limits { memory: slots.task_memory << 20, time: seconds("task-time", slots.task_time)? };
    let host = host();
    let folder = keep.at.data.join("work");
    std::fs::create_dir_all(&folder).with_context(|| format!("folder {}", folder.display()))?;
    let folder = folder.canonicalize()?;
    remove_stale(&folder);
    if let Err(why) = sandbox::is_supported() {
        tracing::warn!(
            "tasks run without a sandbox, for {why}: a fault in a reader of meshes could reach what this user may read and write"
        );
    }
    let tasks = folder.join(format!("tasks-{}", std::process::id()));
    let program = program(parts, cores, slots)?;
    let node = format!("{host}-{}-{}", std::process::id(), uuid::Uuid::now_v7().simple());
    let health = Arc::new(Health::default());
    (0..count)
        .map(|slot| {
            let id = format!("{host}-{}-{slot}-{}", std::process::id(), uuid::Uuid::now_v7().simple());
            let settings = Settings {
                id,
                host: host.clone(),
                node: node.clone(),
                health: Arc::clone(&health),
                rest: REST,
                stage_name: Stage::name_of,
                roots: parts.roots.clone(),
                program: program.clone(),
                folder: tasks.clone(),
                blobs: folder.join("blobs"),
                cache: slots.cache << 20,
                lease,
                limits,
                pace: PACE.min(lease / 3),
                grace,
            };
            Ok(Worker::new(parts.store.clone(), parts.blobs.clone(), settings)?)
        })
        .collect()
}

/// As many tasks at a time as there are cores, and as fit into memory; one at least.
fn fitting_slots(cores: usize, task_memory: u64, memory: Option<u64>) -> usize {
    let fit = memory.map_or(u64::MAX, |memory| memory / task_memory.max(1));
    cores.min(usize::try_from(fit).unwrap_or(usize::MAX)).max(1)
}

/// Memory of the machine, bytes, or of the control group that the process is in, if that is less; none where neither is told. The machine's
/// is asked of the kernel: units of systemd may hide what is in `/proc`.
fn machine_memory() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    #[cfg(target_os = "linux")]
    let total = nix::sys::sysinfo::sysinfo().ok().map(|info| info.ram_total());
    #[cfg(not(target_os = "linux"))]
    let total = None;
    let limits = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"];
    let limits = limits.iter().filter_map(|path| read(path)?.trim().parse::<u64>().ok());
    limits.chain(total).min()
}

/// A folder of this process for what is sent to it, on the disk of the data: the system's may be in memory.
pub(crate) fn incoming(data: &Path) -> anyhow::Result<PathBuf> {
    let all = folder(data)?.join("incoming");
    remove_stale(&all);
    folder(&all.join(format!("tasks-{}", std::process::id())))
}

/// The program that does one task: this one.
fn program(parts: &Parts, cores: usize, slots: &SlotArgs) -> anyhow::Result<Vec<OsString>> {
    let mut program: Vec<OsString> = slots.task_wrapper.iter().map(Into::into).collect();
    program.extend([std::env::current_exe()?.into(), "task".into()]);
    let memory = slots.task_memory.to_string();
    program.extend(["--threads".into(), cores.to_string().into(), "--memory".into(), memory.into()]);
    for root in parts.roots.places() {
        program.extend(["--source-root".into(), root.into()]);
    }
    for own in parts.roots.own() {
        program.extend(["--own".into(), own.into()]);
    }
    Ok(program)
}

/// Removes the folders of processes that were killed. The number of a process may be given anew: then they stay until
/// another time.
fn remove_stale(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let pid = name.to_str().and_then(|n| n.strip_prefix("tasks-")).and_then(|pid| pid.parse::<u32>().ok());
        let gone = pid.is_some_and(|pid| pid == std::process::id() || !Path::new(&format!("/proc/{pid}")).exists());
        if gone && let Err(e) = std::fs::remove_dir_all(entry.path()) {
            tracing::warn!("{} cannot be removed: {e}", entry.path().display());
        }
    }
}

/// A time that was given as a number of seconds.
pub(crate) fn seconds(name: &str, value: f64) -> Result<Duration, UsageError> {
    match Duration::try_from_secs_f64(value) {
        Ok(time) if time >= Duration::from_millis(1) => Ok(time),
        _ => Err(UsageError(format!("--{name} {value}: give a time above 0"))),
    }
}

/// How often what nothing refers to is looked for.
const COLLECTION: Duration = Duration::from_secs(3600);

/// Removes from time to time what nothing refers to, until `stop`.
pub(crate) async fn collect(
    parts: &Parts,
    age: Duration,
    keep: Duration,
    retention: Retention,
    mut stop: watch::Receiver<bool>,
) {
    let pace = COLLECTION.min(age.max(Duration::from_secs(1)));
    loop {
        tokio::select! {
            () = tokio::time::sleep(pace) => {}
            _ = stop.wait_for(|&s| s) => return,
        }
        match parts.store.purge(&retention).await {
            Ok(done) if done == gable_job_store::Purged::default() => {}
            Ok(done) => tracing::info!(
                generations = done.generations,
                jobs = done.jobs,
                audit = done.audit,
                workers = done.workers,
                "removed by age"
            ),
            Err(e) => tracing::warn!("removing what is kept no longer: {e}"),
        }
        let collected = tokio::select! {
            collected = parts.store.collect(&parts.blobs, age, keep, keep) => collected,
            _ = stop.wait_for(|&s| s) => return,
        };
        match collected {
            Ok(done) if done == gable_job_store::Collected::default() => {}
            Ok(done) => {
                tracing::info!(blobs = done.blobs, outcomes = done.outcomes, artifacts = done.artifacts, "removed")
            }
            Err(e) => tracing::warn!("removing what nothing refers to: {e}"),
        }
    }
}

/// The name of the machine.
fn host() -> String {
    let name = nix::unistd::gethostname().ok().and_then(|name| name.into_string().ok()).unwrap_or_default();
    if name.trim().is_empty() { "host".to_owned() } else { name.trim().to_owned() }
}

/// Files and connections that the process opens besides those of clients: the database, the object store, workers and what they read.
const OTHER_FILES: u64 = 512;

/// Lets the process open as many files as its user may, and gives how many connections of clients there is room for. By default a process
/// may open fewer than a service has clients.
pub(crate) fn room_for_connections() -> usize {
    use nix::sys::resource::{Resource, getrlimit, setrlimit};
    let wanted = gable_coordinator::Places::default().all;
    let Ok((soft, hard)) = getrlimit(Resource::RLIMIT_NOFILE) else { return wanted };
    // More than this no process here needs, and some systems slow down with.
    let most = hard.min(65_536);
    let files = if soft < most && setrlimit(Resource::RLIMIT_NOFILE, most, hard).is_ok() { most } else { soft };
    let left = files.saturating_sub(OTHER_FILES).max(files / 2);
    let room = usize::try_from(left).unwrap_or(usize::MAX).min(wanted);
    if room < wanted {
        tracing::warn!(
            files,
            connections = room,
            "few files may be open: raise the limit (ulimit -n, LimitNOFILE=) for more connections"
        );
    }
    room
}

/// Lets workers work until `stop`; the first that cannot work ends them all.
pub(crate) async fn work(workers: Vec<Worker>, stop: watch::Receiver<bool>) -> anyhow::Result<()> {
    let mut running = JoinSet::new();
    for worker in workers {
        let stop = stop.clone();
        running.spawn(async move { worker.run(stop).await });
    }
    while let Some(ended) = running.join_next().await {
        ended??;
    }
    Ok(())
}

/// Becomes true at SIGTERM and Ctrl-C; a second one ends the process at once.
pub(crate) fn stop_signal() -> anyhow::Result<watch::Receiver<bool>> {
    use tokio::signal::unix::{SignalKind, signal};
    let (stop, stopped) = watch::channel(false);
    let (mut term, mut int) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    tokio::spawn(async move {
        for first in [true, false] {
            tokio::select! { _ = term.recv() => {}, _ = int.recv() => {} }
            if !first {
                std::process::exit(130);
            }
            tracing::info!("stopping: tasks under way are being finished; once more to stop at once");
            stop.send_replace(true);
        }
    });
    Ok(stopped)
}

/// Runs a service to its end.
pub(crate) fn block_on<F: Future<Output = anyhow::Result<()>>>(service: F) -> anyhow::Result<()> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build()?.block_on(service)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_fit_cores_and_memory() {
        let task = 4 << 30;
        assert_eq!(fitting_slots(8, task, Some(64 << 30)), 8);
        assert_eq!(fitting_slots(8, task, Some(15 << 30)), 3);
        assert_eq!(fitting_slots(8, task, Some(1 << 30)), 1);
        assert_eq!(fitting_slots(8, task, None), 8);
        assert!(machine_memory().is_none_or(|bytes| bytes > 1 << 20));
    }

    #[test]
    fn the_machine_has_a_name_and_room() {
        let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        assert!(name.trim().is_empty() || host() == name.trim());
        assert!((1..=4096).contains(&room_for_connections()));
    }

    #[test]
    fn source_roots_may_be_of_groups() {
        let given = ["/meshes", "south=/south", "./a=b", "south=s3://b/p"].map(str::to_owned);
        let roots = roots_by_group(&given);
        assert_eq!(roots[&None], ["/meshes", "./a=b"].map(PathBuf::from));
        assert_eq!(roots[&Some("south".to_owned())], ["/south", "s3://b/p"].map(PathBuf::from));
        assert_eq!(roots_by_group(&[])[&None], [PathBuf::from(".")]);
    }
}
