//! How the program ends: its exit codes, and the message of a failure.
//!
//! 0 success, 1 failure, 2 wrong usage or bad input, 3 partial result (some blocks failed), 130 interrupted.

use crate::remote::RemoteError;
use crate::terminal;
use gable_pipeline::{ErrorKind, ParamError, PipelineError};
use gable_scene::SceneError;
use gable_synthetic_city::SynthError;
use std::process::ExitCode;

/// What a command that did not fail has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All of it.
    Success,
    /// A part: some blocks failed.
    Partial,
}

/// Wrong usage that only shows once arguments are looked at together.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct UsageError(pub(crate) String);

/// The exit code of an error.
fn number(error: &anyhow::Error) -> u8 {
    let bad_input = error.is::<ParamError>()
        || error.is::<UsageError>()
        || error.is::<gable_city_model::Error>()
        || error.is::<SceneError>()
        || error.is::<gable_evaluation::Error>()
        || error.is::<gable_segmentation::Error>()
        || matches!(error.downcast_ref(), Some(RemoteError::Refused(_) | RemoteError::NotSeen(_)))
        || matches!(error.downcast_ref(), Some(SynthError::Parameter { .. } | SynthError::EmptyTruth));
    match error.downcast_ref::<PipelineError>().map(PipelineError::kind) {
        Some(ErrorKind::Input) => 2,
        Some(ErrorKind::Cancelled) => 130,
        _ if bad_input => 2,
        _ => 1,
    }
}

/// The exit code of a result.
pub(crate) fn code(result: &anyhow::Result<Outcome>) -> ExitCode {
    match result {
        Ok(Outcome::Success) => ExitCode::SUCCESS,
        Ok(Outcome::Partial) => ExitCode::from(3),
        Err(error) => ExitCode::from(number(error)),
    }
}

/// Tells the error and its causes on standard error, and as JSON on standard output if the result was to be JSON.
pub(crate) fn tell(error: &anyhow::Error, json: bool) {
    let mut message = error.to_string();
    let mut last = message.clone();
    for cause in error.chain().skip(1) {
        let text = cause.to_string();
        // Many errors already quote their cause.
        if !last.contains(&text) {
            message += &format!(": {text}");
        }
        last = text;
    }
    let label = if number(error) == 130 { "stopped" } else { "error" };
    terminal::stderr_line(&format!("{label}: {message}"));
    if json {
        terminal::json(&serde_json::json!({ "status": "failed", "exit_code": number(error), "error": message }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context as _;

    #[test]
    fn codes_survive_context() {
        let param = Err::<(), _>(ParamError::Together("a and b".to_owned())).context("config file x.toml").unwrap_err();
        assert_eq!(number(&param), 2);
        let stop = Err::<(), _>(PipelineError::Cancelled).context("while running").unwrap_err();
        assert_eq!(number(&stop), 130);
        assert_eq!(number(&anyhow::anyhow!("disk full")), 1);
    }
}
