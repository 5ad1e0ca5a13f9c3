//! Tests that need what is not everywhere: they say why they did nothing.

use std::io::Write as _;
use std::path::PathBuf;

/// Says that a test did nothing, and why. `tests/run` counts it as skipped.
pub fn skip(test: &str, reason: &str) {
    let line = format!("skipped {test}: {reason}\n");
    if let Some(log) = std::env::var_os("GABLE_SKIP_LOG") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(log);
        if file.and_then(|mut f| f.write_all(line.as_bytes())).is_ok() {
            return;
        }
    }
    // Not a failure if nobody listens.
    std::io::stderr().write_all(line.as_bytes()).ok();
}

/// A folder of real data, if it is there: below `GABLE_TEST_DATA`, or else `../shared/data` beside the workspace.
#[must_use]
pub fn test_data(name: &str) -> Option<PathBuf> {
    let path = root().join(name);
    path.exists().then_some(path)
}

/// The schemas of CityGML 2.0, if they are there.
#[must_use]
pub fn schemas() -> Option<PathBuf> {
    let path = root().join("../schemas/citygml-2.0/CityGML-2.0.xsd");
    path.exists().then_some(path)
}

fn root() -> PathBuf {
    match std::env::var_os("GABLE_TEST_DATA") {
        Some(given) => given.into(),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
    }
}
