//! Standard output for results, standard error for everything else, without tearing the progress bar.

use crate::cli::LogFormat;
use indicatif::{MultiProgress, ProgressDrawTarget};
use std::io::{self, IsTerminal as _, Write};
use std::sync::LazyLock;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{EnvFilter, Layer, Registry};

/// The progress bars on standard error; lines are written between their redraws.
pub(crate) static BARS: LazyLock<MultiProgress> =
    LazyLock::new(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(8)));

/// Whether progress can be drawn, rather than told line by line.
pub(crate) fn is_interactive() -> bool {
    io::stderr().is_terminal()
}

/// A line on standard error. A reader that has gone away is no reason to stop.
pub(crate) fn stderr_line(text: &str) {
    BARS.suspend(|| writeln!(io::stderr(), "{text}").ok());
}

/// Text on standard output, ended by a line break.
pub(crate) fn stdout(text: &str) {
    BARS.suspend(|| writeln!(io::stdout(), "{}", text.trim_end_matches('\n')).ok());
}

/// A value as JSON on standard output.
pub(crate) fn json(value: &impl serde::Serialize) {
    match serde_json::to_string_pretty(value) {
        Ok(text) => stdout(&text),
        Err(error) => stderr_line(&format!("error: the result cannot be written as JSON: {error}")),
    }
}

/// Writes log lines between redraws of the progress bar.
struct LogWriter;

impl Write for LogWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        BARS.suspend(|| io::stderr().write_all(bytes))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Sends log lines to standard error: warnings by default, more with `-v`, `-vv` or `RUST_LOG`. A service (`format` is given)
/// tells one level more, and sends traces where a collector of them is named.
pub(crate) fn start_logging(verbose: u8, quiet: bool, format: Option<LogFormat>) {
    let level = match (quiet, verbose + u8::from(format.is_some())) {
        (true, _) => "error",
        (false, 0) => "warn",
        (false, 1) => "info",
        (false, 2) => "debug",
        _ => "trace",
    };
    let filter = EnvFilter::builder().with_default_directive(tracing::Level::ERROR.into());
    let filter = match std::env::var("RUST_LOG") {
        Ok(text) if !text.is_empty() => filter.parse_lossy(text),
        _ => filter.parse_lossy(level),
    };
    let lines = tracing_subscriber::fmt::layer()
        .with_ansi(is_interactive() && std::env::var_os("NO_COLOR").is_none())
        .with_writer(|| LogWriter);
    let lines = match format {
        Some(LogFormat::Json) => lines.json().flatten_event(true).boxed(),
        _ => lines.boxed(),
    };
    let (spans, trouble) = if format.is_some() && collector_is_named() { spans() } else { (None, None) };
    let layers: Vec<_> = std::iter::once(lines.with_filter(filter).boxed()).chain(spans).collect();
    Registry::default().with(layers).init();
    if let Some(trouble) = trouble {
        tracing::warn!("{trouble}");
    }
}

/// Whether the environment names a collector of traces, in the variables that are usual for it.
fn collector_is_named() -> bool {
    let names = ["OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT"];
    names.iter().any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()))
}

type Spans = Box<dyn Layer<Registry> + Send + Sync>;

/// What sends spans to the collector; or why none are sent.
#[cfg(feature = "otlp")]
fn spans() -> (Option<Spans>, Option<String>) {
    match crate::otlp::layer() {
        Ok(layer) => (Some(layer.boxed()), None),
        // The error quotes the address, which may hold a password.
        Err(_) => {
            let why = "no traces are sent: the address in OTEL_EXPORTER_OTLP_ENDPOINT, or another variable of the exporter, is wrong";
            (None, Some(why.to_owned()))
        }
    }
}

/// What sends spans to the collector; or why none are sent.
#[cfg(not(feature = "otlp"))]
fn spans() -> (Option<Spans>, Option<String>) {
    let why =
        "no traces are sent: OTEL_EXPORTER_OTLP_ENDPOINT is set, but this program was built without the feature otlp";
    (None, Some(why.to_owned()))
}
