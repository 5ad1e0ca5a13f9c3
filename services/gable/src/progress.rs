//! Progress of a run at the terminal: a bar where it can be drawn, plain lines where it cannot.

use crate::{interrupt, terminal};
use gable_pipeline::{Observer, Stage};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// How each kind of warning is told at most; further ones are only counted.
const TOLD: u64 = 3;

/// Seconds between two plain lines.
const PACE: Duration = Duration::from_secs(5);

/// Follows a run on standard error.
pub(crate) struct Progress {
    shown: Shown,
    state: Mutex<State>,
}

enum Shown {
    Nothing,
    Lines,
    Bar(ProgressBar),
}

struct State {
    label: Option<String>,
    began: Instant,
    told: Instant,
    total: usize,
    done: usize,
    warnings: BTreeMap<String, u64>,
}

impl Progress {
    /// Progress for a run; `quiet` shows errors only.
    pub(crate) fn new(quiet: bool) -> Self {
        let shown = match (quiet, terminal::is_interactive()) {
            (true, _) => Shown::Nothing,
            (false, false) => Shown::Lines,
            (false, true) => Shown::Bar(terminal::BARS.add(bar())),
        };
        let now = Instant::now();
        let state = State { label: None, began: now, told: now, total: 0, done: 0, warnings: BTreeMap::new() };
        Self { shown, state: Mutex::new(state) }
    }

    /// Takes the bar away and tells what was only counted.
    pub(crate) fn finish(&self) {
        let mut state = self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        self.close(&state);
        state.label = None;
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
        if !matches!(self.shown, Shown::Nothing) {
            for (kind, count) in state.warnings.iter().filter(|(_, count)| **count > TOLD) {
                terminal::stderr_line(&format!("warning: {} more like: {kind}", count - TOLD));
            }
        }
    }

    /// Work begins that has `total` units.
    pub(crate) fn begin(&self, label: &str, total: usize) {
        let mut state = self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        self.close(&state);
        let now = Instant::now();
        (state.label, state.began, state.told) = (Some(label.to_owned()), now, now);
        (state.total, state.done) = (total, 0);
        if let Shown::Bar(bar) = &self.shown {
            bar.reset();
            bar.enable_steady_tick(Duration::from_millis(250));
            bar.set_length(total as u64);
            bar.set_prefix(label.to_owned());
            bar.set_message("");
        }
    }

    /// A unit of the work under `label` is done. Late news of earlier work is ignored.
    pub(crate) fn step(&self, label: &str, unit: &str) {
        let mut state = self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if state.label.as_deref() != Some(label) {
            return;
        }
        state.done += 1;
        match &self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => {
                bar.set_message(unit.to_owned());
                bar.set_position(state.done as u64);
            }
            Shown::Lines => {
                if state.told.elapsed() >= PACE && state.done < state.total {
                    state.told = Instant::now();
                    terminal::stderr_line(&format!(
                        "{label:>12}  {}/{}  {unit}  {} left",
                        state.done,
                        state.total,
                        time_left(state.began.elapsed(), state.done, state.total)
                    ));
                }
            }
        }
    }

    /// One line for work that has ended.
    fn close(&self, state: &State) {
        let (Some(label), false) = (&state.label, matches!(self.shown, Shown::Nothing)) else { return };
        let seconds = state.began.elapsed().as_secs_f64();
        terminal::stderr_line(&format!("{label:>12}  {}/{}  {seconds:.1} s", state.done, state.total));
    }
}

/// The label of a stage: its place among all, and its name.
fn label(stage: Stage) -> String {
    format!("{}/{} {:>8}", 1 + stage as usize, Stage::ALL.len(), stage.name())
}

impl Observer for Progress {
    fn stage(&self, stage: Stage, total: usize) {
        self.begin(&label(stage), total);
    }

    fn done(&self, stage: Stage, block: &str) {
        self.step(&label(stage), block);
    }

    fn warning(&self, text: &str) {
        let mut state = self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let count = state.warnings.entry(kind_of(text)).or_insert(0);
        *count += 1;
        if *count <= TOLD && !matches!(self.shown, Shown::Nothing) {
            terminal::stderr_line(&format!("warning: {text}"));
        }
    }

    fn cancelled(&self) -> bool {
        interrupt::requested()
    }
}

/// A bar with stage, units and time left.
fn bar() -> ProgressBar {
    let template = "{prefix:>12} [{bar:30}] {pos}/{len}  {left} left  {wide_msg}";
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    // The time left as in plain lines: unknown until something is done.
    let left = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        let (done, total) = (state.pos() as usize, state.len().unwrap_or(0) as usize);
        // A line that is not drawn is no fault of the run.
        text.write_str(&time_left(state.elapsed(), done, total)).ok();
    };
    ProgressBar::new(0).with_style(style.progress_chars("=> ").with_key("left", left))
}

/// The time that the rest takes if it goes on as it went.
fn time_left(spent: Duration, done: usize, total: usize) -> String {
    if done == 0 {
        return "unknown".to_owned();
    }
    let rest = spent.as_secs_f64() * total.saturating_sub(done) as f64 / done as f64;
    match rest {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// What warnings of one kind have in common: the text without its numbers and quoted names.
fn kind_of(text: &str) -> String {
    let mut kind = String::with_capacity(text.len());
    let mut quoted = false;
    for c in text.chars() {
        match c {
            '"' => {
                quoted = !quoted;
                if quoted {
                    kind.push('…');
                }
            }
            _ if quoted => {}
            '0'..='9' if kind.ends_with('#') => {}
            '0'..='9' => kind.push('#'),
            c => kind.push(c),
        }
    }
    kind
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_of_a_kind_are_alike() {
        assert_eq!(
            kind_of("texture \"a.jpg\" of tile 12 is missing"),
            kind_of("texture \"b 2.png\" of tile 7 is missing")
        );
        assert_ne!(kind_of("texture missing"), kind_of("material missing"));
    }

    #[test]
    fn tells_the_time_left() {
        let spent = Duration::from_secs(10);
        assert_eq!(time_left(spent, 1, 4), "30 s");
        assert_eq!(time_left(spent, 1, 61), "10 min");
        assert_eq!(time_left(spent, 1, 1081), "3.0 h");
        assert_eq!(time_left(spent, 0, 4), "unknown");
    }
}
