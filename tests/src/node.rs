//! Checks by programs of Node: validators, and a browser.

use crate::skip;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Where the programs lie.
fn web() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("web")
}

/// Runs a program of `tests/web`, and gives the JSON of its last line; `None`, with a printed reason, where Node or a package
/// that it needs is not installed.
///
/// # Panics
/// If it fails.
#[must_use]
pub fn run_node(test: &str, program: &str, needs: &str, arguments: &[&str]) -> Option<serde_json::Value> {
    let version = Command::new("node").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !version.is_ok_and(|s| s.success()) {
        skip(test, "Node is not installed");
        return None;
    }
    if !web().join("node_modules").join(needs).is_dir() {
        skip(test, &format!("{needs} is not installed (npm ci in tests/web)"));
        return None;
    }
    let done = Command::new("node").arg(web().join(program)).args(arguments).current_dir(web()).output();
    let done = done.expect("node can be started");
    let (said, complained) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{program}: {}\n{said}\n{complained}", done.status);
    let last = said.trim_end().lines().last().unwrap_or_default();
    Some(serde_json::from_str(last).unwrap_or_else(|e| panic!("{program}: {last:?} is no JSON: {e}")))
}
