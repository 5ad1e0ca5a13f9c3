//! What a run tells about its result: the content of `report.json`.

use crate::observer::Stage;
use crate::warnings::InputWarning;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The level of detail at which a building was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Lod {
    /// Nothing could be written.
    #[serde(rename = "none")]
    None,
    /// Footprint and roof edge.
    #[serde(rename = "lod0")]
    Lod0,
    /// Flat-roofed blocks, and all below.
    #[serde(rename = "lod1")]
    Lod1,
    /// Roof shapes, and all below.
    #[serde(rename = "lod2")]
    Lod2,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunStatus {
    /// Every block came through.
    #[default]
    Successful,
    /// Some blocks failed; the rest of the city is there.
    Partial,
}

/// How a block ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "state", content = "reason")]
pub enum BlockState {
    /// No triangle lies in it.
    Empty,
    /// Computed in this run.
    Done,
    /// Taken from an earlier run with the same input and parameters.
    Reused,
    /// Failed, with the reason.
    Failed(String),
}

/// One block of the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlockRecord {
    /// Column, from the west.
    pub ix: u32,
    /// Row, from the south.
    pub iy: u32,
    /// How it ended.
    pub status: BlockState,
    /// Triangles that touch it.
    pub triangles: u64,
    /// Buildings that its tile owns.
    pub buildings: u32,
    /// Time spent on it over all stages, seconds.
    pub seconds: f64,
}

/// One building, written or not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BuildingRecord {
    /// Identifier, the same from run to run.
    pub id: String,
    /// Column and row of the tile that owns it.
    pub tile: [u32; 2],
    /// West, south, east, north; world coordinates, metres.
    pub bbox: [f64; 4],
    /// The best LOD that was written.
    pub lod: Lod,
    /// Why it is not LOD2; `None` if it is.
    pub reason: Option<String>,
    /// The kind of the reason, a word that stays the same from version to version ([`gable_modeling::Reason::code`]).
    #[serde(default)]
    pub reason_code: Option<String>,
    /// What else has to be known of it, such as a failed block that it touches.
    pub note: Option<String>,
    /// Roof type, as the attribute names it; `None` without a roof.
    pub roof_type: Option<String>,
    /// Footprint area, m².
    pub area_m2: f64,
    /// Highest roof point above the ground, metres.
    pub height_m: f64,
    /// RMS vertical distance between the roof and the sampled surface, metres; `None` without a roof.
    pub rmse_m: Option<f64>,
    /// Polygons of the best LOD.
    pub faces: u32,
}

impl BuildingRecord {
    /// Notes why it is not LOD2.
    pub(crate) fn tell(&mut self, reason: &gable_modeling::Reason) {
        self.reason = Some(reason.to_string());
        self.reason_code = Some(reason.code().to_owned());
    }
}

/// Seconds of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageSeconds {
    /// The stage.
    pub stage: Stage,
    /// Wall-clock seconds.
    pub wall: f64,
    /// Core seconds: the sum over all threads.
    pub core: f64,
}

/// The result of a run in figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// How it ended.
    pub status: RunStatus,
    /// Version of the program.
    pub version: String,
    /// The input as it was named.
    pub input: String,
    /// Reference system of the coordinates.
    pub crs: String,
    /// Triangles read.
    pub triangles: u64,
    /// Area with data, m².
    pub area_m2: f64,
    /// Pixels with data.
    pub pixels: u64,
    /// Edge of a pixel, metres.
    pub step_m: f64,
    /// Columns and rows of the grid.
    pub grid: [u32; 2],
    /// Threads used.
    pub threads: usize,
    /// Buildings written, at any LOD.
    pub buildings: usize,
    /// Polygons written, each building at its best LOD.
    pub faces: u64,
    /// Time of each stage, in order.
    pub stages: Vec<StageSeconds>,
    /// Wall-clock seconds of the whole run.
    pub seconds: f64,
    /// Largest resident memory of the process, bytes; 0 where the system does not tell.
    pub peak_memory_bytes: u64,
    /// What was put up with in the input.
    pub warnings: Vec<InputWarning>,
    /// Every block of the grid that has data or failed.
    pub blocks: Vec<BlockRecord>,
    /// Every building, by id.
    pub building_records: Vec<BuildingRecord>,
    /// Values of all parameters that differ from the defaults, by full name.
    pub parameters: BTreeMap<String, String>,
    /// Files written, relative to the output folder.
    pub files: Vec<String>,
}

impl RunSummary {
    /// Core seconds for each million pixels, which is microseconds for each pixel.
    #[must_use]
    pub fn core_micros_per_pixel(&self) -> f64 {
        let core: f64 = self.stages.iter().map(|s| s.core).sum();
        if self.pixels == 0 { 0.0 } else { core * 1e6 / self.pixels as f64 }
    }

    /// Buildings written at `lod` as their best.
    #[must_use]
    pub fn at_lod(&self, lod: Lod) -> usize {
        self.building_records.iter().filter(|b| b.lod == lod).count()
    }

    /// Blocks that failed.
    pub fn failed_blocks(&self) -> impl Iterator<Item = &BlockRecord> {
        self.blocks.iter().filter(|b| matches!(b.status, BlockState::Failed(_)))
    }
}

/// The largest resident memory of this process so far, bytes; 0 where the system does not tell.
#[must_use]
pub fn peak_memory_bytes() -> u64 {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return 0 };
    let kilobytes = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tells_its_own_memory() {
        if cfg!(target_os = "linux") {
            assert!(peak_memory_bytes() > 100_000);
        }
    }

    #[test]
    fn survives_json() {
        let block = |status| BlockRecord { ix: 1, iy: 2, status, triangles: 3, buildings: 4, seconds: 0.5 };
        let summary = RunSummary {
            blocks: vec![block(BlockState::Reused), block(BlockState::Failed("out of memory".to_owned()))],
            stages: vec![StageSeconds { stage: Stage::Sample, wall: 1.0, core: 2.0 }],
            pixels: 1_000_000,
            ..RunSummary::default()
        };
        let text = serde_json::to_string(&summary).unwrap();
        assert_eq!(serde_json::from_str::<RunSummary>(&text).unwrap(), summary);
        assert_eq!(summary.failed_blocks().count(), 1);
        assert_eq!(summary.core_micros_per_pixel(), 2.0);
    }
}
