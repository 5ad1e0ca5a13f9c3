//! From the scene to block files.

use super::Context;
use crate::{PipelineError, Stage};
use crate::{artefact, budget};
use gable_blocks::{BlockMesh, BlocksError, GridSpec, SplitOptions, SplitReport, read_block, split};
use gable_geometry::{DVec2, DVec3, Frame};
use gable_raster::GridWindow;
use gable_scene::Scene;
use std::path::PathBuf;

/// The blocks of a city, on disk.
pub(crate) struct Blocks {
    pub(crate) report: SplitReport,
    pub(crate) folder: PathBuf,
}

/// Splits the scene, unless an earlier run did.
pub(crate) fn run(context: &Context<'_>, scene: &Scene) -> Result<Blocks, PipelineError> {
    context.observer.stage(Stage::Split, 1);
    context.check_cancelled()?;
    let folder = context.workspace.path("blocks");
    let record = context.workspace.path("blocks/split.json");
    let report = match artefact::whole_json::<SplitReport>(&record)? {
        Some(report) => report,
        None => {
            let given = &context.params.grid;
            let grid = if given.block_size > 0.0 {
                GridSpec::Size(given.block_size)
            } else {
                let wanted = |count: usize| (count > 0).then_some(count as u32);
                GridSpec::Count { columns: wanted(given.columns), rows: wanted(given.rows) }
            };
            let options = SplitOptions { grid, step: context.params.sampling.step };
            let report = split(scene, &folder, &options).map_err(|e| match e {
                BlocksError::Scene(e) => PipelineError::Input(e.to_string()),
                other => context.failed(Stage::Split, "the scene", other),
            })?;
            artefact::write_json(&record, &report)?;
            report
        }
    };
    budget::check_city(&report, context.params)?;
    context.observer.done(Stage::Split, "scene");
    Ok(Blocks { report, folder })
}

impl Blocks {
    /// The local frame.
    pub(crate) fn frame(&self) -> &Frame {
        &self.report.grid.frame
    }

    /// Columns and rows.
    pub(crate) fn grid(&self) -> [u32; 2] {
        [self.report.grid.columns(), self.report.grid.rows()]
    }

    /// The blocks that hold triangles, as (column, row), row by row.
    pub(crate) fn with_data(&self) -> Vec<(u32, u32)> {
        let entries = self.report.blocks.iter().filter(|b| b.triangles > 0);
        entries.map(|b| (b.core.column, b.core.row)).collect()
    }

    /// The pixels of a block.
    pub(crate) fn core(&self, ix: u32, iy: u32) -> Option<GridWindow> {
        let core = self.report.grid.core(ix, iy)?;
        let step = self.report.grid.step;
        Some(GridWindow { step, x0: core.x0, y0: core.y0, width: core.width, height: core.height })
    }

    /// West, south, east, north of a block; world coordinates.
    pub(crate) fn world_box(&self, ix: u32, iy: u32) -> [f64; 4] {
        let bounds = self.core(ix, iy).map_or_else(Default::default, |w| w.bounds());
        let [x, y, _] = self.frame().origin;
        [bounds.min.x + x, bounds.min.y + y, bounds.max.x + x, bounds.max.y + y]
    }

    /// Local box around all triangles.
    pub(crate) fn extent(&self) -> (DVec3, DVec3) {
        (DVec3::from_array(self.report.min), DVec3::from_array(self.report.max))
    }

    /// The block that a point belongs to, as (row, column) so that owners sort row by row.
    pub(crate) fn owner(&self, p: DVec2) -> (u32, u32) {
        let step = self.report.grid.step;
        let core = self.report.grid.core_of_pixel((p.x / step).floor() as i64, (p.y / step).floor() as i64);
        core.map_or((0, 0), |c| (c.row, c.column))
    }

    /// The triangles of a block.
    pub(crate) fn read(&self, ix: u32, iy: u32) -> Result<BlockMesh, BlocksError> {
        read_block(&self.folder.join(format!("{ix}_{iy}.block")))
    }
}
