//! Faults that cost a block, not the city.

use crate::stages::split::Blocks;
use crate::{PipelineError, Stage};
use gable_raster::GridWindow;
use std::collections::BTreeMap;

/// Runs a unit of work; a panic in it becomes a stage's error.
pub(crate) fn guarded<T>(
    stage: Stage,
    unit: &str,
    work: impl FnOnce() -> Result<T, PipelineError>,
) -> Result<T, PipelineError> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).unwrap_or_else(|cause| {
        Err(PipelineError::Stage { stage, unit: unit.to_owned(), reason: format!("a fault in it: {}", said(&*cause)) })
    })
}

/// What a panic said.
pub(crate) fn said(cause: &(dyn std::any::Any + Send)) -> String {
    let text = cause.downcast_ref::<String>().map(String::as_str).or_else(|| cause.downcast_ref::<&str>().copied());
    text.unwrap_or("unknown cause").to_owned()
}

/// Whether an error is one unit's own, so that the others can go on: not if the user stops the run, nor if the disk is
/// full, which would fail every unit.
pub(crate) fn is_local(error: &PipelineError) -> bool {
    matches!(error, PipelineError::Stage { .. } | PipelineError::Artefact { .. })
}

/// Blocks that failed, with the first reason of each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Failures(BTreeMap<[u32; 2], String>);

impl Failures {
    /// A block failed.
    pub(crate) fn add(&mut self, block: [u32; 2], reason: String) {
        self.0.entry(block).or_insert(reason);
    }

    /// All blocks that touch a window failed.
    pub(crate) fn add_window(&mut self, blocks: &Blocks, window: GridWindow, reason: &str) {
        for (ix, iy) in blocks.with_data() {
            if blocks.core(ix, iy).is_some_and(|core| !core.intersection(&window).is_empty()) {
                self.add([ix, iy], reason.to_owned());
            }
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn reason(&self, block: [u32; 2]) -> Option<&str> {
        self.0.get(&block).map(String::as_str)
    }

    pub(crate) fn blocks(&self) -> Vec<[u32; 2]> {
        self.0.keys().copied().collect()
    }

    pub(crate) fn first(&self) -> Option<&str> {
        self.0.values().next().map(String::as_str)
    }

    /// The failed blocks that a window touches, said of a building; `None` if there are none.
    pub(crate) fn note(&self, blocks: &Blocks, window: GridWindow) -> Option<String> {
        let touches = |[ix, iy]: &[u32; 2]| {
            blocks.core(*ix, *iy).is_some_and(|core| !core.intersection(&window.grown(1)).is_empty())
        };
        let names: Vec<String> = self.0.keys().filter(|b| touches(b)).map(|[ix, iy]| format!("{ix}_{iy}")).collect();
        let word = if names.len() == 1 { "block" } else { "blocks" };
        (!names.is_empty()).then(|| format!("may be incomplete: it touches the failed {word} {}", names.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_the_units_reason() {
        let result = guarded::<()>(Stage::Sample, "3_4", || panic!("index {} is wrong", 7));
        let error = result.unwrap_err();
        assert!(is_local(&error));
        assert_eq!(error.to_string(), "sample of 3_4: a fault in it: index 7 is wrong");
        assert!(!is_local(&PipelineError::Cancelled));
        assert!(guarded(Stage::Sample, "3_4", || Ok(1)).is_ok());
    }
}
