//! From components of patches to whole buildings with names and owners.

use super::Context;
use crate::{PipelineError, Stage};
use gable_geometry::{DVec2, Frame};
use gable_stitching::{TileComponents, Whole, building_ids, unite};

/// A building that is to be modelled.
#[derive(Clone, Debug)]
pub(crate) struct Task {
    pub(crate) id: String,
    pub(crate) whole: Whole,
    /// Mean of its pixels, local metres.
    pub(crate) centroid: DVec2,
}

/// Whole buildings of at least the smallest area, ordered by place.
pub(crate) fn stitch(
    context: &Context<'_>,
    components: &[TileComponents],
    frame: &Frame,
) -> Result<Vec<Task>, PipelineError> {
    context.observer.stage(Stage::Stitch, 1);
    context.check_cancelled()?;
    let step = context.params.sampling.step;
    let smallest = context.params.segmentation.min_area;
    let wholes: Vec<Whole> = unite(components).into_iter().filter(|w| w.area(step) >= smallest).collect();
    let centroids: Vec<DVec2> = wholes.iter().map(|w| w.centroid(step)).collect();
    let ids = building_ids(&centroids, frame);
    let tasks = wholes.into_iter().zip(ids).zip(centroids);
    context.observer.done(Stage::Stitch, "city");
    Ok(tasks.map(|((whole, id), centroid)| Task { id, whole, centroid }).collect())
}
