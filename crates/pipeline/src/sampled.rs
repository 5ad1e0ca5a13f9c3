//! A mesh as rasters and nothing more: what training needs.

use crate::mosaic::Mosaic;
use crate::stages::{Context, prepare, sample, split};
use crate::workspace::Workspace;
use crate::{Observer, Params, PipelineError, artefact, run};
use gable_files::Reach;
use gable_geometry::Frame;
use gable_ortho::Orthograph;
use gable_raster::GridWindow;
use gable_segmentation::GreenExcess;
use std::path::Path;

/// The rasters of a mesh, in files of a working folder, as the labelling stage sees them.
pub struct SampledMesh {
    frame: Frame,
    ortho: Mosaic<Orthograph>,
    saturation: f32,
}

impl std::fmt::Debug for SampledMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SampledMesh").field("frame", &self.frame).finish_non_exhaustive()
    }
}

/// Splits and samples the mesh at `input`; files go below `work`, which has to last as long as the result.
///
/// # Errors
/// As [`run`](crate::run()).
pub fn sample_mesh(
    input: &Path,
    work: &Path,
    params: &Params,
    observer: &dyn Observer,
) -> Result<SampledMesh, PipelineError> {
    params.check()?;
    let reach = Reach::everything();
    let scene = run::open(input, params, &reach)?;
    artefact::create_dir(work)?;
    let workspace = Workspace::open(work, &scene, params)?;
    let context = Context { params, observer, workspace: &workspace, reach: &reach };
    let blocks = split::run(&context, &scene)?;
    let textures = run::textures(blocks.report.materials.clone(), params, &reach, std::collections::BTreeMap::new());
    let (_, ortho) = sample::run(&context, &blocks, &textures)?;
    let mut green = GreenExcess::default();
    for i in 0..ortho.tiles().len() {
        let maps = ortho.tile(i)?;
        green.accumulate(&maps.colour, &maps.photographed);
    }
    Ok(SampledMesh { frame: blocks.frame().clone(), ortho, saturation: green.saturation() })
}

impl SampledMesh {
    /// The local frame, whose origin the windows count from.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The factor that brings the colours of the mesh to the measure of others ([`gable_segmentation::saturated`]).
    #[must_use]
    pub fn saturation(&self) -> f32 {
        self.saturation
    }

    /// The rasters on a window of the sampling step; empty where there is no mesh.
    ///
    /// # Errors
    /// If a file of the working folder cannot be read.
    pub fn read(&self, window: GridWindow) -> Result<Orthograph, PipelineError> {
        prepare::read(&self.ortho, window)
    }
}
