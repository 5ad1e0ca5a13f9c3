//! Who watches a run: the terminal, a service, or a test.

use serde::{Deserialize, Serialize};
use std::fmt;

/// The stages of a run, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Triangles to block files.
    Split,
    /// Blocks to rasters.
    Sample,
    /// The ground surface of the city.
    Terrain,
    /// Rasters to labels.
    Segment,
    /// Building pieces to whole buildings.
    Stitch,
    /// Buildings to models.
    Model,
    /// Models to files.
    Write,
    /// Pictures and tables.
    Report,
}

impl Stage {
    /// Every stage, in order.
    pub const ALL: [Self; 8] =
        [Self::Split, Self::Sample, Self::Terrain, Self::Segment, Self::Stitch, Self::Model, Self::Write, Self::Report];

    /// The name of the stage with a number, as tasks have it.
    #[must_use]
    pub fn name_of(number: i64) -> &'static str {
        usize::try_from(number).ok().and_then(|n| Self::ALL.get(n)).map_or("unknown", |stage| stage.name())
    }

    /// The name that a user sees.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Split => "split",
            Self::Sample => "sample",
            Self::Terrain => "terrain",
            Self::Segment => "segment",
            Self::Stitch => "stitch",
            Self::Model => "model",
            Self::Write => "write",
            Self::Report => "report",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Follows a run, and can ask it to stop. Calls come from any thread.
pub trait Observer: Sync {
    /// A stage begins, with `total` units of work (blocks, patches, buildings or tiles).
    fn stage(&self, stage: Stage, total: usize);

    /// One unit of work is done; `block` names it.
    fn done(&self, stage: Stage, block: &str);

    /// Something is wrong with the input or the result, and the run goes on.
    fn warning(&self, text: &str);

    /// Whether the run is to finish the units under way and stop.
    fn cancelled(&self) -> bool;
}

/// Sees nothing and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {
    fn stage(&self, _: Stage, _: usize) {}

    fn done(&self, _: Stage, _: &str) {}

    fn warning(&self, _: &str) {}

    fn cancelled(&self) -> bool {
        false
    }
}
