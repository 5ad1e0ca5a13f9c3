//! One task's child process, under limits.

use crate::WorkerError;
use crate::log::Log;
use crate::protocol::{BAD_INPUT, FAILED, Order, PHASE, Report};
use gable_job_store::Cause;
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use std::ffi::OsString;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::process::{Child, ChildStdout, Command};
use tokio::sync::watch;
use tokio::time::Instant;

/// What a child may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Resident memory, bytes.
    pub memory: u64,
    /// Wall time.
    pub time: Duration,
}

/// How often the memory of a child is looked at.
const LOOK: Duration = Duration::from_millis(200);

/// Longest line of a child's log, bytes; the rest of a longer one is dropped.
const LINE: usize = 1 << 20;

/// Longest report of a child, bytes: some hundred for each task that it adds.
const REPORT: usize = 1 << 28;

/// How a child ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Ended {
    /// Well, with this result.
    Well(Report),
    /// Its input is bad.
    BadInput(String),
    /// Otherwise; another attempt may go better.
    Badly(String),
    /// By a signal that asks programs to end, which was not sent by its worker.
    Told(String),
    /// It was stopped because the task is no longer the worker's.
    Stopped,
}

/// What a child says about itself while it runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct State {
    /// How far it is.
    pub(crate) phase: String,
    /// Its resident memory, bytes.
    pub(crate) memory: u64,
}

/// Runs a child to its end. `stop` becomes true when the task is lost; `state` tells how the child does, and `log` keeps what it says.
pub(crate) async fn run(
    program: &[OsString],
    folder: &Path,
    order: &Order,
    limits: Limits,
    mut stop: watch::Receiver<bool>,
    state: &watch::Sender<State>,
    log: &Arc<Log>,
) -> Result<Ended, WorkerError> {
    let (name, arguments) = program.split_first().map_or_else(|| (OsString::new(), &[][..]), |(n, a)| (n.clone(), a));
    let mut child = Command::new(&name)
        .args(arguments)
        .env_clear()
        .envs(environment(std::env::vars_os(), folder))
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .kill_on_drop(true)
        // Ctrl-C at the terminal is for the worker, which gives its tasks time to end.
        .process_group(0)
        .spawn()
        .map_err(|source| WorkerError::Program { program: name.to_string_lossy().into_owned(), source })?;
    let pid = child.id();
    let begin = Instant::now();
    // Held open until the child has ended: its end of the pipe is how the child sees that the worker is gone.
    let mut input = child.stdin.take();
    if let Some(pipe) = &mut input {
        let line = serde_json::to_string(order).unwrap_or_default() + "\n";
        // A child that ends before it has read this tells why on its log.
        let _ = pipe.write_all(line.as_bytes()).await;
    }
    let answer = tokio::spawn(last_line(child.stdout.take()));
    let said = {
        let (lines, state, unit, log) = (child.stderr.take(), state.clone(), order.unit.clone(), Arc::clone(log));
        tokio::spawn(async move {
            let mut last = String::new();
            let Some(lines) = lines else { return last };
            let mut lines = BufReader::new(lines);
            while let Some(line) = next_line(&mut lines, LINE).await {
                if let Some(phase) = line.strip_prefix(PHASE) {
                    state.send_modify(|s| s.phase = phase.to_owned());
                    log.phase(phase);
                } else if !line.trim().is_empty() {
                    tracing::debug!(unit, "{line}");
                    log.say(&line);
                    last = line;
                }
            }
            last
        })
    };
    let mut broken = None;
    let status = loop {
        tokio::select! {
            // A child that has ended has ended well or badly, whatever else there is to do.
            biased;
            status = child.wait() => break status,
            changed = stop.changed() => {
                if changed.is_err() || *stop.borrow() {
                    kill(&mut child).await;
                    return Ok(Ended::Stopped);
                }
            }
            () = tokio::time::sleep(LOOK) => {
                let memory = pid.and_then(resident_memory).unwrap_or(0);
                state.send_modify(|s| s.memory = memory);
                if memory > limits.memory {
                    let (used, most) = (memory >> 20, limits.memory >> 20);
                    broken = Some(Cause::memory(used, most));
                } else if begin.elapsed() > limits.time {
                    broken = Some(Cause::time(limits.time.as_secs_f64()));
                }
                if broken.is_some() {
                    kill(&mut child).await;
                    break child.wait().await;
                }
            }
        }
    };
    drop(input);
    let (answer, said) = (answer.await.unwrap_or_default(), said.await.unwrap_or_default());
    if let Some(reason) = broken {
        return Ok(Ended::Badly(reason));
    }
    let status = status.map_err(|source| WorkerError::Folder { path: folder.to_owned(), source })?;
    Ok(match status.code() {
        Some(0) => match serde_json::from_str(&answer) {
            Ok(report) => Ended::Well(report),
            Err(e) => Ended::Badly(format!("its report cannot be read: {e}")),
        },
        Some(BAD_INPUT) => Ended::BadInput(said),
        Some(FAILED) if !said.is_empty() => Ended::Badly(said),
        _ if told_to_end(status) => Ended::Told(Cause::died(status, &said)),
        _ => Ended::Badly(Cause::died(status, &said)),
    })
}

/// Whether a process was ended by a signal by which people and supervisors end programs.
fn told_to_end(status: ExitStatus) -> bool {
    let signal = status.signal().and_then(|number| Signal::try_from(number).ok());
    matches!(signal, Some(Signal::SIGTERM | Signal::SIGINT | Signal::SIGHUP))
}

/// The variables of the worker's environment that a child may see: where programs are, how text and logs look. The addresses and
/// passwords of the service are not among them, whatever they are called.
const PASSED_ON: [&str; 13] = [
    "PATH",
    "LD_LIBRARY_PATH",
    "LANG",
    "LC_ALL",
    "LC_CTYPE",
    "TZ",
    "NO_COLOR",
    "RUST_LOG",
    "RUST_BACKTRACE",
    "RUST_MIN_STACK",
    "MALLOC_ARENA_MAX",
    "MALLOC_TRIM_THRESHOLD_",
    "MALLOC_MMAP_THRESHOLD_",
];

/// The environment of a child whose folder is this: what it leaves behind goes with the folder.
fn environment(
    worker: impl Iterator<Item = (OsString, OsString)>,
    folder: &Path,
) -> impl Iterator<Item = (OsString, OsString)> {
    let passed = worker.filter(|(name, _)| PASSED_ON.iter().any(|known| name == known));
    passed.chain([("TMPDIR".into(), folder.into())])
}

/// Kills a child and all that it has started: what is left would go on computing, and hold its pipes open.
async fn kill(child: &mut Child) {
    // It leads a group of its own; its number is known until it was waited for. Errors mean that it has ended by itself.
    if let Some(group) = child.id().and_then(|pid| i32::try_from(pid).ok()) {
        let _ = killpg(Pid::from_raw(group), Signal::SIGKILL);
    }
    let _ = child.kill().await;
}

async fn last_line(output: Option<ChildStdout>) -> String {
    let mut last = String::new();
    let Some(output) = output else { return last };
    let mut lines = BufReader::new(output);
    while let Some(line) = next_line(&mut lines, REPORT).await {
        if !line.trim().is_empty() {
            last = line;
        }
    }
    last
}

/// The next line, at most `most` bytes of it; none at the end.
async fn next_line(lines: &mut (impl AsyncBufReadExt + Unpin), most: usize) -> Option<String> {
    let mut line = Vec::new();
    loop {
        let chunk = lines.fill_buf().await.ok()?;
        if chunk.is_empty() {
            return if line.is_empty() { None } else { Some(String::from_utf8_lossy(&line).into_owned()) };
        }
        let end = chunk.iter().position(|&b| b == b'\n');
        let taken = end.unwrap_or(chunk.len());
        line.extend_from_slice(&chunk[..taken.min(most.saturating_sub(line.len()))]);
        lines.consume(end.map_or(taken, |e| e + 1));
        if end.is_some() {
            return Some(String::from_utf8_lossy(&line).into_owned());
        }
    }
}

/// Resident memory of a process, bytes; none where the system does not tell.
fn resident_memory(pid: u32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kb| kb << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_secret_is_passed_on() {
        let names = [
            "GABLE_DATABASE",
            "GABLE_TOKEN",
            "GABLE_STORE",
            "AWS_SECRET_ACCESS_KEY",
            "AWS_SESSION_TOKEN",
            "OTEL_EXPORTER_OTLP_HEADERS",
            "PGPASSWORD",
            "SOMETHING_NEW",
            "TMPDIR",
            "PATH",
            "RUST_LOG",
        ];
        let worker = names.iter().map(|name| ((*name).into(), "secret".into()));
        let child: Vec<_> = environment(worker, Path::new("/task")).collect();
        let expected = [("PATH", "secret"), ("RUST_LOG", "secret"), ("TMPDIR", "/task")];
        assert_eq!(child, expected.map(|(name, value)| (name.into(), value.into())));
    }
}
