//! The version of this program, under which its workers take jobs and their results are kept.

/// The version of this program.
///
/// Builds for tests, which check what they compute, take another one from the variable `GABLE_TEST_VERSION`, so that an upgrade can be
/// tried with one build. Released builds do not read it.
#[must_use]
pub fn version() -> String {
    #[cfg(debug_assertions)]
    if let Ok(version) = std::env::var("GABLE_TEST_VERSION") {
        return version;
    }
    env!("CARGO_PKG_VERSION").to_owned()
}
