//! What is said during an attempt at a task: the last lines, for whoever looks at the task later.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Most lines that are kept.
const LINES: usize = 200;

/// Most bytes that are kept.
const BYTES: usize = 16 << 10;

/// Longest line, bytes.
const LONGEST: usize = 2000;

/// The last lines, each with the seconds since the attempt began.
#[derive(Debug)]
pub(crate) struct Log {
    begin: Instant,
    tail: Mutex<Tail>,
}

#[derive(Debug, Default)]
struct Tail {
    lines: VecDeque<String>,
    bytes: usize,
    /// Whether the last line tells how far the child is.
    phase: bool,
    cut: bool,
}

impl Tail {
    fn drop_line(&mut self, line: Option<String>) {
        self.bytes -= line.map_or(0, |l| l.len() + 1);
    }

    fn push(&mut self, line: String) {
        self.bytes += line.len() + 1;
        self.lines.push_back(line);
        while self.lines.len() > LINES || self.bytes > BYTES {
            let first = self.lines.pop_front();
            self.drop_line(first);
            self.cut = true;
        }
    }
}

impl Log {
    pub(crate) fn new() -> Self {
        Self { begin: Instant::now(), tail: Mutex::default() }
    }

    fn tail(&self) -> MutexGuard<'_, Tail> {
        self.tail.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn line(&self, text: &str) -> String {
        let end = (0..=LONGEST.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
        let visible = |c: char| if c.is_control() && c != '\t' { '\u{fffd}' } else { c };
        let text: String = text[..end].trim_end().chars().map(visible).collect();
        format!("{:7.1} s  {text}", self.begin.elapsed().as_secs_f64())
    }

    /// Adds a line.
    pub(crate) fn say(&self, text: &str) {
        let line = self.line(text);
        let mut tail = self.tail();
        tail.phase = false;
        tail.push(line);
    }

    /// Says how far the child is. Of several in a row the last one is kept: there is one for each building.
    pub(crate) fn phase(&self, text: &str) {
        let line = self.line(text);
        let mut tail = self.tail();
        if tail.phase {
            let last = tail.lines.pop_back();
            tail.drop_line(last);
        }
        tail.phase = true;
        tail.push(line);
    }

    /// All that is kept, each line ended by a line break.
    pub(crate) fn text(&self) -> String {
        let tail = self.tail();
        let cut = if tail.cut { "…\n" } else { "" };
        tail.lines.iter().fold(cut.to_owned(), |all, line| all + line + "\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_kept() {
        let log = Log::new();
        for building in 0..1000 {
            log.phase(&format!("building {building}"));
        }
        log.say("a\tb\0c\u{1b}[31m\r");
        let text = log.text();
        assert_eq!(text.lines().count(), 2, "{text}");
        assert!(text.contains("building 999\n") && text.ends_with("s  a\tb\u{fffd}c\u{fffd}[31m\n"), "{text}");
        for number in 0..300 {
            log.say(&format!("line {number}"));
        }
        let text = log.text();
        assert!(text.starts_with("…\n") && text.ends_with("line 299\n"), "{text}");
        assert_eq!(text.lines().count(), LINES + 1);
        for _ in 0..300 {
            log.say(&"é".repeat(5000));
        }
        let text = log.text();
        assert!(text.len() <= BYTES + "…\n".len() && text.len() > BYTES - 2 * LONGEST, "{}", text.len());
    }
}
