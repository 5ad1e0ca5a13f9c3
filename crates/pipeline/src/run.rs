//! The run loop (being written; replaced by the real one).

use crate::{Observer, Params, PipelineError, RunSummary};
use std::path::Path;

/// Models a city.
///
/// # Errors
/// See [`PipelineError`].
pub fn run(input: &Path, _out: &Path, params: &Params, _observer: &dyn Observer) -> Result<RunSummary, PipelineError> {
    params.check()?;
    Err(PipelineError::Input(format!("{}: the stages are not wired together yet", input.display())))
}
