//! Time of the stages.

use crate::summary::StageSeconds;
use crate::{PipelineError, Stage};
use std::time::Instant;

/// Collects wall-clock and core seconds of each stage.
#[derive(Default)]
pub(crate) struct Clock {
    pub(crate) stages: Vec<StageSeconds>,
}

impl Clock {
    /// Runs a stage and notes its time.
    pub(crate) fn time<T>(
        &mut self,
        stage: Stage,
        work: impl FnOnce() -> Result<T, PipelineError>,
    ) -> Result<T, PipelineError> {
        let (begin, core) = (Instant::now(), core_seconds());
        let result = work()?;
        let (wall, core) = (begin.elapsed().as_secs_f64(), core_seconds() - core);
        self.stages.push(StageSeconds { stage, wall, core });
        Ok(result)
    }
}

/// Seconds that all threads of this process have computed so far; 0 where the system does not tell.
#[must_use]
pub fn core_seconds() -> f64 {
    let Ok(text) = std::fs::read_to_string("/proc/self/stat") else { return 0.0 };
    // Fields 14 and 15, counted behind the name in brackets, in ticks of 10 ms.
    let Some((_, rest)) = text.rsplit_once(')') else { return 0.0 };
    let ticks: u64 = rest.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<u64>().ok()).sum();
    ticks as f64 / 100.0
}
